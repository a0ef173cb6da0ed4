"""`diagnose`: find the effect that the model lacks, from a log of measured drives and frames."""

import argparse
from contextlib import nullcontext
from pathlib import Path

from rich.console import Group
from rich.text import Text

from proxytune.api import DiagnosisReport
from proxytune.cli.commands import names_in
from proxytune.cli.options import facts_of, typed, wanted_of
from proxytune.cli.terminal import Answer, steps
from proxytune.diagnosis import Limits, diagnose_log, forget_stages, robot_of
from proxytune.effects import Catalogue
from proxytune.errors import InputError
from proxytune.files import check_place, package_table
from proxytune.importing import finite, open_log
from proxytune.logs import Log
from proxytune.report import diagnosis_text
from proxytune.settings import check_whole

STEPS: dict[str, dict[str, float]] = package_table("cli/steps.toml")
MOTION_SHARE = 0.8
"""Of the time of both; the camera comes last."""


def limits_of(arguments: argparse.Namespace) -> Limits:
    """Limits of the next drive."""
    room = None
    if arguments.room is not None:
        sides = [finite(side) for side in arguments.room.split("x")]
        if len(sides) != 2 or any(side is None or not 0.3 <= side <= 1000.0 for side in sides):
            raise InputError(f"--room {arguments.room}: give length x width from 0.3 to 1000 m, as in 4x3")
        room = (float(sides[0] or 0.0), float(sides[1] or 0.0))
    if not 0.05 <= arguments.fastest <= 1.0:
        raise InputError(f"--fastest must be between 0.05 and 1, a share of full speed, got {arguments.fastest:g}")
    if not 5.0 <= arguments.drive_seconds <= 120.0:
        raise InputError(f"--drive-seconds must be between 5 and 120, got {arguments.drive_seconds:g}")
    return Limits(room, arguments.fastest, arguments.drive_seconds)


def run(arguments: argparse.Namespace) -> Answer:
    """Diagnose, and write diagnosis.json, model.toml and the figures."""
    check_whole("--seed", arguments.seed)
    limits = limits_of(arguments)
    wanted, facts, nothing = wanted_of(arguments), facts_of(arguments), nullcontext((None, ()))
    other = open_log(arguments.test, wanted, facts) if arguments.test else nothing
    with open_log(arguments.log, wanted, facts) as (log, imported), other as (test, _):
        here = arguments.log.resolve()
        folder = arguments.output or Path(f"diagnosis_{here.stem if here.is_file() else here.name}")
        check_place(folder, folder=True)
        for name in ("diagnosis.json", "model.toml", "report.html"):
            check_place(folder / name, ours=True)
        robot = robot_of(log, arguments.robot, Catalogue(Path.cwd(), names_in(arguments.effects)))
        declared = None if arguments.declared is None else names_in(arguments.declared)
        with steps(shares(log)) as step:
            seed = arguments.seed
            found = diagnose_log(log, robot, declared, test=test, seed=seed, report=step, limits=limits, folder=folder)
            step("drawing")
            report = DiagnosisReport(found)
            files = [str(path) for path in report.write(folder, typed(arguments))]
            forget_stages(folder)
    lines = [*(f"{arguments.log.name}: {note}" for note in imported), *files]
    document = report.document() | {"files": files} | ({"imported": list(imported)} if imported else {})
    return Answer(document, Group(diagnosis_text(found), Text("\n".join(lines))))


def shares(log: Log) -> dict[str, float]:
    """The share of the whole time that has usually passed when each step begins."""
    if log.frames is None:
        return STEPS["motion"]
    if log.command == "none":
        return STEPS["camera"]
    motion = {step: MOTION_SHARE * share for step, share in STEPS["motion"].items()}
    return motion | {step: MOTION_SHARE + (1.0 - MOTION_SHARE) * share for step, share in STEPS["camera"].items()}
