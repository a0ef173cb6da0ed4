"""What the code means that a user brings to a study: its failures are remembered until it changes."""

import hashlib
import sys
from pathlib import Path

from proxytune.meaning import meaning_of, modules_beside
from proxytune.study.settings import StudySettings


def code_of(settings: StudySettings) -> str:
    """A digest of the modules in a study's folder, and of installed ones that its family and its agents come from.

    Modules that these import in turn are not looked at where they lie elsewhere.
    """
    names = {name.partition(":")[0] for name in (settings.family, *settings.loaded_agents) if ":" in name}
    installed = [_meaning_of_installed(name) for name in sorted(names) if not name.startswith("proxytune.")]
    own = meaning_of(modules_beside(settings.folder), settings.folder)
    return hashlib.sha256(repr((own, installed)).encode()).hexdigest()[:16]


def _meaning_of_installed(name: str) -> str:
    """What an imported module means; empty where it has no file, or lies in the study's folder."""
    file = getattr(sys.modules.get(name), "__file__", None)
    return meaning_of([Path(file)], Path(file).parent) if file and Path(file).is_file() else ""
