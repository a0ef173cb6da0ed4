"""The name under which a family's episodes are kept: a digest of all but the episode that determines a result."""

import functools
import hashlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from proxytune.driving import lineage
from proxytune.meaning import meaning_of, modules_beside

PACKAGE = Path(__file__).resolve().parent.parent


def identity_of(settings: tuple[Any, ...], robot: Path, folder: Path, versions: Mapping[str, str]) -> str:
    """A digest of settings, of what our code, the robot's files and the user's modules mean, and of versions.

    Args:
        settings: Of the family, without the folder.
        robot: The robot's folder.
        folder: Where the user's modules lie.
        versions: Of the packages that simulate.
    """
    own = meaning_of(modules_beside(folder), folder)
    parts = (settings, lineage.named(code_meaning()), robot_meaning(robot), own, sorted(versions.items()))
    return hashlib.sha256(repr(parts).encode()).hexdigest()[:16]


def earlier_identities(settings: tuple[Any, ...], robot: Path, folder: Path) -> tuple[str, ...]:
    """The identities under which earlier code kept episodes that are those of today, to the last bit.

    Args:
        settings: Of the family, those that there were then.
        robot: The robot's folder.
        folder: Where the user's modules lie; they counted by their bytes, without those in packages.
    """
    code = lineage.digest_of_54760ad(robot.name, robot_meaning(robot), code_meaning())
    if code is None:
        return ()
    own = b"".join(path.read_bytes() for path in sorted(folder.glob("*.py")))
    return (hashlib.sha256(repr(settings).encode() + own + code).hexdigest()[:16],)


@functools.lru_cache
def code_meaning() -> str:
    """What the code of effects and of driving means; what is said in `lineage` about earlier code is no part of it."""
    modules = [path for room in ("effects", "driving") for path in (PACKAGE / room).rglob("*.py")]
    return meaning_of((path for path in modules if path != Path(lineage.__file__).resolve()), PACKAGE)


@functools.lru_cache
def robot_meaning(robot: Path) -> str:
    """What the files of a robot's folder mean."""
    return meaning_of((path for path in robot.iterdir() if path.is_file()), robot)
