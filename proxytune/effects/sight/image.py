"""Effects on the picture after the lens has drawn it."""

from dataclasses import dataclass
from typing import ClassVar, NamedTuple

import numpy as np

from proxytune.effects.effect import Setting, Signal, Stage
from proxytune.effects.trace import Trace
from proxytune.space import Parameter


class Exposure(NamedTuple):
    """The newest past pictures, and the weight of each picture in the window, the newest last."""

    pictures: Signal
    weights: Signal


@dataclass(frozen=True)
class Blur:
    """A picture is the mean of what was before the lens during the last `blur` seconds.

    Between two rendered pictures the scene is taken to change linearly, so the mean is continuous in `blur`.
    """

    blur: float
    name: ClassVar[str] = "blur"
    stage: ClassVar[Stage] = Stage.IMAGE
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter(
            name="blur",
            unit="s",
            low=0.0,
            high=0.2,
            neutral=0.0,
            probes=(0.0125, 0.025, 0.05, 0.1),
            source="box of the paper 0 to 0.10 s",
        ),
    )
    trace: ClassVar[Trace | None] = None

    def begin(self, setting: Setting) -> Exposure:
        """As if the robot had stood before the first picture for ever."""
        weights = _window(self.blur * setting.rate_hz)
        rest = np.asarray(setting.rest, dtype=np.float32)[..., None, :]
        return Exposure(np.repeat(rest, weights.size - 1, axis=-2), weights)

    def apply(self, signal: Signal, memory: Exposure) -> tuple[Signal, Exposure]:
        """Average over the window that ends with each picture."""
        length, past = signal.shape[-2], memory.weights.size - 1
        joined = np.concatenate((memory.pictures, signal), axis=-2)
        band = np.zeros((length, length + past), dtype=np.float32)
        for row in range(length):
            band[row, row : row + past + 1] = memory.weights
        return band @ joined, memory._replace(pictures=joined[..., length:, :])


_QUANTUM = 2**16


def _window(samples: float) -> Signal:
    """Trapezoid weights of a window that reaches back a fractional number of samples, the newest last.

    They are whole multiples of 2⁻¹⁶ that add up to 1: sums over 8-bit pictures are then exact in single precision, so
    that every processor gives the same picture, whatever the order in which it adds.
    """
    if samples == 0.0:
        return np.ones(1, dtype=np.float32)
    whole = int(np.floor(samples + 1e-9))
    part = max(0.0, samples - whole)
    backwards = np.zeros(whole + 2)
    backwards[:whole] += 0.5
    backwards[1 : whole + 1] += 0.5
    backwards[whole] += part * (1.0 - part / 2.0)
    backwards[whole + 1] += part * part / 2.0
    quanta = np.diff(np.rint(np.cumsum(backwards) * (_QUANTUM / samples)), prepend=0.0)
    return (quanta[::-1] / _QUANTUM).astype(np.float32)
