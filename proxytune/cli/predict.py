"""`predict`: the poses of a log, or the pictures of its camera, predicted by a fitted model."""

import argparse

from rich.text import Text

from proxytune.api import PicturePrediction, predict
from proxytune.cli.options import facts_of, wanted_of
from proxytune.cli.terminal import Answer, waiting
from proxytune.files import check_place
from proxytune.report import write_text


def run(arguments: argparse.Namespace) -> Answer:
    """Predict poses or pictures, write them, and compare them with those measured."""
    folder = arguments.output if arguments.frames else None
    check_place(arguments.output, folder=arguments.frames)
    chosen = {"horizon_s": arguments.horizon, "wanted": wanted_of(arguments), "facts": facts_of(arguments)}
    with waiting("predicting") as tell:
        found = predict(arguments.model, arguments.log, frames=folder, tell=tell, **chosen)
    if isinstance(found, PicturePrediction):
        return Answer(found.document(), Text(f"{found.sentence}\n{arguments.output}"))
    write_text(arguments.output, found.poses.to_csv(index=False))
    count = found.error.windows or len(found.poses.groupby(["episode", "start_time"]))
    windows = f"{count} windows of {arguments.horizon:g} s"
    document = {"predictions": str(arguments.output), **found.document()}
    cautions = [f"beware: {line}" for line in found.cautions]
    lines = [*cautions, *found.notes, f"{windows}: {found.sentence}", str(arguments.output)]
    return Answer(document, Text("\n".join(lines)))
