"""Agents that no tuning sees: how well each tuned proxy orders them."""

from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import NamedTuple

from proxytune.domain import DomainFamily, Episode, Outcome
from proxytune.driving.agents import AGENTS
from proxytune.driving.lane_following import LaneFollowing
from proxytune.errors import InputError, RunError
from proxytune.extensions import ask
from proxytune.running.progress import Watcher
from proxytune.scores import ScoreTable, read_scores
from proxytune.seeds import fresh_seed
from proxytune.settings import read_settings
from proxytune.space import Theta
from proxytune.storage.lock import locked
from proxytune.storage.store import Store
from proxytune.study.evaluation import failure_of, plan, table
from proxytune.study.family import bare_family
from proxytune.study.settings import StudySettings
from proxytune.study.study import Study
from proxytune.study.study_run import StudyRun
from proxytune.study.target import read_target
from proxytune.usefulness import Assessment, assess, floor_of_repeats

KEY = "held_out"
FEWEST = 3
"""Of fewer agents PRPV says nothing."""


class HeldOut(NamedTuple):
    """What held-out agents say of a proxy.

    Attributes:
        assessment: How useful it is for them.
        episodes: How many episodes were driven now.
    """

    assessment: Assessment
    episodes: int


def held_out_of(settings: StudySettings, family: DomainFamily, *, driven: bool) -> tuple[str, ...]:
    """The agents that study.toml holds out, else shipped ones that it does not use; empty where they are too few.

    Args:
        settings: Of the study.
        family: Its family.
        driven: Whether the target is driven; otherwise only agents that its table has can be held out.

    Raises:
        InputError: If one that study.toml names is tuned on, or has no rank: the target's table has no scores of it.
    """
    named = read_settings(settings.path).texts(KEY, ())
    scored = scored_agents(settings)
    used = {*settings.agents, *settings.loaded_agents}
    for name in named:
        if name in used:
            raise settings.error(KEY, f"'{name}' is among the agents that are tuned on; take it out of one of them")
        if name not in scored and not driven:
            raise settings.error(KEY, f"the target's table has no scores of '{name}'; measure them, or take it out")
    if named and len(named) < FEWEST:
        raise settings.error(KEY, f"names {len(named)} of at least {FEWEST} agents; add some, or take the key out")
    candidates = _shipped(settings) if driven else scored
    others = [name for name in candidates if name not in used and _is_known(family, name)]
    found = named or tuple(others)
    return found if len(found) >= FEWEST else ()


def check_held_out(settings: StudySettings, family: DomainFamily, names: tuple[str, ...]) -> None:
    """Refuse agents that the family cannot run.

    Raises:
        InputError: With the agent's name.
    """
    for name in names:
        try:
            ask(f"check_agent('{name}') of {settings.family}", partial(family.check_agent, name))
        except InputError as problem:
            raise settings.error(KEY, str(problem)) from None


def scored_agents(settings: StudySettings) -> tuple[str, ...]:
    """The agents that the target's table has."""
    if not all(path.is_file() for path in settings.targets):
        return ()
    metrics = [metric.name for metric in settings.metrics]
    return read_scores(settings.targets, metrics, columns=settings.target_columns).agents


def _shipped(settings: StudySettings) -> tuple[str, ...]:
    """The agents that come with the family; one that names its agents otherwise is asked without its guard."""
    return tuple(AGENTS) if isinstance(bare_family(settings, settings.proxy), LaneFollowing) else ()


def _is_known(family: DomainFamily, name: str) -> bool:
    try:
        family.check_agent(name)
    except InputError:
        return False
    return True


def held_out_settings(settings: StudySettings, names: tuple[str, ...], target: Path | None = None) -> StudySettings:
    """The same study with these agents, and the target's scores of them from another file if one is given."""
    known = replace(settings, agents=names)
    return known if target is None else replace(known, target=target, more_targets=(), target_columns={})


def drive_held_out(study: Study, settings: StudySettings, theta: Theta, watcher: Watcher) -> HeldOut:
    """Drive held-out agents in the instance of a study's family, twice from each start, and assess it.

    Episodes are kept in the study's own database, and those that are there are not driven again. The second time is
    for the noise floor: what the instance scores against itself.

    Args:
        study: The proxy's study.
        settings: Its settings with held-out agents, and the target's scores of them.
        theta: The instance.
        watcher: Hears of every episode.

    Raises:
        RunError: If an agent has no episode that works.
    """
    held = replace(study, settings=settings, target=read_target(settings, study.family)[0])
    seeds = [fresh_seed(settings.seed, repetition) for repetition in (1, 2)]
    with locked(study.settings.folder), Store.open(study.settings.folder) as store:
        run = StudyRun(held, store, watcher)
        once, again = (_scores(run, plan(settings, theta, seed)) for seed in seeds)
    floor = floor_of_repeats(domain=once, again=again, metrics=settings.metrics)
    return HeldOut(assess(proxy=once, target=held.target, metrics=settings.metrics, floor=floor), run.spent.episodes)


def _scores(run: StudyRun, planned: list[Episode]) -> ScoreTable:
    outcomes = list(run.outcomes(planned, "held-out agents").values())
    _check_worked(outcomes)
    return table(outcomes)


def _check_worked(outcomes: list[Outcome]) -> None:
    worked = {outcome.episode.agent for outcome in outcomes if outcome.metrics is not None}
    for outcome in outcomes:
        if outcome.episode.agent not in worked:
            raise RunError(f"held out: {failure_of(outcome)}; name other agents under {KEY} in study.toml")
