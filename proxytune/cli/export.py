"""`export`: what was found, written to a URDF, a MuJoCo model or ROS parameters, or a study's trials for others."""

import argparse
from pathlib import Path

from rich.text import Text

from proxytune.api import TRIALS, export
from proxytune.cli.options import configure_effects
from proxytune.cli.terminal import Answer
from proxytune.report import FORMATS


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
    configure_effects(parser)


def run(arguments: argparse.Namespace) -> Answer:
    """Write the file, and say what went where and what has no place."""
    report = export(arguments.model, arguments.output, to=arguments.to)
    cautions = (f"beware: {line}" for line in report.facts.get("cautions", ()))
    lines = [*cautions, *map(str, report.lines), str(arguments.output)]
    if arguments.to in TRIALS:
        lines.insert(0, f"{report.facts['trials']} trials of '{report.facts['name']}'")
    if arguments.to == "optuna":
        lines.append(f"look: optuna-dashboard sqlite:///{arguments.output}")
    return Answer(report.document(), Text("\n".join(lines)))
