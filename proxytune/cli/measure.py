"""`measure`: the scores of a study's agents in the domain of a model file, as a target is measured."""

import argparse
from pathlib import Path

from rich.console import Group
from rich.text import Text

from proxytune.api import measure
from proxytune.cli.terminal import Answer
from proxytune.errors import InputError
from proxytune.files import check_place
from proxytune.report import Table, columns_of, plain, table_text
from proxytune.seeds import TARGET_OFFSET


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
    if not arguments.output.absolute().parent.is_dir():
        raise InputError(f"{arguments.output}: its folder does not exist; create it first")
    check_place(arguments.output)
    options = {"repeats": arguments.repeats, "seed": arguments.seed}
    found = measure(arguments.path, arguments.model, progress=True, **options)
    found.write(arguments.output)
    document = {"scores": str(arguments.output), **found.document()}
    lines = [*(f"beware: {line}" for line in found.cautions), f"seed {found.seed}", str(arguments.output)]
    means = zip(found.scores.agents, found.scores.means, strict=True)
    rows = tuple((str(agent), *(f"{value:.3f}" for value in own)) for agent, own in means)
    table = Table("", columns_of(("agent",), [plain(name) for name in found.scores.metrics]), rows)
    return Answer(document, Group(table_text(table), Text("\n".join(lines))))
