"""`diagnose`: find the effect that the model lacks, from a log of measured drives."""

import argparse
from pathlib import Path

from rich.console import Group
from rich.text import Text

from proxytune.api.diagnosing import DiagnosisReport
from proxytune.cli.terminal.answer import Answer
from proxytune.cli.terminal.steps import Steps
from proxytune.diagnosis.diagnose import declared_effects, diagnose
from proxytune.diagnosis.measured.vehicle import robot_of
from proxytune.effects import Catalogue
from proxytune.errors import InputError
from proxytune.logs import read_log
from proxytune.report.diagnosis.document import tables_and_notes

SHARES = {
    "fitting what is declared": 0.02,
    "looking for what is missing, round 1": 0.05,
    "looking for what is missing, round 2": 0.4,
    "looking for what is missing, round 3": 0.6,
    "looking for what is missing, round 4": 0.68,
    "weighing what each effect is worth": 0.72,
    "fitting to windows of prediction": 0.75,
    "learning what no named effect explains": 0.8,
    "testing on drives kept aside": 0.85,
    "confirming on the bullet plant": 0.88,
    "drawing": 0.96,
}
"""The share of a diagnosis' time that has usually passed when each of its steps begins."""


def configure(parser: argparse.ArgumentParser) -> None:
    """Add the log, what is declared and where the findings go."""
    parser.add_argument("log", type=Path, metavar="LOG", help="a log's folder: log.toml and samples.csv")
    parser.add_argument(
        "--declared",
        metavar="NAMES",
        help="effects tuned in any case, as in trim,delay [the robot's]",
    )
    parser.add_argument(
        "--effects",
        default="",
        metavar="NAMES",
        help="your own effects to try too, as module:Attribute of this folder; plug-ins take part by themselves",
    )
    parser.add_argument("--robot", metavar="NAME", help="the robot, if not the one in log.toml")
    parser.add_argument("--test", type=Path, metavar="LOG", help="another log to test on [part of LOG]")
    parser.add_argument("--seed", type=int, default=1, metavar="N", help="seed of the null distributions [1]")
    parser.add_argument("--output", type=Path, metavar="DIR", help="folder for the findings [diagnosis_LOG]")


def run(arguments: argparse.Namespace) -> Answer:
    """Diagnose, and write diagnosis.json, model.toml and the figures."""
    if arguments.seed < 0:
        raise InputError(f"--seed must be at least 0, got {arguments.seed}")
    log = read_log(arguments.log)
    robot = robot_of(log, arguments.robot, Catalogue(Path.cwd(), _names(arguments.effects)))
    declared = declared_effects(robot) if arguments.declared is None else _names(arguments.declared)
    test = read_log(arguments.test) if arguments.test else None
    with Steps(SHARES) as step:
        diagnosis = diagnose(log, robot, declared, test=test, seed=arguments.seed, report=step)
        folder = arguments.output or Path(f"diagnosis_{arguments.log.resolve().name}")
        step("drawing")
        report = DiagnosisReport(diagnosis)
        files = [str(path) for path in report.write(folder)]
    return Answer(report.document() | {"files": files}, Group(tables_and_notes(diagnosis), Text("\n".join(files))))


def _names(given: str) -> tuple[str, ...]:
    return tuple(name.strip() for name in given.split(",") if name.strip())
