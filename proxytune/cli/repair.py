"""`repair`: keep what is whole of a study.db, and say what the next `study` does again."""

import argparse
from collections.abc import Mapping

from proxytune.cli.terminal import Answer
from proxytune.storage import Store, locked, salvage
from proxytune.study import LEARNING, PRPV, read_study_settings

AGAIN = "a sweep that is lost is there again after the same sweep command, which drives only episodes that are lost"
COUNTED = {"trials": "trial", "episodes": "episode", "sweeps": "sweep"}


def run(arguments: argparse.Namespace) -> Answer:
    """Put what is whole in the place of study.db; what is not is set aside, and nothing of it is deleted."""
    settings = read_study_settings(arguments.path)
    settings.check_single()
    search = PRPV.name if settings.objective == LEARNING else settings.objective
    with locked(settings.home):
        found = salvage(settings.home)
        with Store.read(settings.home) as store:
            trials = len(store.trials(search))
    document = {
        "damaged": found is not None,
        "aside": str(found.aside) if found else None,
        "kept": dict(found.kept) if found else None,
        "lost": dict(found.lost) if found else None,
        "trials": trials,
        "problems": [found.problem] if found else [],
        "unchecked": "",  # until format 7, why scores had not been compared with their episodes
    }
    if found is None:
        return Answer(document, "study.db is whole; nothing was changed")
    lost = {table: count for table, count in found.lost.items() if count}
    proposes = f"proposes the trials from {trials + 1} on again, the same ones by the same version of proxytune, and "
    lines = [
        f"kept: {_count(found.kept)}",
        f"lost: {_count(lost) or 'nothing that could be read'}",
        *([AGAIN] if "sweeps" in lost else []),
        f"the damaged file is now {found.aside}",
        f"next: python -m proxytune study {settings.home}",
        f"it {proposes if 'trials' in lost else ''}drives again only the episodes that are lost",
    ]
    return Answer(document, "\n".join(lines))


def _count(rows: Mapping[str, int]) -> str:
    named = {table: count for table, count in rows.items() if table in COUNTED}
    return ", ".join(f"{count} {COUNTED[table]}{'' if count == 1 else 's'}" for table, count in named.items())
