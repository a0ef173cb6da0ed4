"""Versions of the packages that results depend on, and what has changed of them, in words."""

from collections.abc import Iterable, Mapping
from importlib.metadata import PackageNotFoundError, version

CALLED = {"numpy": "NumPy", "pybullet": "PyBullet", "scipy": "SciPy", "optuna": "Optuna"}
"""What a package is called, where that is not its name."""


def versions_of(packages: Iterable[str]) -> dict[str, str]:
    """The version of each package, without importing it; "unknown" where it was not installed as one."""
    return {package: _version(package) for package in packages}


def version_changes(before: Mapping[str, str], after: Mapping[str, str]) -> list[str]:
    """Each package whose version has changed, as one phrase for the user."""
    both = {name: (before.get(name, "not used"), after.get(name, "not used")) for name in {**after, **before}}
    return [f"{CALLED.get(name, name)} {new} (was {old})" for name, (old, new) in both.items() if old != new]


def _version(package: str) -> str:
    try:
        return version(package)
    except PackageNotFoundError:
        return "unknown"
