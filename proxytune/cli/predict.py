"""`predict`: the poses of a log, or the pictures of its camera, predicted by a fitted model."""

import argparse
from dataclasses import replace
from pathlib import Path

import numpy as np
from rich.text import Text

from proxytune.cli.terminal.answer import Answer
from proxytune.cli.terminal.source_options import configure_source, facts_of, wanted_of
from proxytune.cli.terminal.waiting import waiting
from proxytune.diagnosis import PICTURES, agreement, frames_of, frames_text, predict, predict_pictures, robot_of
from proxytune.driving import Robot, robot_from_geometry, robot_names
from proxytune.effects import Catalogue, Model, read_model
from proxytune.errors import InputError
from proxytune.importing import open_log
from proxytune.logs import Log
from proxytune.report import write_picture, write_text
from proxytune.settings import GEOMETRY


def configure(parser: argparse.ArgumentParser) -> None:
    """Add the model, the log and the windows."""
    parser.add_argument("model", type=Path, metavar="MODEL", help="a model.toml")
    parser.add_argument("log", type=Path, metavar="LOG", help="a log's folder, or a bag, CSV or trajectory")
    parser.add_argument("--robot", metavar="NAME", help="the robot of a bag or table [the model's]")
    parser.add_argument("--horizon", type=float, default=2.0, metavar="S", help="length of the windows [2 s]")
    parser.add_argument("--frames", action="store_true", help="predict what the camera sees instead of poses")
    parser.add_argument(
        "--output",
        type=Path,
        required=True,
        metavar="PATH",
        help="the CSV of predicted poses to write; with --frames the folder for frames.csv and pictures",
    )
    configure_source(parser)


def run(arguments: argparse.Namespace) -> Answer:
    """Predict poses or pictures, write them, and compare them with those measured."""
    catalogue = Catalogue(Path.cwd())
    if not (np.isfinite(arguments.horizon) and arguments.horizon > 0.0):
        raise InputError(f"--horizon must be a positive number of seconds, got {arguments.horizon}")
    model, facts = read_model(arguments.model, catalogue), facts_of(arguments)
    named = replace(facts, robot=facts.robot or model.robot, figures=facts.figures or _stated(model))
    with open_log(arguments.log, wanted_of(arguments), named) as (log, _):
        return _predicted(model, log, arguments, catalogue)


def _stated(model: Model) -> dict[str, float]:
    """The figures of a robot without a folder, as a log.toml names them."""
    keys = {figure: key for key, figure in GEOMETRY.items()}
    return {keys[name]: value for name, value in (model.geometry or {}).items() if name in keys}


def _predicted(model: Model, log: Log, arguments: argparse.Namespace, catalogue: Catalogue) -> Answer:
    if arguments.frames:
        return _predict_pictures(log, _robot(model, log, catalogue), model, arguments.output)
    if log.command == "none":
        frames = "" if log.frames is None else ", or give --frames to predict those"
        raise InputError(f"{log.name}: has no commands to predict poses from; give a log of drives{frames}")
    return _predict_poses(log, _robot(model, log, catalogue), model, arguments)


def _predict_poses(log: Log, robot: Robot, model: Model, arguments: argparse.Namespace) -> Answer:
    table = predict(log, robot, model.theta, arguments.horizon)
    write_text(arguments.output, table.to_csv(index=False))
    rmse = agreement(table, log, arguments.horizon)
    document = {
        "predictions": str(arguments.output),
        "rows": len(table),
        "windows": rmse.windows,
        "horizon_s": arguments.horizon,
        "error": {
            "value": rmse.place,
            "unit": "m",
            "heading": rmse.turn,
            "heading_unit": "rad",
            "poses": rmse.poses,
        },
    }
    error = (
        f"RMSE {1e3 * rmse.place:.1f} mm, {np.degrees(rmse.turn):.2f}° over {rmse.poses} poses"
        if rmse.poses
        else "no drive has measured poses over a whole window"
    )
    return Answer(
        document, Text(f"{document['windows']} windows of {arguments.horizon:g} s: {error}\n{arguments.output}")
    )


def _predict_pictures(log: Log, robot: Robot, model: Model, folder: Path) -> Answer:
    """Every frame as a picture; frames.csv comes last, so that a list never names what is not there."""
    numbers, errors = list[int](), list[float]()
    with waiting("drawing") as tell:
        for part in predict_pictures(log, robot, model.theta):
            for number, picture in zip(part.numbers.tolist(), part.pictures, strict=True):
                write_picture(folder / (PICTURES % number), picture)
            numbers += part.numbers.tolist()
            errors += part.grey_errors.tolist()
            tell(f"drawing: {len(numbers)} frames")
    write_text(folder / "frames.csv", frames_text(log, frames_of(log), numbers))
    error = float(np.mean(errors))
    told = f"{len(numbers)} frames: mean absolute difference on the floor {error:.1f} grey levels\n{folder}"
    return Answer({"frames": len(numbers), "output": str(folder), "grey_error": error}, Text(told))


def _robot(model: Model, log: Log, catalogue: Catalogue) -> Robot:
    if model.robot in robot_names(catalogue.folder):
        return robot_of(log, model.robot, catalogue)
    robot = robot_from_geometry(model.robot, model.geometry or log.geometry, log.rate_hz)
    return replace(robot, catalogue=catalogue)
