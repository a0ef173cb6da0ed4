"""`record`: the log of a simulated domain that is driven through manoeuvres, and along its lanes for pictures."""

import argparse

from rich.text import Text

from proxytune.api import Wanted, record_log
from proxytune.cli.terminal import Answer, waiting
from proxytune.errors import InputError
from proxytune.files import check_place
from proxytune.study import read_study_settings

MOST_FRAMES = 1_000_000
"""As many as six digits number."""
MOST_REPEATS = 10_000
"""Weeks of driving at the least."""


def run(arguments: argparse.Namespace) -> Answer:
    """Drive every manoeuvre, and lanes where pictures are wanted, and write the log."""
    if not 1 <= arguments.repeats <= MOST_REPEATS or arguments.seed < 0 or not 5.0 <= arguments.seconds <= 600.0:
        limits = f"--repeats must be between 1 and {MOST_REPEATS}, --seed at least 0 and --seconds between 5 and 600"
        raise InputError(limits)
    if not 0 <= arguments.frames <= MOST_FRAMES:
        raise InputError(f"--frames must be between 0 and {MOST_FRAMES}, got {arguments.frames}")
    settings = read_study_settings(arguments.path)
    if not arguments.model.is_file():
        raise InputError(f"--model {arguments.model}: no such file; check the path")
    check_place(arguments.output, folder=True)
    wanted = Wanted(arguments.repeats, arguments.seconds, arguments.frames, arguments.seed, arguments.commands)
    with waiting("driving") as tell:
        log, cautions = record_log(settings, arguments.model, arguments.output, wanted, tell)
    rows, frames = sum(len(episode.times) for episode in log.episodes), arguments.frames
    document = {"log": str(arguments.output), "episodes": len(log.episodes), "rows": rows, "frames": frames}
    pictures = f", {frames} frames" if frames else ""
    text = f"{len(log.episodes)} drives, {rows} rows{pictures}\n{arguments.output}"
    lines = [*(f"beware: {line}" for line in cautions), text]
    return Answer({**document, "seed": arguments.seed, "cautions": list(cautions)}, Text("\n".join(lines)))
