"""The extended study: the same study by a proxy that has what the diagnosis found."""

import os
import shutil
from pathlib import Path
from typing import Any

import tomlkit

from proxytune.errors import SettingsError, StoreError
from proxytune.report.writing import write_text
from proxytune.settings import read_settings
from proxytune.storage.lock import locked
from proxytune.storage.store import Store
from proxytune.study.run import check_facts
from proxytune.study.settings import FILE_NAME, StudySettings
from proxytune.study.study import Study, facts
from proxytune.study.study_run import StudyRun
from proxytune.study.weights import MADE

LEFT_OUT = (*MADE, "study.db*", "study.lock", "report.html", "sweeps", "__pycache__", "*.md", ".*", FILE_NAME)
"""What a run makes, and what is written anew."""
A_FOLDER_OF_ITS_OWN = (FILE_NAME, "log.toml")
"""A folder with one of these is another study, or a log."""


def extension_text(settings: StudySettings, model: Path, folder: Path) -> str:
    """The study.toml of the extended study: as the study's own, but for its proxy and its paths.

    What the study's own proxy has beside what was diagnosed stays, as [domain.effects].

    Args:
        settings: The study's.
        model: The model.toml that was found.
        folder: Where the extended study is to lie.
    """
    values = dict(read_settings(settings.path).values)
    values |= {"name": f"{settings.name}_extended", "proxy": _from(folder, model)}
    targets = [_from(folder, path) for path in settings.targets]
    values["target"] = targets if settings.more_targets else targets[0]
    if settings.truth:
        values["truth"] = _from(folder, settings.truth)
    domain = {key: value for key, value in settings.domain.items() if key != "effects"}
    kept = _kept_effects(settings, model)
    values["domain"] = {**domain, "effects": kept} if kept else domain
    return f"# {settings.name} with what `diagnose` found, written by `loop`.\n" + tomlkit.dumps(values)


def write_extension(settings: StudySettings, model: Path, folder: Path) -> None:
    """Write the extended study, with the study's own modules, robots, maps and weights beside it.

    Raises:
        RunError: If it cannot be written.
    """
    # Without study.toml its modules would count as the study's own.
    write_text(folder / FILE_NAME, extension_text(settings, model, folder))
    try:
        for path in files_of(settings):
            _copy(path, folder / path.name)
    except (OSError, shutil.Error) as problem:
        raise StoreError(f"{folder}: cannot be written ({problem}); make room and run again") from None


def files_of(settings: StudySettings) -> list[Path]:
    """The files and folders beside study.toml that a study may read."""
    names = [path.name for path in settings.folder.iterdir() if path not in settings.targets]
    return [settings.folder / name for name in sorted({*names} - _ignored(str(settings.folder), names))]


def begin_anew_if_changed(study: Study) -> None:
    """Forget the trials of an extended study that was another one; its episodes are kept."""
    with locked(study.settings.folder), Store.open(study.settings.folder) as store:
        try:
            check_facts(StudyRun(study, store))
        except SettingsError:
            store.begin(facts(study), study.objective.name)


def _copy(source: Path, target: Path) -> None:
    if source.is_dir():
        shutil.copytree(source, target, ignore=_ignored, dirs_exist_ok=True)
    else:
        shutil.copy2(source, target)


def _ignored(folder: str, names: list[str]) -> set[str]:
    """What is not copied of a folder's entries."""
    made = shutil.ignore_patterns(*LEFT_OUT)(folder, names)
    own = {name for name in names if any(Path(folder, name, one).exists() for one in A_FOLDER_OF_ITS_OWN)}
    return made | own


def _kept_effects(settings: StudySettings, model: Path) -> dict[str, Any]:
    """Effects of the study's proxy and [domain] that the found model does not have."""
    found = read_settings(model).section("effects").keys()
    proxy = read_settings(settings.proxy).section("effects").values if settings.proxy else {}
    own = settings.domain.section("effects").values
    return {name: {**proxy.get(name, {}), **own.get(name, {})} for name in {**proxy, **own} if name not in found}


def _from(folder: Path, path: Path) -> str:
    return Path(os.path.relpath(path.resolve(), folder.resolve())).as_posix()
