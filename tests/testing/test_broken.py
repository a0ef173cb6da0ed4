"""An effect, agent, family, engine or measure that breaks a promise is refused in one line that names the promise."""

import itertools
import os
import subprocess
import sys
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
import pytest
from convoy import Convoy
from partly_dead import PartlyDead
from wobbly import Wobbly

from proxytune.driving import AGENTS
from proxytune.effects import Cue, Effect, Stage, WheelCurve
from proxytune.effects.effect import Trace
from proxytune.errors import ConformanceError, InputError
from proxytune.search import Engine
from proxytune.search.engine import Sobol
from proxytune.space import Parameter
from proxytune.testing.effect import check_effect
from proxytune.testing.extension import check_agent, check_engine, check_family, check_measure
from proxytune.usefulness import Measure


@dataclass(frozen=True)
class Slow:
    """Wheels follow a share of the last command."""

    share: float
    name: ClassVar[str] = "slow"
    stage: ClassVar[Stage] = Stage.ACTUATION
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter(name="share", unit="", low=0.0, high=0.9, neutral=0.0, probes=(0.1, 0.3, 0.8)),
    )
    trace: ClassVar[Trace | None] = Trace(cues=(Cue.TRANSIENTS,), shown=WheelCurve.STEP)

    def begin(self, setting):
        return np.asarray(setting.rest, dtype=float)[..., None, :]

    def apply(self, signal, memory):
        before = np.concatenate((memory, signal[..., :-1, :]), axis=-2)
        return (1.0 - self.share) * signal + self.share * before, signal[..., -1:, :]


class Forgetful(Slow):
    def apply(self, signal, memory):
        return super().apply(signal, memory)[0], memory


class FromTheEnd(Slow):
    def apply(self, signal, memory):
        return signal + self.share * signal[..., -1:, :], memory


class InPlace(Slow):
    def apply(self, signal, memory):
        filtered, after = super().apply(signal, memory)
        memory[:] = after
        return filtered, memory


class AtRestAmid(Slow):
    def recall(self, context, whole, signal, row, sample):
        return self.begin(context)


class Recalling(Slow):
    def recall(self, context, whole, signal, row, sample):
        return signal[row, sample - 1][:, None]


class Chancy(Slow):
    def apply(self, signal, memory):
        return signal + self.share * np.random.default_rng().normal(size=signal.shape), memory


class Seeded(Slow):
    def begin(self, setting):
        return super().begin(setting) + setting.seed * 0.1


class NotNeutral(Slow):
    def apply(self, signal, memory):
        return super().apply(0.9 * signal, memory)


class Endless(Slow):
    def apply(self, signal, memory):
        filtered, after = super().apply(signal, memory)
        return filtered / (self.share < 0.9), after


class Idle(Slow):
    def apply(self, signal, memory):
        return super().apply(signal, memory) if self.share < 0.5 else Slow(0.5).apply(signal, memory)


@dataclass(frozen=True)
class Bent(Slow):
    """What is slowed is the more so the larger it is: of no matter where nothing is slowed."""

    bend: float = 1.0
    parameters: ClassVar[tuple[Parameter, ...]] = (
        *Slow.parameters,
        Parameter(name="bend", unit="", low=0.5, high=2.0, neutral=1.0, probes=(0.7, 1.5)),
    )

    def apply(self, signal, memory):
        return signal * (1.0 - self.share * np.abs(signal) ** self.bend), memory


class OneByOne(Slow):
    def apply(self, signal, memory):
        return signal + self.share * np.abs(signal).mean(axis=tuple(range(signal.ndim - 2)), keepdims=True), memory


class Raises(Slow):
    def apply(self, signal, memory):
        if self.share > 0.85:
            raise ValueError("too slow")
        return super().apply(signal, memory)


class NoProbes(Slow):
    parameters = (Parameter(name="share", unit="", low=0.0, high=0.9, neutral=0.0),)


BROKEN_EFFECTS = {
    Forgetful: "slow' at share 0.* changes by .* if the signal is cut at .*; keep memory",
    FromTheEnd: "depends on samples that come later",
    InPlace: "changes a memory in place",
    AtRestAmid: "goes on amid a signal .* unlike it; recall what came before",
    Chancy: "gives two results for one seed",
    Seeded: "depends on the seed, and its trace says otherwise",
    NotNeutral: "changes the signal at its neutral value",
    Endless: "is not finite|must keep the shape, all finite",
    Idle: "is the same at share .*; a parameter must matter all along its range$",
    Bent: r"same at bend 0.5 and .*; declare one that only shapes another with Parameter\(shape=True\)",
    OneByOne: "filters a batch unlike its members",
    Raises: "'slow' raised ValueError: too slow at .*; correct its begin and apply",
    NoProbes: "'share' has no probes, from which a search sets out",
    int: "effect 'int' lacks name|effect 'int' lacks stage",
}


def test_an_effect_agent_engine_or_measure_that_keeps_every_promise_passes():
    effect: type[Effect] = Slow
    assert check_effect(effect) is check_effect(Recalling) is None
    share, bend = Bent.parameters
    assert check_effect(type("Shaped", (Bent,), {"parameters": (share, replace(bend, shape=True))})) is None
    assert check_agent(Agent) is check_agent(AGENTS["steady"]) is None
    assert check_engine(Engine("mine", "mine", "the design", Proposer)) is None
    assert check_measure(measure(bias), perfect=0.0) is None


