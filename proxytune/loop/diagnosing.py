"""From the target's log to the extended study.

The log is recorded of a twin or given, and diagnosed as by `diagnose`; what is read of its document is read through
before anything is made of it. The extended study is the study itself with what it may read beside it, by a proxy that
has what the diagnosis found.
"""

import json
import os
import shutil
from pathlib import Path
from typing import Any

import tomlkit

from proxytune.api import DiagnosisReport, Wanted, recordable
from proxytune.diagnosis import camera_effects, diagnose_log, film, forget_stages, motion_effects, robot_of
from proxytune.driving import robot_home
from proxytune.effects import Catalogue, effect_of
from proxytune.errors import RunError, SettingsError, StoreError
from proxytune.extensions import describe
from proxytune.importing import open_log
from proxytune.loop.comparison import NEXT, compare_errors, floor_text, lacking, level_text, next_step, theta_table
from proxytune.loop.opening import Loop, Teller
from proxytune.report import figures_also_as, findings, write_text
from proxytune.settings import read_settings
from proxytune.storage import Store, locked
from proxytune.study import FILE_NAME, MADE, Study, StudyRun, StudySettings, check_facts, study_facts

FRAMES = 120
"""So many pictures are recorded where the camera matters: as many name an effect on it (closing_the_camera_loop)."""


def wanted_of(loop: Loop) -> Wanted:
    """The wanted record of a twin: frames too where the study declares anything of the camera."""
    of_camera = camera_effects(Catalogue(loop.settings.folder.resolve()))
    seen = any(name in of_camera for name in declared_names(loop))
    return Wanted(frames=FRAMES if seen else 0, seed=loop.settings.seed)


def check_camera(loop: Loop) -> None:
    """Refuse a twin of which frames cannot be recorded, before anything is driven."""
    if loop.log is not None or loop.twin is None or not wanted_of(loop).frames:
        return
    try:
        film(recordable(loop.settings, loop.twin), FRAMES, loop.settings.seed)
    except SettingsError as problem:
        remedy = "give a log of it by --log, or take what is of the camera out of [parameters]"
        raise SettingsError(f"{loop.twin}: no frames can be recorded ({problem}); {remedy}") from None


def diagnose_target(loop: Loop, source: Path, folder: Path, teller: Teller) -> None:
    """Diagnose a log, and write what `diagnose` does: diagnosis.json, model.toml and figures."""
    with open_log(source, facts=loop.facts) as (log, notes):
        for note in notes:
            teller.say(note)
        robot = robot_of(log, loop.robot, Catalogue(loop.settings.folder.resolve()))
        with teller.diagnosis(log) as report:
            known, seed = motion_effects(robot.catalogue), loop.settings.seed
            # What the study declares and this log can be asked for
            known = known if log.frames is None else (*known, *camera_effects(robot.catalogue))
            declared = tuple(name for name in declared_names(loop) if name in known)
            found = diagnose_log(log, robot, declared, seed=seed, report=report, folder=folder)
            report("drawing")
            with figures_also_as(("svg",)):
                DiagnosisReport(found).write(folder)
            forget_stages(folder)


def read_diagnosis(folder: Path) -> dict[str, Any]:
    """The diagnosis that was written."""
    path = folder / "diagnosis.json"
    try:
        document: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
        # All that a loop reads later is read here, so that a damaged document is refused at once.
        json.dumps(document, allow_nan=False)
        lacking(document), theta_table({}, {}, document)
        for row in compare_errors(document):
            for level in (row.before, row.after):
                level_text(level, row.unit), floor_text(level, row.unit)
        for told in (document, document["camera"] or document):
            findings(told["effects"])
            told["verdict"], told["effects"], told["extended"]
        for studied, model in (("", "model.toml"), (f"{NEXT}diagnose", "")):
            next_step(document, studied, model, {})
    except (OSError, ValueError, TypeError, KeyError, AttributeError, OverflowError, RecursionError) as problem:
        raise RunError(f"{path}: cannot be read ({describe(problem)}); remove it and run again") from None
    return document


