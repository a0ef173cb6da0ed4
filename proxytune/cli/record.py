"""`record`: the log of a simulated domain that is driven through manoeuvres."""

import argparse
from pathlib import Path

from rich.console import Console
from rich.text import Text

from proxytune.cli.terminal.answer import Answer
from proxytune.diagnosis.recording import log_text, record, samples_text
from proxytune.driving.lane_following import LaneFollowing
from proxytune.errors import InputError
from proxytune.report.writing import write_text
from proxytune.study.family import load_family
from proxytune.study.settings import read_study_settings


def configure(parser: argparse.ArgumentParser) -> None:
    """Add the study, the model and the log to write."""
    parser.add_argument("path", type=Path, metavar="PATH", help="a study's folder, for its [domain]")
    parser.add_argument("--model", type=Path, required=True, metavar="MODEL", help="the model.toml of the domain")
    parser.add_argument("--output", type=Path, required=True, metavar="DIR", help="the log's folder to write")
    parser.add_argument("--repeats", type=int, default=2, metavar="N", help="drives of each manoeuvre [2]")
    parser.add_argument("--seconds", type=float, default=60.0, metavar="S", help="length of a drive [60 s]")
    parser.add_argument("--seed", type=int, default=1, metavar="N", help="seed of manoeuvres, starts and noise [1]")


def run(arguments: argparse.Namespace) -> Answer:
    """Drive every manoeuvre and write the log."""
    if arguments.repeats < 1 or arguments.seed < 0 or not 5.0 <= arguments.seconds <= 600.0:
        raise InputError("--repeats must be at least 1, --seed at least 0 and --seconds between 5 and 600")
    settings = read_study_settings(arguments.path)
    if not arguments.model.is_file():
        raise InputError(f"--model {arguments.model}: no such file; check the path")
    family = load_family(settings, arguments.model)
    if not isinstance(family, LaneFollowing):
        raise InputError(f"{settings.folder}: only the lane-following family can be recorded; give another study")
    sizes = {"repeats": arguments.repeats, "seconds": arguments.seconds, "seed": arguments.seed}
    with Console(stderr=True).status("driving"):
        log = record(family, name=arguments.output.name, **sizes)
    source = f"{arguments.model.name} on the {family.plant} plant, driven by proxytune"
    write_text(arguments.output / "samples.csv", samples_text(log))
    write_text(arguments.output / "log.toml", log_text(log, source))
    rows = sum(len(episode.times) for episode in log.episodes)
    document = {"log": str(arguments.output), "episodes": len(log.episodes), "rows": rows, "seed": arguments.seed}
    return Answer(document, Text(f"{len(log.episodes)} drives, {rows} rows\n{arguments.output}"))
