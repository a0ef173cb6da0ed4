"""Asking before code beside a study is run for the first time, and remembering which folders are trusted.

Trusted is a folder, not a state of its files, so that one's own study can be edited without being asked again. It is
known by its real path and its owner: another user's folder at the same path is asked for anew.
"""

import json
import os
from collections.abc import Mapping
from contextlib import AbstractContextManager
from importlib.machinery import BYTECODE_SUFFIXES, EXTENSION_SUFFIXES
from pathlib import Path

from proxytune.errors import ExtensionError, InputError
from proxytune.extensions import permitting
from proxytune.files import shipped
from proxytune.identity import files_beside, modules_beside

ALL = "PROXYTUNE_TRUST"
"""The environment variable that trusts whatever is run, as in tests and on a cluster."""
COMPILED = (*BYTECODE_SUFFIXES, *EXTENSION_SUFFIXES)
"""How modules end that are no text."""
NAMED = 4
"""So many modules are named at most."""


def only_trusted_code(trust: bool) -> AbstractContextManager[None]:
    """Have code beside a study refused unless its folder is trusted.

    Args:
        trust: Whether to trust what is met, and remember it.
    """

    def permit(folder: Path, module: str) -> None:
        if os.environ.get(ALL) == "1" or is_trusted(folder) or _is_shipped(folder, module):
            return
        if not trust:
            raise ExtensionError(_request(folder, module))
        remember(folder)

    return permitting(permit)


def is_trusted(folder: Path) -> bool:
    """Whether a folder's code may be run: it, or a study that it lies in, is trusted."""
    real, known = folder.resolve(), _known()
    around = [parent for parent in real.parents if (parent / "study.toml").is_file()]
    return any(known.get(str(one)) == _owner(one) for one in (real, *around))


def remember(folder: Path) -> None:
    """Trust a folder from now on.

    Raises:
        RunError: If that cannot be written down.
    """
    # It brings the figures along, which few commands need.
    from proxytune.report import write_text

    real = folder.resolve()
    kept = {path: owner for path, owner in _known().items() if Path(path).is_dir()}
    folders = {path: {"owner": owner} for path, owner in sorted({**kept, str(real): _owner(real)}.items())}
    write_text(memory(), json.dumps({"format": 1, "folders": folders}, indent=2) + "\n")


def memory() -> Path:
    """Where trusted folders are remembered."""
    state = os.environ.get("XDG_STATE_HOME", "")
    home = Path(state) if os.path.isabs(state) else Path.home() / ".local" / "state"
    return home / "proxytune" / "trusted.json"


def _known() -> Mapping[str, int]:
    """The owner of each trusted folder.

    Raises:
        InputError: If the file is none that we wrote.
    """
    path = memory()
    try:
        return {str(folder): int(of["owner"]) for folder, of in json.loads(path.read_bytes())["folders"].items()}
    except FileNotFoundError:
        return {}
    except (OSError, ValueError, KeyError, TypeError, AttributeError, RecursionError):
        raise InputError(f"{path}: is damaged; delete it, and trust your studies again") from None


def _owner(folder: Path) -> int:
    try:
        return folder.stat().st_uid
    except OSError:
        return -1


def _is_shipped(folder: Path, module: str) -> bool:
    """Whether all modules of a folder, this one among them, are those of a study that comes with proxytune."""
    own = _contents(folder)
    top = module.partition(".")[0]
    if not any(name.split("/")[0] in (top, f"{top}.py") for name in own):
        return False
    homes = [home for home in shipped("studies").iterdir() if home.is_dir()]
    if any(home.samefile(folder) for home in homes):
        return True
    return not _compiled_beside(folder) and any(_contents(home) == own for home in homes)


def _contents(folder: Path) -> dict[str, bytes]:
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in modules_beside(folder)}


def _compiled_beside(folder: Path) -> list[Path]:
    """What Python may run of a folder though nobody can read it: libraries, and bytecode, maybe of another text."""
    files = files_beside(folder)
    homes = sorted({folder, *(path.parent for path in files)})
    cached = [path for home in homes for path in sorted((home / "__pycache__").glob("*.pyc"))]
    return [*(path for path in files if path.name.endswith(COMPILED)), *cached]


def _request(folder: Path, module: str) -> str:
    files = [path.relative_to(folder).as_posix() for path in (*modules_beside(folder), *_compiled_beside(folder))]
    more = f" and {len(files) - NAMED} more" if len(files) > NAMED else ""
    beside = f", where {', '.join(files[:NAMED])}{more} lie" if files else ""
    where = f"module '{module}', named in {folder.resolve()}{beside}"
    remedy = f"read it, then add --trust, once for this folder, or set {ALL}=1"
    return f"this runs code that has not been run here before: {where}; {remedy}"
