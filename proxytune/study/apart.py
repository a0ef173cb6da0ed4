"""Agents that cannot be run beside others: found by running two episodes of each side by side, and one after the other.

An agent's memory is what it gives back with its command. One that keeps anything elsewhere (in its class, in a global,
in the generators of `random` or `numpy.random`) mixes up the episodes that it drives at once. It is run by itself then,
which is kept in study.db (`APART`). The agents that proxytune brings are known not to.
"""

import functools
from collections.abc import Collection, Sequence

from proxytune.domain import DomainFamily, Episode, make_episode
from proxytune.extensions import plugins
from proxytune.running import RAISED, Fleet, Watch, can_run_together, run_episode, run_together, working
from proxytune.seeds import preflight_seed
from proxytune.storage import Store
from proxytune.study.settings import StudySettings

APART = "apart"
"""The fact in study.db: the agents that were tried, why some are run by themselves, and the user's code."""
DIFFERS, ENDS = "differs", "ends"
WHY = {
    DIFFERS: "does otherwise beside others than by itself, so it is driven alone, which takes longer; keep what it "
    "remembers in its memory, not in its class or in globals, and draw from a generator of its own",
    ENDS: "ends what is driven beside it, so it is driven alone, which takes longer; let it raise an Exception instead",
}


def users_agents(settings: StudySettings) -> list[str]:
    """The agents that proxytune does not bring: a user's own, plug-ins, and all of another domain family."""
    installed, ours = plugins("agent"), settings.family.startswith("proxytune.")
    names = zip(settings.agents, settings.loaded_agents, strict=True)
    return [
        agent
        for agent, name in names
        if not ours or name in installed or (":" in name and not name.startswith("proxytune."))
    ]


def find_apart(
    settings: StudySettings, family: DomainFamily, agents: Sequence[str], needed: Collection[str], watch: Watch
) -> dict[str, str]:
    """Run two episodes of each agent side by side and one after the other: why some run by themselves, by agent."""
    if not agents or not can_run_together(family):
        return {}
    pairs: list[Fleet] = [(_episode(settings, agent, 0), _episode(settings, agent, 1)) for agent in agents]
    rescue = watch.rescue(4.0, lambda pair, end: (pair[0].agent, ENDS))
    with working(functools.partial(_why_apart, family, tuple(needed)), pairs, settings.jobs, rescue) as tried:
        why = dict(tried)
    return {agent: why[agent] for agent in agents if why[agent]}


def centre_of(settings: StudySettings) -> dict[str, float]:
    """The domain instance in the centre of the box."""
    return {box.name: 0.5 * (box.low + box.high) for box in settings.space.intervals}


def _episode(settings: StudySettings, agent: str, turn: int) -> Episode:
    start = turn % settings.starts
    seed = preflight_seed(settings.seed, start, turn)
    return make_episode(centre_of(settings), agent=agent, start=start, seed=seed)


def _why_apart(family: DomainFamily, needed: Collection[str], pair: Fleet) -> tuple[str, str]:
    together = run_together(family, pair, needed)
    single = [run_episode(family, episode, needed) for episode in pair]
    if any(one.failure.startswith(RAISED) for one in single):
        return pair[0].agent, ENDS
    if together is None:
        # Of a domain that fails nothing is learnt of the agent.
        return pair[0].agent, "" if any(one.failure for one in single) else DIFFERS
    same = [(one.metrics, one.failure) for one in together] == [(one.metrics, one.failure) for one in single]
    return pair[0].agent, "" if same else DIFFERS


def kept_apart(
    store: Store, settings: StudySettings, family: DomainFamily, code: str, needed: Collection[str], watch: Watch
) -> frozenset[str]:
    """The study's agents that are run by themselves; those not tried yet, or in other code, are tried now and kept."""
    known = store.facts().get(APART, {})
    known = known if known.get("code") == code else {"code": code, "tried": [], "why": {}}
    missing = [agent for agent in users_agents(settings) if agent not in known["tried"]]
    if missing and can_run_together(family):
        why = {**known["why"], **find_apart(settings, family, missing, needed, watch)}
        known = {"code": code, "tried": [*known["tried"], *missing], "why": why}
        store.save_fact(APART, known)
    return frozenset(known["why"])


def apart_notes(store: Store) -> list[str]:
    """One line for each agent that is run by itself."""
    why = store.facts().get(APART, {}).get("why", {})
    return [f"agent '{agent}' {WHY[reason]}" for agent, reason in why.items()]
