"""A log's whole diagnosis, of motion and camera: one JSON document, one model.toml, one folder of figures."""

from collections.abc import Mapping
from typing import Any

from matplotlib.figure import Figure
from rich.console import Group
from rich.text import Text

from proxytune.diagnosis import CameraDiagnosis, Diagnosis, LogDiagnosis
from proxytune.driving import robot_names
from proxytune.effects import Model, model_text
from proxytune.logs import GEOMETRY
from proxytune.report.diagnosis.camera.document import camera_document
from proxytune.report.diagnosis.camera.figures import camera_figures
from proxytune.report.diagnosis.camera.tables import camera_tables_and_notes
from proxytune.report.diagnosis.camera.words import camera_headline, camera_notes
from proxytune.report.diagnosis.document import document, tables_and_notes
from proxytune.report.diagnosis.figures import diagnosis_figures
from proxytune.report.diagnosis.notes import headline, notes

TOP = ("verdict", "declared", "effects", "extended", "could_not_be_seen")
"""What the document says of the camera above all, where there is nothing to say of motion."""


def whole_document(found: LogDiagnosis) -> dict[str, Any]:
    """Everything that `diagnose --json` prints: motion above, `camera` beside it."""
    camera = None if found.camera is None else camera_document(found.camera)
    top = {"log": found.log, "robot": found.robot.name}
    if found.motion is not None:
        top |= document(found.motion)
    elif camera is not None:
        top |= {key: camera[key] for key in TOP}
    refused = {"motion_refused": found.motion_refused or None, "camera_refused": found.camera_refused or None}
    return {**top, "camera": camera, **refused}


def whole_figures(found: LogDiagnosis) -> Mapping[str, Figure]:
    """Every figure that there is something to draw for, by name."""
    motion = {} if found.motion is None else diagnosis_figures(found.motion)
    camera = {} if found.camera is None else camera_figures(found.camera)
    return {**motion, **camera}


def whole_headline(found: LogDiagnosis) -> str:
    """The verdicts and what they mean."""
    lines = [] if found.motion is None else [headline(found.motion)]
    lines += [] if found.camera is None else [camera_headline(found.log, found.camera)]
    return "; ".join(lines)


def whole_notes(found: LogDiagnosis) -> list[str]:
    """What the tables do not hold, a line each."""
    motion = [] if found.motion is None else notes(found.motion)
    camera = [] if found.camera is None else camera_notes(found.camera)
    return [*motion, *camera, *refusals(found)]


def refusals(found: LogDiagnosis) -> list[str]:
    """Why a part is missing, a line each."""
    parts = (("motion", found.motion_refused), ("camera", found.camera_refused))
    return [f"{part}: {why}" for part, why in parts if why]


def whole_tables_and_notes(found: LogDiagnosis) -> Group:
    """The diagnosis as `diagnose` prints it."""
    motion = [] if found.motion is None else [tables_and_notes(found.motion)]
    camera = [] if found.camera is None else [camera_tables_and_notes(found.log, found.camera)]
    between = [Text("")] if motion and camera else []
    return Group(*motion, *between, *camera, *map(Text, refusals(found)))


def model_file(found: LogDiagnosis) -> str:
    """The extended model of both as model.toml."""
    robot, parts = found.robot, [part for part in (found.motion, found.camera) if part is not None]
    estimates = {name: one for part in parts for name, one in part.theta.items()}
    theta = {name: robot.catalogue.parameters[name].clipped(float(one.value)) for name, one in estimates.items()}
    theta |= {} if found.motion is None else dict(found.motion.learning.theta)
    bounds = {name: (float(one.interval[0]), float(one.interval[1])) for name, one in estimates.items()}
    in_robots = robot.name in robot_names(robot.catalogue.folder)
    geometry = {} if in_robots else {figure: robot.figures[figure] for figure in GEOMETRY.values()}
    comments = [_comment("" if part is found.motion else "camera: ", part, found.log) for part in parts]
    return model_text(Model(robot.name, None, theta, bounds, geometry), comments, robot.catalogue)


def _comment(kind: str, part: Diagnosis | CameraDiagnosis, log: str) -> str:
    added = ", ".join(effect.effect for effect in part.effects) or "nothing"
    return f"{kind}{part.verdict}: fitted to {log}; added to what was declared: {added}"