@pytest.mark.parametrize("effect", BROKEN_EFFECTS, ids=lambda effect: effect.__name__)
@pytest.mark.filterwarnings("ignore:divide by zero", "ignore:invalid value")
def test_a_broken_promise_is_named_in_one_line(effect):
    refused(check_effect, effect, BROKEN_EFFECTS[effect])


def test_it_is_bad_input_to_proxytune_and_a_failed_assertion_to_a_test_runner():
    assert issubclass(ConformanceError, InputError)
    assert issubclass(ConformanceError, AssertionError)


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


class Overwriting(Agent):
    def act(self, picture, memory):
        memory[0] += 0.01
        return np.full(2, memory[0]), memory


class Painting(Agent):
    def act(self, picture, memory):
        picture[:] = 0
        return np.zeros(2), memory


BROKEN_AGENTS = {
    Impatient: r"answers picture 0 with \[2.0, 0.0\]; duties lie within",
    Three: "a command is two duties",
    Single: "answers with ndarray; act must give a tuple",
    Counting: "drives otherwise the second time",
    Sharing: "is disturbed by another episode under way",
    Overwriting: "changes its memory in place",
    Painting: "changes the picture in place",
    int: "lacks begin, act",
}


@pytest.mark.parametrize("agent", BROKEN_AGENTS, ids=lambda agent: agent.__name__)
def test_an_agent_that_breaks_a_promise_is_refused(agent):
    refused(check_agent, agent, BROKEN_AGENTS[agent])


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


BROKEN_FAMILIES = {
    "an undeclared metric": (Altered(extra=("height",)), "gives 'height', which its metrics do not declare"),
    "a missing metric": (Altered(missing="distance"), "gives no 'distance', which its metrics declare; give it"),
    "a metric that is no number": (Wobbly(faults=("agent0:*:nan",)), "gives 'distance' nan; make it finite"),
    "an idle parameter": (Altered(idle="trim"), "scores all the same with 'trim' left out, -0.3 and 0.3; use it"),
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


def test_a_metric_that_no_study_compares_by_may_be_missing_or_nan():
    for family in (Wobbly(faults=("agent0:*:nan",)), Altered(missing="distance")):
        assert check_family(family, agents=["agent0"], compared=["survival_time"]) is None
        refused(check_family, family, "or leave it out of `compared`", agents=["agent0"], compared=["distance"])
    unknown = "has no metric 'distanc'; did you mean 'distance'"
    refused(check_family, Wobbly(), unknown, agents=["agent0"], compared=["distanc"])


class Mixing(Convoy):
    def run_many(self, episodes):
        return super().run_many(episodes)[::-1]


def test_a_family_that_scores_episodes_otherwise_at_once_or_has_a_dead_parameter_is_told_so():
    assert check_family(Convoy(), agents=["agent0", "agent1"]) is None
    refused(check_family, Mixing(), "scores agent 'agent0', start 0 otherwise beside", agents=["agent0", "agent1"])

    class Refusing(PartlyDead):
        def check_agent(self, name):
            AnyAgent.check_agent(self, name) if name.startswith("agent") else Wobbly().check_agent(name)

    refused(check_family, Refusing(), "'dead' left out, 0 and 1; use it, or name it", agents=["agent1"])


@pytest.mark.slow
@pytest.mark.parametrize("case", BROKEN_FAMILIES)
def test_a_family_that_breaks_a_promise_is_refused(case):
    refused(check_family, BROKEN_FAMILIES[case][0], BROKEN_FAMILIES[case][1], agents=["agent0"])


class Proposer:
    """Points of the design; each fault is a class below."""

    def propose(self, space, trials, seed):
        return Sobol().propose(space, trials, seed)


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


class NeedsScores(Proposer):
    def propose(self, space, trials, seed):
        min(trial.score + 0.0 for trial in trials)
        return super().propose(space, trials, seed)


BROKEN_PROPOSERS = {
    Outside: r"'mine' proposed \(1.3, 1.3\); give one value for each of delay in \[0, 0.3\], trim in",
    Short: "give one value for each of delay",
    Remembering: "proposes otherwise when asked again; remember nothing",
    NeedsScores: "'mine' raised TypeError: unsupported operand .*; correct it",
}


@pytest.mark.parametrize("proposer", BROKEN_PROPOSERS, ids=lambda proposer: proposer.__name__)
def test_an_engine_that_breaks_a_promise_is_refused(proposer):
    refused(check_engine, Engine("mine", "mine", "wrong", proposer), BROKEN_PROPOSERS[proposer])


def test_what_is_no_engine_is_refused():
    refused(check_engine, Proposer, "is a type; make it an Engine")


def bias(proxy, target, metrics):
    return np.abs(proxy - target).mean(axis=(-2, -1))


def in_place(proxy, target, metrics):
    proxy -= target
    return np.abs(proxy).mean(axis=(-2, -1))


BROKEN_MEASURES = {
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


@pytest.mark.parametrize("case", BROKEN_MEASURES)
def test_a_measure_that_breaks_a_promise_is_refused(case):
    refused(check_measure, measure(BROKEN_MEASURES[case][0]), BROKEN_MEASURES[case][1], perfect=0.0)


@pytest.mark.slow
def test_the_checks_need_no_test_runner():
    code = "import sys, proxytune.testing; sys.exit(bool({'pytest', 'hypothesis'} & set(sys.modules)))"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
