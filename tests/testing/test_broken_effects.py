"""An effect that breaks a promise is refused in one line that names the promise."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import pytest

from proxytune import Effect, Parameter
from proxytune.effects import Cue, Means, Panel, Stage, Trace, WheelCurve
from proxytune.errors import ConformanceError, InputError
from proxytune.testing import check_effect


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


def with_parameter(**changes):
    return (Parameter(**{**vars(Slow.parameters[0]), **changes}),)


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


class OneByOne(Slow):
    def apply(self, signal, memory):
        return signal + self.share * np.abs(signal).mean(axis=tuple(range(signal.ndim - 2)), keepdims=True), memory


class Raises(Slow):
    def apply(self, signal, memory):
        if self.share > 0.85:
            raise ValueError("too slow")
        return super().apply(signal, memory)


class NoProbes(Slow):
    parameters = with_parameter(probes=())


class FarNeutral(Slow):
    parameters = with_parameter(neutral=2.0)


class NoCue(Slow):
    trace = Trace(cues=(), shown=WheelCurve.STEP)


class NoFigure(Slow):
    trace = Trace(cues=(Cue.TRANSIENTS,), shown="steps")


class OddPanel(Slow):
    trace = Trace(cues=(Cue.TIME,), shown=Means(Cue.TIME, (Panel("", "time [s]", "speed"),)))


BROKEN = {
    Forgetful: "slow' at share 0.* changes by .* if the signal is cut at .*; keep memory",
    FromTheEnd: "depends on samples that come later",
    InPlace: "changes a memory in place",
    Chancy: "gives two results for one seed",
    Seeded: "depends on the seed, and its trace says otherwise",
    NotNeutral: "changes the signal at its neutral value",
    Endless: "is not finite|must keep the shape, all finite",
    Idle: "is the same at share .*; a parameter must matter all along its range",
    OneByOne: "filters a batch unlike its members",
    Raises: "'slow' raised ValueError: too slow at .*; correct its begin and apply",
    NoProbes: "'share' has no probes, from which a search sets out",
    FarNeutral: "neutral value 2.0 is not within",
    NoCue: r"a trace with the cues \(\); give a tuple of at least one Cue",
    NoFigure: "is to be shown by 'steps'; give its trace a WheelCurve, or Means",
    OddPanel: "a panel of the motion 'speed'; take one of forward, sideways, turn, left, right",
    int: "effect 'int' lacks name|effect 'int' lacks stage",
}


def test_an_effect_that_keeps_every_promise_passes():
    effect: type[Effect] = Slow
    assert check_effect(effect) is None


@pytest.mark.parametrize("effect", BROKEN, ids=lambda effect: effect.__name__)
@pytest.mark.filterwarnings("ignore:divide by zero", "ignore:invalid value")
def test_a_broken_promise_is_named_in_one_line(effect):
    with pytest.raises(ConformanceError, match=BROKEN[effect]) as refused:
        check_effect(effect)
    assert "\n" not in str(refused.value)


def test_it_is_bad_input_to_proxytune_and_a_failed_assertion_to_a_test_runner():
    assert issubclass(ConformanceError, InputError)
    assert issubclass(ConformanceError, AssertionError)
