"""`predict`: the poses of a log, or the pictures of its camera, predicted by a fitted model."""

import argparse
from pathlib import Path

from rich.text import Text

from proxytune.api import PicturePrediction, predict
from proxytune.cli.options import configure_effects, configure_source, facts_of, wanted_of
from proxytune.cli.terminal import Answer, waiting
from proxytune.files import check_place
from proxytune.report import write_text


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
    configure_effects(parser)
    configure_source(parser)


def run(arguments: argparse.Namespace) -> Answer:
    """Predict poses or pictures, write them, and compare them with those measured."""
    folder = arguments.output if arguments.frames else None
    check_place(arguments.output, folder=arguments.frames)
    wanted, facts = wanted_of(arguments), facts_of(arguments)
    with waiting("predicting") as tell:
        found = predict(
            arguments.model,
            arguments.log,
            horizon_s=arguments.horizon,
            frames=folder,
            wanted=wanted,
            facts=facts,
            tell=tell,
        )
    if isinstance(found, PicturePrediction):
        return Answer(found.document(), Text(f"{found.sentence}\n{arguments.output}"))
    write_text(arguments.output, found.poses.to_csv(index=False))
    count = found.error.windows or len(found.poses.groupby(["episode", "start_time"]))
    windows = f"{count} windows of {arguments.horizon:g} s"
    document = {"predictions": str(arguments.output), **found.document()}
    cautions = [f"beware: {line}" for line in found.cautions]
    lines = [*cautions, *found.notes, f"{windows}: {found.sentence}", str(arguments.output)]
    return Answer(document, Text("\n".join(lines)))
