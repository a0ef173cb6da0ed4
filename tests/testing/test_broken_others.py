"""An agent, a family, an engine or a measure that breaks a promise is refused in one line that names the promise."""

import itertools
import os
import subprocess
import sys
from dataclasses import dataclass, replace

import numpy as np
import pytest
from partly_dead import PartlyDead
from wobbly import Wobbly

from proxytune.driving.agents import AGENTS
from proxytune.errors import ConformanceError
from proxytune.search.engines import sobol
from proxytune.search.engines.engine import Engine
from proxytune.testing import check_agent, check_engine, check_family, check_measure
from proxytune.usefulness import Measure


def refused(check, thing, line, **more):
    with pytest.raises(ConformanceError, match=line) as told:
        check(thing, **more)
    assert "\n" not in str(told.value)


class Agent:
    def begin(self, robot):
        return np.zeros(1)

    def act(self, picture, memory):
        return np.full(2, 0.5 * memory[0] + 0.1), memory * 0.5 + picture.mean() / 255.0


class Impatient(Agent):
    def act(self, picture, memory):
        return (2.0, 0.0), memory


class Three(Agent):
    def act(self, picture, memory):
        return (0.0, 0.0, 0.0), memory


class Alone(Agent):
    def act(self, picture, memory):
        return (0.1, 0.1)[:1], memory


class Single(Agent):
    def act(self, picture, memory):
        return np.zeros(2)


class Counting(Agent):
    def __init__(self):
        self.steps = itertools.count()

    def act(self, picture, memory):
        return np.full(2, 1.0 / (1 + next(self.steps))), memory


class Sharing(Agent):
    def begin(self, robot):
        self.seen = 0.0

    def act(self, picture, memory):
        self.seen = 0.5 * self.seen + 0.5 * picture.mean() / 255.0
        return np.full(2, self.seen), memory


class InPlace(Agent):
    def act(self, picture, memory):
        memory[0] += 0.01
        return np.full(2, memory[0]), memory


class Painting(Agent):
    def act(self, picture, memory):
        picture[:] = 0
        return np.zeros(2), memory


AGENTS_OF_THIS = {
    Impatient: r"answers picture 0 with \[2.0, 0.0\]; duties lie within",
    Three: "a command is two duties",
    Alone: "a command is two duties",
    Single: "answers with ndarray; act must give a tuple",
    Counting: "drives otherwise the second time",
    Sharing: "is disturbed by another episode under way",
    InPlace: "changes its memory in place",
    Painting: "changes the picture in place",
    int: "lacks begin, act",
}


def test_an_agent_that_keeps_every_promise_passes():
    assert check_agent(Agent) is check_agent(AGENTS["steady"]) is None


@pytest.mark.parametrize("agent", AGENTS_OF_THIS, ids=lambda agent: agent.__name__)
def test_an_agent_that_breaks_a_promise_is_refused(agent):
    refused(check_agent, agent, AGENTS_OF_THIS[agent])


@dataclass(frozen=True)
class Altered(Wobbly):
    """A family with one fault: what its scores become, which parameter is idle, or what it is made of."""

    extra: tuple[str, ...] = ()
    missing: str = ""
    idle: str = ""
    chance: bool = False

    def run(self, episode):
        theta = tuple(pair for pair in episode.theta if pair[0] != self.idle)
        scores = {**super().run(replace(episode, theta=theta)), **dict.fromkeys(self.extra, 1.0)}
        scores.pop(self.missing, None)
        return {name: value + self.chance * np.random.default_rng().normal() for name, value in scores.items()}


class ByProcess(Wobbly):
    @property
    def identity(self):
        return f"of {os.getpid()}"


class AnyAgent(Wobbly):
    def check_agent(self, name):
        """Any will do."""


class Unpicklable(Wobbly):
    def __reduce__(self):
        raise TypeError("an open window")


FAMILIES = {
    "an undeclared metric": (Altered(extra=("height",)), "gives 'height', which its metrics do not declare"),
    "a missing metric": (Altered(missing="distance"), "gives no 'distance', which its metrics declare"),
    "a metric that is no number": (Wobbly(faults=("agent0:*:nan",)), "gives 'distance' nan; it must be finite"),
    "an idle parameter": (
        Altered(idle="trim"),
        "scores all the same with 'trim' left out, -0.3 and 0.3; use it",
    ),
    "chance": (Altered(chance=True), "scores an episode otherwise after others; keep no state"),
    "an identity of the process": (ByProcess(), "has the identity 'of .*' in another process, 'of .*' here"),
    "any agent": (AnyAgent(), "takes an agent 'nobody drives like this'; check_agent must raise"),
    "an open window": (Unpicklable(), r"cannot be pickled \(TypeError: an open window\)"),
    "a bug": (Wobbly(faults=("agent0:*:crashes",)), "raised ZeroDivisionError: division by zero; it must not"),
    "no family": ({}, "family dict lacks identity, metrics, parameters, starts, check_agent, run"),
}