def declared_names(loop: Loop) -> tuple[str, ...]:
    """The effects of the study's box, then those that its proxy has."""
    names = [*loop.settings.space.names, *dict(getattr(loop.family, "effects", ()))]
    return tuple(dict.fromkeys(effect_of(name) for name in names))


LEFT_OUT = (*MADE, "study.db*", "study.lock", "report.html", "sweeps", "__pycache__", "*.md", ".*", FILE_NAME)
"""What a run makes, and what is written anew."""
A_FOLDER_OF_ITS_OWN = (FILE_NAME, "log.toml")
"""A folder with one of these is another study, or a log."""


def extension_text(settings: StudySettings, model: Path, folder: Path) -> str:
    """The study.toml of the extended study in this folder: as the study's own, but for its proxy and its paths."""
    values = dict(read_settings(settings.path).values)
    values |= {"name": f"{settings.name}_extended", "proxy": _from(folder, model)}
    targets = [_from(folder, path) for path in settings.targets]
    values["target"] = targets if len(targets) > 1 else targets[0]
    if settings.truth:
        values["truth"] = _from(folder, settings.truth)
    # Trials of earlier studies are of the proxy without what was found.
    values.pop("learn_from", None)
    if settings.low_fidelity:
        named = [(name, settings.folder / name) for name in settings.low_fidelity]
        values["low_fidelity"] = [_from(folder, path) if path.exists() else name for name, path in named]
    domain = {key: value for key, value in settings.domain.items() if key != "effects"}
    if Path(road := settings.domain.text("map", "")).parent.name:
        domain["map"] = _from(folder, settings.folder / road)
    found = read_settings(model).section("effects").keys()
    # What the study's own proxy has beside what was diagnosed stays.
    proxy = read_settings(settings.proxy).section("effects").values if settings.proxy else {}
    own = settings.domain.section("effects").values
    kept = {name: {**proxy.get(name, {}), **own.get(name, {})} for name in {**proxy, **own} if name not in found}
    values["domain"] = {**domain, "effects": kept} if kept else domain
    return f"# {settings.name} with what `diagnose` found, written by `loop`.\n" + tomlkit.dumps(values)


def write_extension(settings: StudySettings, robot: str, model: Path, folder: Path) -> None:
    """Write the extended study, with the study's own modules, robots, maps and weights beside it."""
    # Without study.toml its modules would count as the study's own.
    write_text(folder / FILE_NAME, extension_text(settings, model, folder))
    try:
        for path in files_of(settings, robot):
            if path.is_dir():
                shutil.copytree(path, folder / path.name, ignore=_ignored, dirs_exist_ok=True)
            else:
                shutil.copy2(path, folder / path.name)
    except (OSError, shutil.Error) as problem:
        raise StoreError(f"{folder}: cannot be written ({problem}); make room and run again") from None


def files_of(settings: StudySettings, robot: str) -> list[Path]:
    """The files and folders beside study.toml that a study may read, and its robot if that lies beside the study."""
    names = [path.name for path in settings.folder.iterdir() if path not in settings.targets]
    own = [settings.folder / name for name in sorted({*names} - _ignored(str(settings.folder), names))]
    home = robot_home(robot, settings.folder)
    return [*own, home] if home.parent == settings.folder.resolve().parent else own


def begin_anew_if_changed(study: Study) -> None:
    """Forget the trials of an extended study that was another one; its episodes are kept."""
    with locked(study.settings.folder), Store.open(study.settings.folder) as store:
        try:
            check_facts(StudyRun(study, store))
        except SettingsError:
            store.begin(study_facts(study), study.objective.name)


def _ignored(folder: str, names: list[str]) -> set[str]:
    made = shutil.ignore_patterns(*LEFT_OUT)(folder, names)
    own = {name for name in names if any(Path(folder, name, one).exists() for one in A_FOLDER_OF_ITS_OWN)}
    return made | own


def _from(folder: Path, path: Path) -> str:
    return Path(os.path.relpath(path.resolve(), folder.resolve())).as_posix()
