"""The promises of every agent of lane following, search engine, domain family and measure of usefulness.

Each `check_…` puts the thing to tasks of its own, and refuses it in one line with the first promise that is broken.
"""

import copy
import functools
import inspect
import math
import pickle
from collections.abc import Callable, Collection, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from proxytune import search
from proxytune.arrays import Floats
from proxytune.domain import DomainFamily, Episode, make_episode
from proxytune.driving import (
    COMMAND_FORM,
    NEEDS,
    Agent,
    GroundPlaneCamera,
    Picture,
    Robot,
    draw_floor,
    read_robot,
    shipped_map,
)
from proxytune.errors import EpisodeError, InputError
from proxytune.running import working
from proxytune.scores import Metric, ScoreTable
from proxytune.settings import nearest
from proxytune.space import Interval, Parameter, Space, Theta
from proxytune.testing.effect import ROBOT, ask, claim, claim_members
from proxytune.usefulness import ALL, Measure, Measured, assess

MAP = "small_loop"


def check_agent(agent: Agent | type[Agent], *, robot: Robot | None = None) -> None:
    """Refuse an agent that breaks a promise.

    It answers any picture with two finite duties in [−1, 1]; the same pictures always get the same answers, also while
    it drives in other episodes; and neither a picture nor a memory is changed in place.

    Args:
        agent: An agent, or what makes one when called.
        robot: Whose camera it sees through; the Duckiebot's if not given.

    Raises:
        ConformanceError: With the promise that is broken.
    """
    what = f"agent {getattr(agent, '__name__', type(agent).__name__)}"
    made: Any = ask(what, agent) if inspect.isclass(agent) else agent
    claim_members(made, what, NEEDS)
    robot = robot or read_robot(ROBOT)
    seen = _pictures(robot)
    alone = _driven(made, what, robot, seen)
    for tick, command in enumerate(alone):
        told = f"{what} answers picture {tick} with {command.tolist()}"
        claim(command.shape == (2,), f"{told}; {COMMAND_FORM}")
        claim(np.isfinite(command).all() and np.abs(command).max() <= 1.0, f"{told}; duties lie within [-1, 1]")
    again = _driven(made, what, robot, seen)
    claim(np.array_equal(alone, again), f"{what} drives otherwise the second time; keep all it learns in its memory")
    _claim_apart(made, what, robot, seen, alone)
    _claim_nothing_in_place(made, what, robot, seen)


def _pictures(robot: Robot) -> list[Picture]:
    """The pictures that the robot sees along a map, from askew too; then night, snow and noise."""
    road = shipped_map(MAP)
    camera = GroundPlaneCamera(robot.camera_figures(), draw_floor(road))
    poses = np.array([(x, y, np.radians(heading) + turned) for x, y, heading in road.starts for turned in (0.0, 0.8)])
    lane = camera.render(poses)
    noise = np.random.default_rng(1).integers(0, 256, lane[0].shape).astype(np.uint8)
    return [picture[-1] if picture.ndim == 4 else picture for picture in (*lane, 0 * noise, 0 * noise + 255, noise)]


def _act(agent: Agent, what: str, picture: Picture, memory: Any) -> tuple[NDArray[np.float64], Any]:
    kept = picture.copy()
    answer: Any = ask(what, lambda: agent.act(kept, memory))
    claim(np.array_equal(picture, kept), f"{what} changes the picture in place; copy it first")
    pair = isinstance(answer, tuple) and len(answer) == 2
    claim(pair, f"{what} answers with {type(answer).__name__}; act must give a tuple: the command and its memory")
    return ask(f"the command of {what}", lambda: np.array(answer[0], dtype=float)), answer[1]


def _driven(agent: Agent, what: str, robot: Robot, seen: Sequence[Picture]) -> NDArray[np.float64]:
    memory, commands = ask(what, lambda: agent.begin(robot)), []
    for picture in seen:
        command, memory = _act(agent, what, picture, memory)
        commands.append(command)
    claim(len({command.shape for command in commands}) == 1, f"{what} answers with commands of several shapes")
    return np.array(commands)