@pytest.mark.slow
def test_a_family_that_keeps_every_promise_passes_also_with_a_parameter_that_is_said_to_do_nothing():
    assert check_family(Wobbly(), agents=["agent0"]) is None
    assert check_family(Altered(idle="trim"), agents=["agent0"], without_effect=["trim"]) is None


@pytest.mark.slow
@pytest.mark.parametrize("case", FAMILIES)
def test_a_family_that_breaks_a_promise_is_refused(case):
    refused(check_family, FAMILIES[case][0], FAMILIES[case][1], agents=["agent0"])


def test_a_family_with_a_dead_parameter_is_told_so():
    class Refusing(PartlyDead):
        def check_agent(self, name):
            AnyAgent.check_agent(self, name) if name.startswith("agent") else Wobbly().check_agent(name)

    refused(check_family, Refusing(), "'dead' left out, 0 and 1; use it, or name it", agents=["agent1"])


class Proposer:
    """Points of the design; each fault is a class below."""

    def propose(self, space, trials, seed):
        return sobol.Sobol().propose(space, trials, seed)


class Outside(Proposer):
    def propose(self, space, trials, seed):
        return tuple(side.high + 1.0 for side in space.intervals)


class Short(Proposer):
    def propose(self, space, trials, seed):
        return (space.intervals[0].low,) * 3


class Remembering(Proposer):
    calls = 0

    def propose(self, space, trials, seed):
        self.calls += 1
        return super().propose(space, [*trials, *trials[: self.calls]], seed)


class Random(Proposer):
    def propose(self, space, trials, seed):
        return tuple(float(np.random.default_rng().uniform(side.low, side.high)) for side in space.intervals)


class NeedsScores(Proposer):
    def propose(self, space, trials, seed):
        min(trial.score + 0.0 for trial in trials)
        return super().propose(space, trials, seed)


PROPOSERS = {
    Outside: r"'mine' proposed \(1.3, 1.3\); give one value for each of delay in \[0, 0.3\], trim in",
    Short: "give one value for each of delay",
    Remembering: "proposes otherwise when asked again; remember nothing",
    Random: "proposes otherwise when asked again; remember nothing",
    NeedsScores: "'mine' raised TypeError: unsupported operand .*; correct it",
}


def test_an_engine_that_keeps_every_promise_passes():
    assert check_engine(Engine("mine", "mine", "the design", Proposer)) is None


@pytest.mark.parametrize("proposer", PROPOSERS, ids=lambda proposer: proposer.__name__)
def test_an_engine_that_breaks_a_promise_is_refused(proposer):
    refused(check_engine, Engine("mine", "mine", "wrong", proposer), PROPOSERS[proposer])


def test_what_is_no_engine_is_refused():
    refused(check_engine, Proposer, "is a type; make it an Engine")


def bias(proxy, target, metrics):
    return np.abs(proxy - target).mean(axis=(-2, -1))


def in_place(proxy, target, metrics):
    proxy -= target
    return np.abs(proxy).mean(axis=(-2, -1))


MEASURES = {
    "of a shape of its own": (lambda p, t, m: np.abs(p - t).mean(axis=-1), r"give \(…\), here \(8,\)"),
    "of all tables together": (lambda p, t, m: bias(p, t, m) * 0.0 + np.mean(p), "gives tables together other values"),
    "in place": (in_place, "changes the scores in place"),
    "infinite": (lambda p, t, m: bias(p, t, m) * np.inf, "is infinite; give NaN where it is undefined"),
    "upside down": (lambda p, t, m: -bias(p, t, m), "better than 0 of a perfect proxy; check `better`"),
    "with an offset": (lambda p, t, m: 1.0 + bias(p, t, m), "is 1.0 where the proxy's scores are the target's"),
    "for a target each": (lambda p, t, m: bias(p, t.reshape(p.shape), m), "raised ValueError"),
    "of nothing": (None, "has neither on_means nor read"),
}


def measure(on_means):
    return Measure("mine", "mine", "my measure", "lower", "any", ".2f", on_means=on_means)


def test_a_measure_that_keeps_every_promise_passes():
    assert check_measure(measure(bias), perfect=0.0) is None


@pytest.mark.parametrize("case", MEASURES)
def test_a_measure_that_breaks_a_promise_is_refused(case):
    refused(check_measure, measure(MEASURES[case][0]), MEASURES[case][1], perfect=0.0)


@pytest.mark.slow
def test_the_checks_need_no_test_runner():
    code = "import sys, proxytune.testing; sys.exit(bool({'pytest', 'hypothesis'} & set(sys.modules)))"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
