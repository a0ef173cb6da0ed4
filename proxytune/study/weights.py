"""Files beside a study that its agents may read, and whose changes nobody notices."""

from pathlib import Path

from proxytune.meaning import files_beside, modules_beside

SUFFIXES = (
    ".ckpt",
    ".h5",
    ".joblib",
    ".keras",
    ".npy",
    ".npz",
    ".onnx",
    ".pickle",
    ".pkl",
    ".pt",
    ".pth",
    ".safetensors",
    ".tflite",
)
MADE = ("figures", "rescored", "teaching")
"""Folders that running a study makes."""
NAMED = 3
"""So many files are named at most."""


def unnoticed(folder: Path) -> tuple[str, ...]:
    """One line on files of weights beside a study that has modules of its own; none where there are none."""
    names = [path.relative_to(folder).as_posix() for path in files_beside(folder) if path.suffix.lower() in SUFFIXES]
    names = [name for name in names if name.split("/")[0] not in MADE]
    if not names or not modules_beside(folder):
        return ()
    more = f" and {len(names) - NAMED} more" if len(names) > NAMED else ""
    return (
        f"{', '.join(names[:NAMED])}{more}: if agents read this, a change in it is not noticed; "
        "give agents whose weights change another name",
    )
