"""Files beside a study that its agents may read, and whose changes nobody notices."""

from pathlib import Path

from proxytune.meaning import files_beside, is_module

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
MADE = ("families", "figures", "loop", "rescored", "teaching")
"""Folders that running a study makes."""
NAMED = 3
"""So many files are named at most."""


def unnoticed(folder: Path) -> tuple[str, ...]:
    """One line on files of weights beside a study that has modules of its own; none where there are none."""
    files = files_beside(folder)
    names = [path.relative_to(folder).as_posix() for path in files if path.suffix.lower() in SUFFIXES]
    names = [name for name in names if name.split("/")[0] not in MADE]
    if not names or not any(is_module(path) for path in files):
        return ()
    more = f" and {len(names) - NAMED} more" if len(names) > NAMED else ""
    return (
        f"{', '.join(names[:NAMED])}{more}: if agents read this, a change in it is not noticed; "
        "give agents whose weights change another name",
    )
