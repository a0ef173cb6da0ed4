"""`export`: what was found, written to a URDF, a MuJoCo model or ROS parameters, or a study's trials for others."""

import argparse
from collections.abc import Callable, Mapping
from pathlib import Path

from rich.text import Text

from proxytune.api.studies import read_study
from proxytune.cli.terminal.answer import Answer
from proxytune.driving import LaneFollowing, Robot, read_robot, robot_from_geometry, robot_names
from proxytune.effects import Catalogue, Model, read_model
from proxytune.errors import InputError
from proxytune.report import (
    FORMATS,
    ExportLine,
    Instance,
    export_lines,
    mjcf_text,
    ros_text,
    urdf_text,
    write_text,
    write_whole,
)
from proxytune.search import History, write_optuna, write_skopt
from proxytune.study import bare_family

TRIALS: Mapping[str, Callable[[History, Path], None]] = {"optuna": write_optuna, "skopt": write_skopt}
"""What takes the trials of a study, not what was found."""
WRITERS: Mapping[str, Callable[[Instance], str]] = {"urdf": urdf_text, "mjcf": mjcf_text, "ros": ros_text}
NO_RATE_HZ = 20.0
"""A robot without a folder has no rate of control; none of the formats states one."""


def configure(parser: argparse.ArgumentParser) -> None:
    """Add what is exported, as what, and where to."""
    parser.add_argument("model", type=Path, metavar="MODEL", help="a model.toml, or a study's folder: its best θ")
    parser.add_argument(
        "--to",
        required=True,
        choices=(*FORMATS, *TRIALS),
        help="URDF, MuJoCo model or ROS 2 parameters; of a study its trials: Optuna storage or skopt's OptimizeResult",
    )
    parser.add_argument("--output", type=Path, required=True, metavar="FILE", help="the file to write")


def run(arguments: argparse.Namespace) -> Answer:
    """Write the file, and say what went where and what has no place."""
    if arguments.to in TRIALS:
        return _trials(arguments)
    instance = _of_study(arguments.model) if arguments.model.is_dir() else _of_model(arguments.model)
    text, lines = WRITERS[arguments.to](instance), export_lines(instance, arguments.to)
    write_text(arguments.output, text)
    document = {
        "output": str(arguments.output),
        "to": arguments.to,
        "robot": instance.robot.name,
        "written": [_row(line) for line in lines if line.place],
        "no_place": [_row(line) for line in lines if not line.place],
    }
    return Answer(document, Text("\n".join([*map(str, lines), str(arguments.output)])))


def _trials(arguments: argparse.Namespace) -> Answer:
    """Write all trials of a study; a file that is there may be a storage with other studies, so it is left alone."""
    folder, output = arguments.model, arguments.output
    if not folder.is_dir():
        raise InputError(f"{folder}: --to {arguments.to} takes the trials of a study; give the study's folder")
    if output.exists():
        raise InputError(f"{output}: is there already; give another name, or move it away")
    history = read_study(folder).history()
    write_whole(output, "", lambda draft: TRIALS[arguments.to](history, draft))
    document = {"output": str(output), "to": arguments.to, "name": history.name, "trials": len(history.trials)}
    look = f"\nlook: optuna-dashboard sqlite:///{output}" if arguments.to == "optuna" else ""
    return Answer(document, Text(f"{len(history.trials)} trials of '{history.name}'\n{output}{look}"))


def _row(line: ExportLine) -> dict[str, object]:
    interval = list(line.interval) if line.interval else None
    return {
        "name": line.name,
        "value": line.value,
        "interval": interval,
        "unit": line.unit,
        "place": line.place or None,
    }


def _of_model(path: Path) -> Instance:
    """What a model.toml says; its robot and its own effects are looked for in the current folder."""
    catalogue = Catalogue(Path.cwd())
    model = read_model(path, catalogue)
    robot = _robot(model, catalogue, path)
    return Instance(robot, {**robot.theta, **model.theta}, model.intervals, str(path))


def _robot(model: Model, catalogue: Catalogue, path: Path) -> Robot:
    if model.robot in robot_names(catalogue.folder):
        return read_robot(model.robot, catalogue.folder)
    if not model.geometry:
        raise InputError(
            f"{path}: its robot '{model.robot}' is unknown here; go to the folder that {model.robot} lies in"
        )
    return robot_from_geometry(model.robot, model.geometry, NO_RATE_HZ)


def _of_study(folder: Path) -> Instance:
    """The best θ of a study, with its 95 % intervals."""
    result = read_study(folder).result
    settings, region = result.study.settings, result.knowledge
    family = bare_family(settings, settings.proxy)
    if not isinstance(family, LaneFollowing):
        raise InputError(f"{folder}: is a study of another simulator; only what drives here can be exported")
    robot = read_robot(family.robot, family.folder)
    theta = {**robot.theta, **dict(family.effects), **result.best.trial.theta}
    return Instance(robot, theta, dict(region.intervals), f"the best θ of the study {settings.name}")
