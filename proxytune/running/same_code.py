"""Whether another machine has the code and the packages that results depend on, as they are here."""

import hashlib
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from platform import node, python_version

from proxytune.errors import InputError
from proxytune.identity import version_changes, versions_of

PACKAGES = ("numpy", "scipy", "scikit-learn", "pybullet", "joblib", "distributed")
HOME = Path(__file__).resolve().parent.parent
DATA = ("robots/", "studies/")
"""What a wheel has in the package and a checkout beside it."""


@cache
def made_by() -> Mapping[str, str]:
    """What results depend on besides their settings: proxytune's own code, Python and packages."""
    return {"proxytune": f"code {_digest()}", "Python": python_version(), **versions_of(PACKAGES)}


def check_code(theirs: Mapping[str, str]) -> None:
    """Refuse to work for a process of which the results may differ.

    Raises:
        InputError: If anything has another version there.
    """
    changes = version_changes(theirs, made_by())
    if changes:
        raise InputError(f"the worker on {node()} has {', '.join(changes)}; install the same there as here")


def _digest() -> str:
    paths = {path.relative_to(HOME).as_posix(): path for path in sorted(HOME.rglob("*.py"))}
    own = {name: path.read_bytes() for name, path in paths.items() if not name.startswith(DATA)}
    return hashlib.sha256(repr(own).encode()).hexdigest()[:12]