def _claim_apart(agent: Agent, what: str, robot: Robot, seen: Sequence[Picture], alone: NDArray[np.float64]) -> None:
    """Two episodes at once do not disturb each other."""
    one, other = agent.begin(robot), agent.begin(robot)
    for picture, backwards, command in zip(seen, seen[::-1], alone, strict=True):
        answered, one = _act(agent, what, picture, one)
        _, other = _act(agent, what, backwards, other)
        same = np.array_equal(answered, command)
        claim(same, f"{what} is disturbed by another episode under way; keep all it learns in its memory")


def _claim_nothing_in_place(agent: Agent, what: str, robot: Robot, seen: Sequence[Picture]) -> None:
    memory = agent.begin(robot)
    for picture in seen:
        before = copy.deepcopy(memory)
        first, later = _act(agent, what, picture, memory)
        later = copy.deepcopy(later)
        second, _ = _act(agent, what, picture, memory)
        third, _ = _act(agent, what, picture, before)
        same = np.array_equal(first, second) and np.array_equal(first, third)
        claim(same, f"{what} changes its memory in place; make a new one")
        memory = later


BOX = Space((Interval("delay", 0.0, 0.3), Interval("trim", -0.3, 0.3)))
NARROW = Space((Interval("mass", 200.0, 2000.0),))
"""A box of a single parameter."""
INITIAL, BUDGET, SEED, BATCH = 3, 8, 3, 3
Score = Callable[[Space, search.Values], float | None]
"""The score of a point, None where its trial fails."""


def _stepped(box: Space, values: search.Values) -> float | None:
    """A score with steps, lowest about a third of the way along each side, as PRPV's are."""
    return float(np.floor(12.0 * np.abs(search.to_unit(box, values) - 1.0 / 3.0).sum()))


GOAL = search.Goal((("agent", "score"),), np.zeros(1), np.zeros(1), lambda outcomes: np.asarray(outcomes[..., 0]))
"""An outcome that is the score itself, for an engine that learns from outputs; the target's is 0."""


def check_engine(engine: search.Engine) -> None:
    """Refuse an engine that breaks a promise.

    A proposal is a function of box, trials and seed alone: a new proposer says the same, whatever another was asked
    before; it lies in the box; points proposed together differ, pending ones being told; failed trials do not stop it;
    and the trials that it is told are left as they are.

    Args:
        engine: The engine.

    Raises:
        ConformanceError: With the promise that is broken.
    """
    claim(isinstance(engine, search.Engine), f"engine {engine!r} is a {type(engine).__name__}; make it an Engine")
    what = f"engine '{engine.name}'"
    reason = search.why_not_engine(engine, composed=True)
    claim(not reason, f"{what} cannot be used: {reason}")
    scores: tuple[Score, ...] = (
        _stepped,
        lambda box, values: -float(search.to_unit(box, values).sum()),  # lowest in a corner
        lambda box, values: None if search.to_unit(box, values)[0] > 0.5 else _stepped(box, values),  # half of it fails
    )
    for score in scores:
        _check_engine(engine, what, BOX, score)
    _check_engine(engine, what, NARROW, _stepped)


def _check_engine(engine: search.Engine, what: str, box: Space, score: Score) -> None:
    trials: list[search.Trial] = []
    for _ in range(BUDGET):
        values = _proposed(_made(engine, what), what, box, trials)
        found = score(box, values)
        trials.append(search.Trial(values, found, None if found is None else (found,)))
    used = _made(engine, what)
    for stop in (BUDGET - 1, INITIAL, BUDGET - 2):
        again = _proposed(used, what, box, trials[:stop])
        claim(again == trials[stop].values, f"{what} proposes otherwise when asked again; remember nothing")
    batch = ask(what, lambda: search.propose_batch(_made(engine, what), box, trials, SEED, BATCH))
    claim(len(set(batch)) == BATCH, f"{what} proposes {batch} together; points that are pending must not be repeated")
    for values in batch:
        _claim_inside(what, box, values)


def _made(engine: search.Engine, what: str) -> search.Proposer:
    return ask(what, lambda: search.make_proposer(engine, INITIAL, GOAL))


