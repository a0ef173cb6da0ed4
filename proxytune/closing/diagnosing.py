"""What the target's log says that the proxy lacks."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from proxytune.api.diagnosing import DiagnosisReport
from proxytune.api.recording import Wanted, recordable
from proxytune.closing.comparison import compare_errors
from proxytune.closing.opening import Loop
from proxytune.closing.steps import Teller
from proxytune.closing.wording import NEXT, floor_text, following, lacking, level_text
from proxytune.diagnosis.camera.diagnose import camera_effects
from proxytune.diagnosis.filming import film
from proxytune.diagnosis.log_diagnosis import diagnose_log
from proxytune.diagnosis.measured.vehicle import robot_of
from proxytune.diagnosis.naming.candidates import motion_effects
from proxytune.driving.robot import Robot
from proxytune.effects import Catalogue
from proxytune.effects.catalogue import effect_of
from proxytune.errors import RunError, SettingsError
from proxytune.extensions import describe
from proxytune.importing.opening import open_log
from proxytune.logs import Log

FRAMES = 120
"""So many pictures are recorded where the camera matters: as many name an effect on it (closing_the_camera_loop)."""


def wanted_of(loop: Loop) -> Wanted:
    """What is recorded of a twin: frames too where the study declares anything of the camera."""
    of_camera = camera_effects(Catalogue(loop.settings.folder.resolve()))
    seen = any(name in of_camera for name in declared_names(loop))
    return Wanted(frames=FRAMES if seen else 0, seed=loop.settings.seed)


def check_camera(loop: Loop) -> None:
    """Refuse a twin of which frames cannot be recorded, before anything is driven.

    Raises:
        InputError: If it has no camera, or nobody who drives along lanes.
    """
    if loop.log is not None or loop.twin is None or not wanted_of(loop).frames:
        return
    try:
        film(recordable(loop.settings, loop.twin), FRAMES, loop.settings.seed)
    except SettingsError as problem:
        remedy = "give a log of it by --log, or take what is of the camera out of [parameters]"
        raise SettingsError(f"{loop.twin}: no frames can be recorded ({problem}); {remedy}") from None


def diagnose_target(loop: Loop, source: Path, folder: Path, teller: Teller) -> None:
    """Diagnose a log, and write what `diagnose` does: diagnosis.json, model.toml and figures.

    What is declared is all that the study's box and its proxy have.

    Raises:
        LogError: If the log cannot bear the question.
        RunError: If a file cannot be written.
    """
    with open_log(source, facts=loop.facts) as (log, notes):
        for note in notes:
            teller.say(note)
        robot = robot_of(log, loop.robot, Catalogue(loop.settings.folder.resolve()))
        with teller.diagnosis(log) as report:
            found = diagnose_log(log, robot, declared_of(loop, robot, log), seed=loop.settings.seed, report=report)
            report("drawing")
            DiagnosisReport(found).write(folder)


def declared_of(loop: Loop, robot: Robot, log: Log) -> tuple[str, ...]:
    """The effects that the study declares and that this log can be asked for."""
    known = motion_effects(robot.catalogue)
    known = known if log.frames is None else (*known, *camera_effects(robot.catalogue))
    return tuple(name for name in declared_names(loop) if name in known)


def read_diagnosis(folder: Path) -> dict[str, Any]:
    """The diagnosis that was written.

    Raises:
        RunError: If it cannot be read, or lacks something that a loop reads of it.
    """
    path = folder / "diagnosis.json"
    try:
        document: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
        _read_through(document)
    except (OSError, ValueError, TypeError, KeyError, AttributeError, OverflowError, RecursionError) as problem:
        raise RunError(f"{path}: cannot be read ({describe(problem)}); remove it and run again") from None
    return document


def _read_through(document: Mapping[str, Any]) -> None:
    """Read all that a loop reads, so that what is spoilt shows before anything is made of it."""
    json.dumps(document, allow_nan=False)
    lacking(document)
    for row in compare_errors(document):
        for level in (row.before, row.after):
            level_text(level, row.unit), floor_text(level, row.unit)
    for told in (document, document["camera"] or document):
        told["verdict"], told["effects"], told["extended"]
    for studied, model in (("", "model.toml"), (f"{NEXT}diagnose", "")):
        following(document, studied, model, {})


def adds_something(document: Mapping[str, Any]) -> bool:
    """Whether a diagnosis found anything to extend the proxy by: named effects, or curves."""
    camera = document["camera"] or {}
    return bool(document["effects"] or camera.get("effects") or document.get("learnt", {}).get("used"))


def declared_names(loop: Loop) -> tuple[str, ...]:
    """The effects of the study's box, then those that its proxy has."""
    names = [*loop.settings.space.names, *dict(getattr(loop.family, "effects", ()))]
    return tuple(dict.fromkeys(effect_of(name) for name in names))
