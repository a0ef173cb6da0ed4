"""What every domain family promises."""

import functools
import math
import pickle
from collections.abc import Collection, Mapping, Sequence
from typing import Any

from proxytune.domain import DomainFamily, Episode, make_episode
from proxytune.errors import InputError
from proxytune.running.workers import working
from proxytune.space import Parameter, Theta
from proxytune.testing.claim import ask, claim, claim_members

MEMBERS = ("identity", "metrics", "parameters", "starts", "check_agent", "run")
NOBODY = "nobody drives like this"
STARTS = 3
"""A parameter has to change something from one of the first so many starts."""

Scores = Mapping[str, float]


def check_family(family: DomainFamily, *, agents: Sequence[str], without_effect: Collection[str] = ()) -> None:
    """Refuse a domain family that breaks a promise.

    It can be pickled; the same episode has the same result, after other episodes and in another process too; each
    parameter changes a metric of some agent, or is named as one that does not; metrics are those that it declares, all
    finite; its identity stays the same; and an agent that it does not know is refused.

    Args:
        family: The family.
        agents: Names of agents that drive in it.
        without_effect: Parameters that change no metric of these agents, as one that only shapes another.

    Raises:
        ConformanceError: With the promise that is broken.
    """
    what = f"family {type(family).__name__}"
    claim_members(family, what, MEMBERS)
    _claim_declared(family, what)
    for agent in agents:
        ask(f"check_agent('{agent}') of {what}", functools.partial(family.check_agent, agent))
    _claim_unknown(family, what)
    tried = make_episode({}, agent=agents[0], start=0, seed=1)
    before, identity = _scores(family, what, tried), family.identity
    for name in family.parameters:
        _claim_moves(family, what, agents, name, may_rest=name in without_effect)
    claim(_scores(family, what, tried) == before, f"{what} scores an episode otherwise after others; keep no state")
    claim(family.identity == identity, f"{what} has another identity after episodes; it must not depend on them")
    _claim_elsewhere(family, what, tried, before)


def _claim_declared(family: Any, what: str) -> None:
    identity, metrics, parameters = family.identity, family.metrics, family.parameters
    claim(isinstance(identity, str) and identity, f"{what} has the identity {identity!r}; give a text")
    claim(isinstance(metrics, Mapping) and metrics, f"{what} has the metrics {metrics!r}; map each name to its unit")
    named = isinstance(parameters, Mapping) and all(isinstance(parameters[name], Parameter) for name in parameters)
    claim(named, f"{what} has the parameters {parameters!r}; map each name in θ to a Parameter")
    for name, one in parameters.items():
        holds = math.isfinite(one.low) and math.isfinite(one.high) and one.low < one.high
        claim(holds, f"{what} has a parameter '{name}' from {one.low} to {one.high}; give a finite range")
    claim(isinstance(family.starts, int) and family.starts > 0, f"{what} has {family.starts!r} starts; give at least 1")


def _claim_unknown(family: DomainFamily, what: str) -> None:
    try:
        family.check_agent(NOBODY)
    except InputError:
        return
    except Exception as problem:
        claim(False, f"{what} refuses an unknown agent by {type(problem).__name__}; raise proxytune.InputError")
    claim(
        False, f"{what} takes an agent '{NOBODY}'; check_agent must raise proxytune.InputError for what it cannot run"
    )


def _scores(family: DomainFamily, what: str, episode: Episode) -> Scores:
    """The metrics of an episode, which are those declared."""
    at = f"{what}, agent '{episode.agent}', start {episode.start}, θ {dict(episode.theta)}"
    scores = ask(at, lambda: family.run(episode))
    for name in family.metrics:
        claim(name in scores, f"{at}: gives no '{name}', which its metrics declare")
        claim(math.isfinite(scores[name]), f"{at}: gives '{name}' {scores[name]}; it must be finite")
    undeclared = sorted(set(scores) - set(family.metrics))
    claim(not undeclared, f"{at}: gives '{''.join(undeclared[:1])}', which its metrics do not declare")
    return dict(scores)


def _claim_moves(family: DomainFamily, what: str, agents: Sequence[str], name: str, *, may_rest: bool) -> None:
    """A parameter makes a difference at one end of its range, for some agent from some start."""
    parameter = family.parameters[name]
    instances: tuple[Theta, ...] = {}, {name: parameter.low}, {name: parameter.high}
    for start in range(min(family.starts, STARTS)):
        for agent in agents:
            episodes = (make_episode(theta, agent=agent, start=start, seed=1) for theta in instances)
            nominal, *moved = (_scores(family, what, episode) for episode in episodes)
            if any(scores != nominal for scores in moved):
                return
    line = f"scores all the same with '{name}' left out, {parameter.low:g} and {parameter.high:g}"
    claim(may_rest, f"{what} {line}; use it, or name it in without_effect")


def _claim_elsewhere(family: DomainFamily, what: str, episode: Episode, scores: Scores) -> None:
    """A copy, and another process, know it by the same identity and score alike."""
    try:
        copied = pickle.loads(pickle.dumps(family))
    except Exception as problem:
        return claim(
            False, f"{what} cannot be pickled ({type(problem).__name__}: {problem}); make it a frozen dataclass"
        )
    with working(functools.partial(_answer, copied), [episode, episode], jobs=2) as answers:
        there = list(answers)
    for where, (identity, answered) in (("a copy", _answer(copied, episode)), *(("another process", a) for a in there)):
        line = (
            f"has the identity '{identity}' in {where}, '{family.identity}' here; digest what it is made of, no hash()"
        )
        claim(identity == family.identity, f"{what} {line}")
        claim(answered == scores, f"{what} scores an episode otherwise in {where}; draw from episode.seed alone")
    return None


def _answer(family: DomainFamily, episode: Episode) -> tuple[str, Scores]:
    return family.identity, dict(family.run(episode))
