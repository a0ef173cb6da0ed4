"""What a bank says before anything is measured: sentence, table, page and JSON document."""

from collections.abc import Mapping
from itertools import pairwise
from pathlib import Path
from typing import Any

from rich.console import Group

from proxytune.report.html import write_page
from proxytune.report.study.document import information_document
from proxytune.report.study.page import study_foot
from proxytune.report.text import file_texts, group_texts, table_text
from proxytune.report.view import Column, Table, View, columns_of
from proxytune.report.wording import listed, percent, plain, short, with_unit
from proxytune.report.writing import ABOUT
from proxytune.study import WITHIN, Bank, settings_document

MOST_NAMED = 3
ROUGHLY = 1.05
"""Where a start more widens an interval by more than this factor, widths are not known better."""


def bank_sentence(bank: Bank) -> str:
    """Say which parameters these agents would tell, and how well."""
    widths = bank.widths(bank.settings.starts)
    told = [f"{plain(name)} to ± {short(width / 2.0)} {bank.units[name]}".rstrip() for name, width in widths.items()]
    best = [name for name, _ in bank.agents[:MOST_NAMED]]
    from_starts = f"{len(bank.settings.agents)} agents measured from {bank.settings.starts} starts"
    if not best and bank.failed:
        worst = max(bank.failed, key=bank.failed.__getitem__)
        failed = f"{worst} failed from every start in {bank.failed[worst]} of {bank.trials} trials"
        return f"{failed}, too many to say what {from_starts} would tell; mend it, or leave it out of agents."
    if not best:
        return f"{bank.trials} trials are too few to say what {from_starts} would tell; raise budget."
    by_starts = [bank.widths(count) for count in bank.expected]
    rough = [plain(name) for name in widths if any(b[name] > ROUGHLY * a[name] for a, b in pairwise(by_starts))]
    doubt = (
        f" More starts seem to tell less of {listed(rough)}: widths are known roughly; raise budget." if rough else ""
    )
    return f"{bank.trials} trials: {from_starts} tell {listed(told)}; {listed(best)} tell most.{doubt}"


def bank_document(bank: Bank) -> dict[str, Any]:
    """A bank as plain JSON; its keys are promises."""
    starts = bank.settings.starts
    return {
        "name": bank.settings.name,
        "sentence": bank_sentence(bank),
        "bank": {
            "trials": bank.trials,
            "expected_interval": bank.widths(starts),
            "agents": [name for name, _ in bank.agents],
            "starts": starts,
            "expected_interval_by_starts": {str(count): bank.widths(count) for count in bank.expected},
            "starts_needed": dict(bank.needed),
            "within": {box.name: WITHIN * (box.high - box.low) for box in bank.settings.space.intervals},
            "information": information_document(bank.expected[starts].information),
        },
        "settings": dict(settings_document(bank.settings)),
    }


def bank_table(bank: Bank) -> Table:
    """Each parameter with its expected width by the number of starts, the starts needed, and who tells it."""
    told = {one.name: one for one in bank.expected[bank.settings.starts].information}
    rows = []
    for box in bank.settings.space.intervals:
        needed, one = bank.needed[box.name], told.get(box.name)
        agents = ", ".join(f"{name} {percent(share)}" for name, share in one.agents[:MOST_NAMED]) if one else ""
        metrics = ", ".join(f"{name} {percent(share)}" for name, share in one.metrics[:2]) if one else ""
        reach = [f"± {short(bank.widths(count)[box.name] / 2.0)}" for count in bank.expected]
        within = f"{needed or 'not by starts'} (± {short(WITHIN * (box.high - box.low))})"
        rows.append((with_unit(box.name, bank.units[box.name]), *reach, within, agents, metrics))
    heads = [f"by {count} start{'s' if count > 1 else ''}" for count in bank.expected]
    who = map(Column, ("agents that tell", "metrics that tell"))
    columns = (*columns_of(("parameter",), (*heads, "starts needed")), *who)
    return Table("What a target would tell", columns, tuple(rows), (ABOUT["bank"],))


def bank_text(bank: Bank, files: Mapping[str, Any]) -> Group:
    """A bank as `study` prints it."""
    return group_texts(f"{bank_sentence(bank)}\n", table_text(bank_table(bank)), *file_texts(files))


def write_bank_page(bank: Bank, table: Path) -> Path:
    """Write the page beside the table of trials; its path."""
    page = table.with_name("report.html")
    learn = f'Measure these agents on the target and write `learn_from = ["{table.parent.name}"]` into its study.toml.'
    title = f"{bank.settings.name}: what can a target learn from this bank?"
    write_page(page, View(title, bank_sentence(bank), learn, (bank_table(bank),)), study_foot(bank.settings))
    return page
