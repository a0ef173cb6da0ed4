"""The foot of a page: the command, settings, versions and the date."""

import platform
from collections.abc import Iterable
from datetime import datetime

from proxytune.identity import versions_of
from proxytune.report.page.parts import Foot

PACKAGES = ("proxytune", "numpy", "scipy", "pybullet")
"""What figures may depend on."""


def foot_of(command: str, settings: Iterable[tuple[str, str]] = ()) -> Foot:
    """The foot of a page that is written now."""
    known = [(name, version) for name, version in versions_of(PACKAGES).items() if version != "unknown"]
    versions = (("Python", platform.python_version()), *known)
    return Foot(command, tuple(settings), versions, f"{datetime.now().astimezone():%Y-%m-%d %H:%M %Z}")
