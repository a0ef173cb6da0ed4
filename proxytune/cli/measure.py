"""`measure`: the scores of a study's agents in the domain of a model file, as a target is measured."""

import argparse
from pathlib import Path

from rich.console import Group
from rich.table import Table
from rich.text import Text

from proxytune.cli.terminal.answer import Answer
from proxytune.errors import InputError
from proxytune.running import Bars
from proxytune.scores import ScoreTable, write_scores
from proxytune.seeds import TARGET_OFFSET, target_seed
from proxytune.study import measure_agents, read_study_settings

MOST_REPEATS = 1_000_000


def configure(parser: argparse.ArgumentParser) -> None:
    """Add the study, the model and the table to write."""
    parser.add_argument("path", type=Path, metavar="PATH", help="a study's folder, for its agents, starts and [domain]")
    parser.add_argument("--model", type=Path, required=True, metavar="MODEL", help="the model.toml of the domain")
    parser.add_argument("--output", type=Path, required=True, metavar="CSV", help="the score table to write")
    parser.add_argument(
        "--repeats",
        type=int,
        default=1,
        metavar="N",
        help="episodes from every start, each with its own placement noise; labelled START/REPEAT where N > 1 [1]",
    )
    parser.add_argument(
        "--seed", type=int, metavar="N", help=f"seed of the episodes [the study's seed plus {TARGET_OFFSET}]"
    )


def run(arguments: argparse.Namespace) -> Answer:
    """Score every agent from every start, and write the table."""
    settings = read_study_settings(arguments.path)
    seed = target_seed(settings.seed) if arguments.seed is None else arguments.seed
    if seed < 0:
        raise InputError(f"--seed must be at least 0, got {seed}")
    if not 1 <= arguments.repeats <= MOST_REPEATS:
        raise InputError(f"--repeats must be between 1 and {MOST_REPEATS}, got {arguments.repeats}")
    if not arguments.model.is_file():
        raise InputError(f"--model {arguments.model}: no such file; check the path")
    if not arguments.output.absolute().parent.is_dir():
        raise InputError(f"{arguments.output}: its folder does not exist; create it first")
    if arguments.output.is_dir():
        raise InputError(f"--output {arguments.output}: is a folder; give the name of a file in it")
    with Bars(len(settings.agents) * settings.starts * arguments.repeats) as bars:
        scores = measure_agents(settings, arguments.model, seed, bars, arguments.repeats)
    write_scores(scores, arguments.output)
    document = {
        "scores": str(arguments.output),
        "model": str(arguments.model),
        "seed": seed,
        "agents": list(scores.agents),
        "episodes": len(scores.episodes),
        "repeats": arguments.repeats,
        "means": {agent: _means(scores, row) for row, agent in enumerate(scores.agents)},
    }
    return Answer(document, Group(_table(scores), Text(f"seed {seed}\n{arguments.output}")))


def _means(scores: ScoreTable, row: int) -> dict[str, float]:
    return {name: float(value) for name, value in zip(scores.metrics, scores.means[row], strict=True)}


def _table(scores: ScoreTable) -> Table:
    table = Table(box=None, pad_edge=False)
    for name in ("agent", *scores.metrics):
        table.add_column(name.replace("_", " "), justify="left" if name == "agent" else "right", overflow="fold")
    for row, agent in enumerate(scores.agents):
        table.add_row(agent, *(f"{value:.3f}" for value in scores.means[row]))
    return table
