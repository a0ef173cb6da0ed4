"""Where the robots and studies that travel with the package lie."""

from pathlib import Path

from proxytune.errors import SettingsError


def shipped(kind: str) -> Path:
    """The folder `robots` or `studies`: within an installed package, or beside the package in a checkout.

    Raises:
        SettingsError: If the installation has lost the folder.
    """
    package = Path(__file__).resolve().parent
    for home in (package, package.parent):
        if (home / kind).is_dir():
            return home / kind
    raise SettingsError(f"{package}: the folder '{kind}' is missing; install proxytune again")
