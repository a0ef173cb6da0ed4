"""`measure`: the scores of a study's agents in the domain of a model file, as a target is measured."""

import argparse

from rich.console import Group
from rich.text import Text

from proxytune.api import measure
from proxytune.cli.terminal import Answer
from proxytune.errors import InputError
from proxytune.files import check_place
from proxytune.report import Table, columns_of, plain, table_text


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
