"""The text of an effect that a user writes beside a study, whole and with one thing wrong at a time."""

WEAK_REVERSE = '''"""An effect of one's own."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from proxytune.effects import Cue, Draws, FilterContext, Form, Means, Panel, Signal, Stage, Trace
from proxytune.space import Parameter


@dataclass(frozen=True)
class WeakReverse:
    """The robot is slower backwards than forwards."""

    loss: float
    name: ClassVar[str] = "weak_reverse"
    stage: ClassVar[Stage] = Stage.MOTION
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter(
            name="loss", unit="", low=0.0, high=0.9, neutral=0.0,
            probes=(0.02, 0.05, 0.1, 0.2, 0.4, 0.8), source="made up",
        ),
    )
    trace: ClassVar[Trace | None] = Trace(
        cues=(Cue.DIRECTION,),
        shown=Means(Cue.DIRECTION, (Panel("forward", "forward speed [m/s]", "forward"),)),
    )

    def begin(self, context: FilterContext) -> None:
        """Nothing to remember."""

    def apply(self, signal: Signal, memory: None) -> tuple[Signal, None]:
        """Slow down what is backwards."""
        forward = signal[..., :1]
        slowed = np.where(forward < 0.0, (1.0 - self.loss) * forward, forward)
        return np.concatenate((slowed, signal[..., 1:]), axis=-1), None
'''

NAME = "weak_reverse:WeakReverse"

WRONG = {
    "no trace": ("    trace: ClassVar[Trace | None] = ", "    track = ", "lacks trace; add"),
    "a stage in words": (
        "stage: ClassVar[Stage] = Stage.MOTION",
        'stage = "motion"',
        "has the stage 'motion'; take one of .*motion",
    ),
    "no parameters": (
        "    def begin",
        "    parameters = ()\n\n    def begin",
        r"has the parameters \(\); give a tuple of at least one Parameter",
    ),
    "a neutral value out of its range": (
        "neutral=0.0",
        "neutral=1.5",
        r"parameter 'loss' whose neutral value 1.5 is not within \[0, 0.9\]",
    ),
    "a range upside down": ("low=0.0", "low=2.0", "parameter 'loss' from 2.0 to 0.9; give a finite range"),
    "a usual range beyond what can be": (
        "neutral=0.0,",
        "neutral=0.0, usual=(0.0, 1.0),",
        r"parameter 'loss' with the usual range \[0.0, 1.0\], which is not within \[0, 0.9\]; widen that",
    ),
    "no probes": ("probes=(0.02, 0.05, 0.1, 0.2, 0.4, 0.8),", "", "has a trace, but 'loss' has no probes"),
    "another field": ("    loss: float", "    lost: float", "has the fields lost; its parameters are loss"),
    "another shape": (
        "return np.concatenate((slowed, signal[..., 1:]), axis=-1), None",
        "return slowed, None",
        "makes a signal",
    ),
    "no memory": ("signal[..., 1:]), axis=-1), None", "signal[..., 1:]), axis=-1)", "answers with ndarray; apply must"),
    "a bug": ("self.loss)", "self.lost)", "raised AttributeError: .*lost.*; correct its begin and apply"),
    "not neutral": ("(1.0 - self.loss)", "(0.9 - self.loss)", r"changes the signal at its neutral value \[0.0\]"),
    "chance": (
        "cues=(Cue.DIRECTION,),",
        "cues=(Cue.DIRECTION,), draws=Draws(lambda value, rate: None, (0.1, 1.0)),",
        "draws at random, which only shipped ones may",
    ),
    "a probe out of its range": ("0.4, 0.8)", "0.4, 1.8)", r"parameter 'loss' with a probe 1.8 that is not within"),
    "a bug at one end": (
        "forward = signal[..., :1]\n",
        "forward = signal[..., :1] if self.loss < 0.9 else None\n",
        r"raised TypeError: .* at \[0.9\]; correct its begin and apply",
    ),
    "no cue": ("cues=(Cue.DIRECTION,),", "cues=(),", r"a trace with the cues \(\); give a tuple of at least one"),
    "no figure": ("shown=Means(", "shown=(", "is to be shown by .*; give its trace a WheelCurve, or Means with panels"),
    "a panel of no motion": ('"forward"),))', '"speed"),))', "has a panel of the motion 'speed'; take one of forward,"),
    "a panel of no signal": ('(Panel("forward"', '(Panel("speed"', "a panel of the signal 'speed'; leave it empty,"),
    "no panel": ('(Panel("forward", "forward speed [m/s]", "forward"),)', "()", "take a Cue and at least one Panel"),
    "a form of another": (
        "cues=(Cue.DIRECTION,),",
        'cues=(Cue.DIRECTION,), forms=(Form((("lost",),)),),',
        "has a form with the parameter 'lost'; its parameters are loss",
    ),
    "no class": ("class WeakReverse:", "class Other:", "weak_reverse has no 'WeakReverse'"),
}
"""What is replaced in it, by what, and what is said of that."""