def _proposed(proposer: search.Proposer, what: str, box: Space, trials: Sequence[search.Trial]) -> search.Values:
    told = list(trials)
    values = ask(what, lambda: proposer.propose(box, told, SEED))
    claim(told == list(trials), f"{what} changes the trials that it is told; copy them first")
    _claim_inside(what, box, values)
    return values


def _claim_inside(what: str, box: Space, values: search.Values) -> None:
    sides = [f"{side.name} in [{side.low:g}, {side.high:g}]" for side in box.intervals]
    inside = len(values) == len(sides) and all(i.low <= v <= i.high for i, v in zip(box.intervals, values, strict=True))
    claim(inside, f"{what} proposes {values}; give one value for each of {', '.join(sides)}")


MEMBERS = ("identity", "metrics", "parameters", "starts", "check_agent", "run")
NOBODY = "nobody drives like this"
STARTS = 3
"""A parameter has to change something from one of the first so many starts."""
Scores = Mapping[str, float]
ScoresOf = Callable[[Episode], Scores]


def check_family(
    family: DomainFamily,
    *,
    agents: Sequence[str],
    without_effect: Collection[str] = (),
    compared: Collection[str] | None = None,
) -> None:
    """Refuse a domain family that breaks a promise.

    It can be pickled; the same episode has the same result, after other episodes, in another process and, where it has
    `run_many`, beside others too; each parameter changes a metric of some agent, or is named as one that does not;
    metrics are those that it declares, finite where agents are compared by them; its identity stays the same; and an
    agent that it does not know is refused.

    Args:
        family: The family.
        agents: Names of agents that drive in it.
        without_effect: Parameters that change no metric of these agents, as one that only shapes another.
        compared: The metrics that studies compare agents by, all if not given; any other may be missing or NaN.

    Raises:
        ConformanceError: With the promise that is broken.
    """
    what = f"family {type(family).__name__}"
    claim_members(family, what, MEMBERS)
    _claim_declared(family, what)
    needed = list(family.metrics if compared is None else compared)
    for name in needed:
        claim(name in family.metrics, f"{what} has no metric '{name}'; {nearest(name, family.metrics)}")
    scores_of = functools.partial(_scores, family, what, needed)
    for agent in agents:
        ask(f"check_agent('{agent}') of {what}", functools.partial(family.check_agent, agent))
    _claim_unknown(family, what)
    tried = make_episode({}, agent=agents[0], start=0, seed=1)
    before, identity = scores_of(tried), family.identity
    for name in family.parameters:
        _claim_moves(family, what, scores_of, agents, name, may_rest=name in without_effect)
    claim(scores_of(tried) == before, f"{what} scores an episode otherwise after others; keep no state")
    claim(family.identity == identity, f"{what} has another identity after episodes; it must not depend on them")
    _claim_elsewhere(family, what, tried, before)
    if hasattr(family, "run_many"):
        _claim_together(family, what, scores_of, agents)


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
    line = f"takes an agent '{NOBODY}'; check_agent must raise proxytune.InputError for what it cannot run"
    claim(False, f"{what} {line}")


def _scores(family: DomainFamily, what: str, needed: Sequence[str], episode: Episode) -> Scores:
    """The finite metrics of an episode, which are declared, and those needed among them."""
    at = f"{what}, agent '{episode.agent}', start {episode.start}, θ {dict(episode.theta)}"
    scores, remedy = ask(at, lambda: family.run(episode)), "or leave it out of `compared`, the metrics of studies"
    for name in needed:
        claim(name in scores, f"{at}: gives no '{name}', which its metrics declare; give it, {remedy}")
        claim(math.isfinite(scores[name]), f"{at}: gives '{name}' {scores[name]}; make it finite, {remedy}")
    undeclared = sorted(set(scores) - set(family.metrics))
    claim(not undeclared, f"{at}: gives '{''.join(undeclared[:1])}', which its metrics do not declare")
    return _finite(scores)


