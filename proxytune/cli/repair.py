"""`repair`: keep what is whole of a study.db, and say what the next `study` does again."""

import argparse
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from proxytune.cli.terminal.answer import Answer
from proxytune.errors import InputError
from proxytune.storage import Salvage, Store, locked, salvage
from proxytune.study import (
    LEARNING,
    PRPV,
    StudyRun,
    StudySettings,
    as_stored,
    open_to_look,
    read_study_settings,
    unfounded,
)

AGAIN = "a sweep that is lost is there again after the same sweep command, which drives only episodes that are lost"
COUNTED = {"trials": "trial", "episodes": "episode", "sweeps": "sweep"}


@dataclass(frozen=True)
class Scores:
    """Whether the trials kept are what their episodes come to.

    Attributes:
        problems: Of each trial that is not, its number and why.
        unchecked: Why that could not be seen; empty if it could.
    """

    problems: Sequence[tuple[int, str]] = ()
    unchecked: str = ""


def configure(parser: argparse.ArgumentParser) -> None:
    """Add the study."""
    parser.add_argument("path", type=Path, metavar="PATH", help="a study's folder")


def run(arguments: argparse.Namespace) -> Answer:
    """Put what is whole in the place of study.db; what is not is set aside, and nothing of it is deleted."""
    settings = read_study_settings(arguments.path)
    settings.check_single()
    search = PRPV.name if settings.objective == LEARNING else settings.objective
    with locked(settings.home):
        found = salvage(settings.home)
        with Store.read(settings.home) as store:
            had = len(store.trials(search))
            scores = _compared(settings, store) if had else Scores()
        kept = min([had, *(number - 1 for number, _ in scores.problems)])
        if kept < had:
            with Store.open(settings.home) as store:
                store.drop_trials(search, kept + 1)
    return _answer(settings.home, found, scores, kept)


def _compared(settings: StudySettings, store: Store) -> Scores:
    """Whether the trials are what their episodes come to."""
    try:
        study = open_to_look(settings, store)
        return Scores(list(unfounded(StudyRun(as_stored(study, store), store))))
    except InputError as problem:
        return Scores(unchecked=str(problem))


def _answer(folder: Path, found: Salvage | None, scores: Scores, kept: int) -> Answer:
    damaged = found is not None or bool(scores.problems)
    problems = [f"trial {number} {problem}" for number, problem in scores.problems]
    document = {
        "damaged": damaged,
        "aside": str(found.aside) if found else None,
        "kept": dict(found.kept) if found else None,
        "lost": dict(found.lost) if found else None,
        "trials": kept,
        "problems": problems,
        "unchecked": scores.unchecked,
    }
    again = (
        f"next: python -m proxytune study {folder}\n"
        f"it proposes the trials from {kept + 1} on again, the same ones by the same version of proxytune, "
        "and drives again only the episodes that are lost"
    )
    lines = [*_say(found), *problems, *([again] if damaged else ["study.db is whole; nothing was changed"])]
    if scores.unchecked:
        lines.append(f"scores were not compared with their episodes: {scores.unchecked}")
    return Answer(document, "\n".join(lines))


def _say(found: Salvage | None) -> list[str]:
    if found is None:
        return []
    lost = {table: count for table, count in found.lost.items() if count}
    return [
        f"kept: {_count(found.kept)}",
        f"lost: {_count(lost) or 'nothing that could be read'}",
        *([AGAIN] if "sweeps" in lost else []),
        f"the damaged file is now {found.aside}",
    ]


def _count(rows: Mapping[str, int]) -> str:
    named = {table: count for table, count in rows.items() if table in COUNTED}
    return ", ".join(f"{count} {COUNTED[table]}{'' if count == 1 else 's'}" for table, count in named.items())
