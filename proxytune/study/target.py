"""The target's scores as a study compares them, from one file or several."""

from collections.abc import Iterable, Sequence
from dataclasses import replace

from proxytune.domain import DomainFamily
from proxytune.errors import InputError, ScoresError
from proxytune.scores import ScoreTable, read_scores
from proxytune.settings import nearest
from proxytune.study.settings import StudySettings
from proxytune.usefulness.repeats import start_of, starts_of


def with_scores(settings: StudySettings) -> tuple[StudySettings, tuple[str, ...]]:
    """The study of those agents that the target has scores of, and who is left out on either side, in a line each.

    Raises:
        InputError: If fewer than two are left.
    """
    scored = _read(settings, [metric.name for metric in settings.metrics]).agents
    there = tuple(agent for agent in settings.agents if agent in scored)
    missing = [agent for agent in settings.agents if agent not in scored]
    beyond = [agent for agent in scored if agent not in settings.agents]
    if len(there) < 2:
        files = ", ".join(map(str, settings.targets))
        raise InputError(f"{files}: has no scores of {', '.join(missing)}; {_remedy(missing, beyond)}")
    lines = [f"the target has no scores of {', '.join(missing)}: left out"] if missing else []
    lines += [f"the target has scores of {', '.join(beyond)}, no agents of this study: left out"] if beyond else []
    return replace(settings, agents=there), tuple(lines)


def _remedy(missing: Sequence[str], beyond: Sequence[str]) -> str:
    if not beyond:
        return "add them, or take them out of the study"
    if len(missing) == 1:
        return nearest(missing[0], beyond)
    one = f"{beyond[0]} = '{missing[0]}'"
    return f"its agents are {', '.join(beyond)[:80]}; give yours these names by a table [agents] in study.toml: {one}"


def read_target(settings: StudySettings, family: DomainFamily) -> tuple[ScoreTable, tuple[str, ...]]:
    """The target's scores of the study's agents, from the study's own starts where it has all of these.

    What else it has of them is left out then, which a line says.

    Raises:
        InputError: If the table lacks a metric, or has a value that is not finite.
    """
    compared = [metric.name for metric in settings.metrics]
    table = _read(settings, [*compared, *_others(settings, family, compared)])
    chosen = table.arrange(agents=settings.agents)
    driven = [label for column, label in enumerate(chosen.episodes) if chosen.driven[:, column].any()]
    wanted = {str(start) for start in range(settings.starts)}
    own = [label for label in driven if start_of(label) in wanted]
    if set(starts_of(own)) != wanted:
        return chosen.arrange(agents=settings.agents, episodes=driven), ()
    beyond = [label for label in driven if label not in own]
    line = (
        f"the target's episodes {own[0]} to {own[-1]} are taken for this study's starts, and {len(beyond)} of others "
        "are left out; raise starts to use them, or label episodes otherwise if they are no starts"
    )
    return chosen.arrange(agents=settings.agents, episodes=own), (line,) if beyond else ()


def _others(settings: StudySettings, family: DomainFamily, compared: Sequence[str]) -> list[str]:
    """The metrics beside those compared that the table has in full: what a search can learn from at no cost."""
    return [name for name in family.metrics if name not in compared and _in_full(settings, name)]


def _in_full(settings: StudySettings, metric: str) -> bool:
    try:
        _read(settings, [metric])
    except ScoresError:
        return False
    return True


def _read(settings: StudySettings, metrics: Iterable[str]) -> ScoreTable:
    return read_scores(settings.targets, metrics, columns=settings.target_columns)