def _finite(scores: Scores) -> Scores:
    """The scores without those that are missing, as a study keeps them."""
    return {name: value for name, value in scores.items() if math.isfinite(value)}


def _claim_moves(
    family: DomainFamily, what: str, scores_of: ScoresOf, agents: Sequence[str], name: str, *, may_rest: bool
) -> None:
    """A parameter makes a difference at one end of its range, for some agent from some start."""
    parameter = family.parameters[name]
    instances: tuple[Theta, ...] = {}, {name: parameter.low}, {name: parameter.high}
    for start in range(min(family.starts, STARTS)):
        for agent in agents:
            episodes = (make_episode(theta, agent=agent, start=start, seed=1) for theta in instances)
            nominal, *moved = map(scores_of, episodes)
            if any(scores != nominal for scores in moved):
                return
    line = f"scores all the same with '{name}' left out, {parameter.low:g} and {parameter.high:g}"
    claim(may_rest, f"{what} {line}; use it, or name it in without_effect")


def _claim_elsewhere(family: DomainFamily, what: str, episode: Episode, scores: Scores) -> None:
    """A copy, and another process, know it by the same identity and score alike."""
    try:
        copied = pickle.loads(pickle.dumps(family))
    except Exception as problem:
        said = f"{type(problem).__name__}: {problem}"
        return claim(False, f"{what} cannot be pickled ({said}); make it a frozen dataclass")
    with working(functools.partial(_answer, copied), [episode, episode], jobs=2) as answers:
        there = list(answers)
    for where, (identity, answered) in (("a copy", _answer(copied, episode)), *(("another process", a) for a in there)):
        line = f"has the identity '{identity}' in {where}, '{family.identity}' here"
        claim(identity == family.identity, f"{what} {line}; digest what it is made of, no hash()")
        claim(answered == scores, f"{what} scores an episode otherwise in {where}; draw from episode.seed alone")
    return None


def _claim_together(family: Any, what: str, scores_of: ScoresOf, agents: Sequence[str]) -> None:
    """Episodes at once score as each does by itself."""
    starts = range(min(family.starts, STARTS))
    episodes = [make_episode({}, agent=agent, start=start, seed=1) for agent in agents for start in starts]
    together = list(ask(f"run_many of {what}", lambda: family.run_many(episodes)))
    claim(len(together) == len(episodes), f"{what}: run_many of {len(episodes)} episodes gives {len(together)} results")
    for episode, scores in zip(episodes, together, strict=True):
        same = not isinstance(scores, EpisodeError) and _finite(scores) == scores_of(episode)
        line = f"scores agent '{episode.agent}', start {episode.start} otherwise beside others; mix nothing"
        claim(same, f"{what} {line}")


def _answer(family: DomainFamily, episode: Episode) -> tuple[str, Scores]:
    return family.identity, _finite(family.run(episode))


METRICS = (Metric("distance"), Metric("deviation", "min", 0.1))
AGENTS, EPISODES, TABLES = 5, 6, 8
ROUNDING = 1e-9


def check_measure(measure: Measure, *, perfect: float | None = None) -> None:
    """Refuse a measure that breaks a promise.

    Of mean scores it takes any number of proxies at once, against a target each or one for all, and gives each the
    value that it has alone, which is a number or NaN; the scores are left as they are. Of an assessment it gives a
    value for each metric or one for all, with an interval only where episodes are repeated.

    Args:
        measure: The measure.
        perfect: What it is where the proxy's scores are the target's, if nothing can be better.

    Raises:
        ConformanceError: With the promise that is broken.
    """
    claim(isinstance(measure, Measure), f"measure {measure!r} is a {type(measure).__name__}; make it a Measure")
    what = f"measure '{measure.key}'"
    told = measure.on_means is not None or measure.read is not None
    claim(told, f"{what} has neither on_means nor read; give one of them")
    if measure.on_means is not None:
        _check_means(measure, what)
    for episodes in (1, EPISODES):
        _check_assessment(measure, what, episodes)
    if perfect is not None:
        _check_perfect(measure, what, perfect)


