"""`predict`: the poses of a log, predicted by a fitted model."""

import argparse
from dataclasses import replace
from pathlib import Path

import numpy as np
from rich.text import Text

from proxytune.cli.terminal.answer import Answer
from proxytune.diagnosis.horizon.prediction import agreement, predict
from proxytune.diagnosis.measured.vehicle import robot_of
from proxytune.driving.robot import Robot, robot_from_geometry, robot_names
from proxytune.effects import Catalogue, Model, read_model
from proxytune.errors import InputError
from proxytune.logs import Log, read_log
from proxytune.report.writing import write_text


def configure(parser: argparse.ArgumentParser) -> None:
    """Add the model, the log and the windows."""
    parser.add_argument("model", type=Path, metavar="MODEL", help="a model.toml")
    parser.add_argument("log", type=Path, metavar="LOG", help="a log's folder")
    parser.add_argument("--horizon", type=float, default=2.0, metavar="S", help="length of the windows [2 s]")
    parser.add_argument("--output", type=Path, required=True, metavar="CSV", help="the predicted poses to write")


def run(arguments: argparse.Namespace) -> Answer:
    """Predict every window, write the poses, and compare them with those measured."""
    if not (np.isfinite(arguments.horizon) and arguments.horizon > 0.0):
        raise InputError(f"--horizon must be a positive number of seconds, got {arguments.horizon}")
    catalogue = Catalogue(Path.cwd())
    model, log = read_model(arguments.model, catalogue), read_log(arguments.log)
    table = predict(log, _robot(model, log, catalogue), model.theta, arguments.horizon)
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


def _robot(model: Model, log: Log, catalogue: Catalogue) -> Robot:
    if model.robot in robot_names(catalogue.folder):
        return robot_of(log, model.robot, catalogue)
    robot = robot_from_geometry(model.robot, model.geometry or log.geometry, log.rate_hz)
    return replace(robot, catalogue=catalogue)