def _means(seed: int) -> Floats:
    """Mean scores of several tables (tables, agents, metrics)."""
    spread = np.random.default_rng(seed).normal(size=(TABLES, AGENTS, len(METRICS)))
    return np.asarray(spread + np.arange(AGENTS)[:, None])


def _of_means(measure: Measure, what: str, proxy: Floats, target: Floats) -> Floats:
    assert measure.on_means is not None
    on_means, kept = measure.on_means, (proxy.copy(), target.copy())
    values = np.asarray(ask(what, lambda: on_means(proxy, target, METRICS)), dtype=float)
    same = np.array_equal(proxy, kept[0]) and np.array_equal(target, kept[1])
    claim(same, f"{what} changes the scores in place; make a new array")
    shape = (*proxy.shape[:-2], *((len(METRICS),) if measure.per_metric else ()))
    wanted = "(…, metrics)" if measure.per_metric else "(…)"
    line = f"gives values {values.shape} of means {proxy.shape}; give {wanted}, here {shape}"
    claim(values.shape == shape, f"{what} {line}")
    claim(not np.isinf(values).any(), f"{what} is infinite; give NaN where it is undefined")
    return values


def _check_means(measure: Measure, what: str) -> None:
    proxies, targets = _means(1), _means(2)
    for target in (targets, targets[0]):
        together = _of_means(measure, what, proxies, target)
        single = [target] * TABLES if target.ndim == 2 else list(target)
        alone = [_of_means(measure, what, one, its) for one, its in zip(proxies, single, strict=True)]
        same = np.allclose(together, np.array(alone), rtol=ROUNDING, atol=0.0, equal_nan=True)
        claim(same, f"{what} gives tables together other values than each alone; keep the leading axes apart")
    stacked = _of_means(measure, what, proxies.reshape(2, -1, *proxies.shape[1:]), targets[0])
    same = np.array_equal(stacked.reshape(together.shape), together, equal_nan=True)
    claim(same, f"{what} mixes the values of two leading axes; keep the leading axes apart")


def _table(seed: int, episodes: int) -> ScoreTable:
    spread = np.random.default_rng(seed).normal(size=(AGENTS, episodes, len(METRICS)))
    values = spread + np.arange(AGENTS)[:, None, None]
    names = (tuple(f"agent{i}" for i in range(AGENTS)), tuple(map(str, range(episodes))))
    return ScoreTable(*names, tuple(metric.name for metric in METRICS), values)


def _measured(measure: Measure, what: str, proxy: ScoreTable, target: ScoreTable) -> Sequence[Measured]:
    found = ask(what, lambda: measure.measured(assess(proxy=proxy, target=target, metrics=METRICS)))
    names = [metric.name for metric in METRICS] if measure.per_metric else [ALL]
    claim(list(found) == names, f"{what} has values for {list(found)}; give them for {names}, in this order")
    return list(found.values())


def _check_assessment(measure: Measure, what: str, episodes: int) -> None:
    for one in _measured(measure, what, _table(1, episodes), _table(2, episodes)):
        finite = one.value is None or np.isfinite(one.value)
        claim(finite, f"{what} is {one.value}; give None where it is undefined")
        if episodes == 1:
            claim(one.interval is None, f"{what} has the interval {one.interval} of one episode; give None")
        elif one.interval is not None:
            low, high = one.interval
            claim(low <= high, f"{what} has the interval {one.interval}; give its lower end first")


def _check_perfect(measure: Measure, what: str, perfect: float) -> None:
    """It is so for a proxy with the target's scores, and no better for any other."""
    target = _table(2, EPISODES)
    for one in _measured(measure, what, target, target):
        close = one.value is not None and abs(one.value - perfect) <= ROUNDING
        claim(close, f"{what} is {one.value} where the proxy's scores are the target's; it must be {perfect:g}")
    for seed in range(10, 10 + TABLES):
        for one in _measured(measure, what, _table(seed, EPISODES), target):
            worse = one.value is None or (one.value - perfect) * (1.0 if measure.lower_is_better else -1.0) >= -ROUNDING
            claim(worse, f"{what} is {one.value}, better than {perfect:g} of a perfect proxy; check `better`")
