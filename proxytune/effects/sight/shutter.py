"""Effects of the shutter: from which instants a picture is made. They are seen only in motion."""

from dataclasses import dataclass
from typing import ClassVar, NamedTuple

import numpy as np
from numpy.typing import NDArray

from proxytune.effects.effect import Setting, Signal, Stage
from proxytune.effects.trace import Trace
from proxytune.space import Parameter


class Exposed(NamedTuple):
    """The newest past pictures, and the weight of each picture in the window, the newest last."""

    pictures: Signal
    weights: Signal


class Late(NamedTuple):
    """The newest past pictures, and how old each of their equal parts, from above, is: whole samples and a fraction."""

    pictures: Signal
    whole: NDArray[np.int64]
    fraction: Signal


@dataclass(frozen=True)
class Blur:
    """A picture is the mean of what was before the lens during the last `blur` seconds.

    Between two rendered pictures the scene is taken to change linearly, so the mean is continuous in `blur`.
    Moving edges tell it by their width, which grows with their speed. It makes pictures older by half of itself: a
    latency that is found without it is too long by as much.
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

    def begin(self, setting: Setting) -> Exposed:
        """As if the robot had stood before the first picture for ever."""
        weights = _window(self.blur * setting.rate_hz)
        return Exposed(_still(setting, weights.size - 1), weights)

    def apply(self, signal: Signal, memory: Exposed) -> tuple[Signal, Exposed]:
        """Average over the window that ends with each picture."""
        length, past = signal.shape[-2], memory.weights.size - 1
        joined = np.concatenate((memory.pictures, signal), axis=-2)
        band = np.zeros((length, length + past), dtype=np.float32)
        for row in range(length):
            band[row, row : row + past + 1] = memory.weights
        return band @ joined, memory._replace(pictures=joined[..., length:, :])

    def mean_weights(self, rate_hz: float) -> Signal:
        """What each of the last pictures counts in the newest mean, the newest last: exact for pictures of 8 bits."""
        weights = _window(self.blur * rate_hz)
        return weights[int(np.argmax(weights > 0.0)) :]


@dataclass(frozen=True)
class RollingShutter:
    """Rows are read out one after another: the last is on time, row r of R older by readout · (1 − (r + ½)/R).

    The picture as a whole is thus older by half the readout, which looks like a latency; bends alone show that the rows
    differ.
    """

    readout: float
    name: ClassVar[str] = "rolling_shutter"
    stage: ClassVar[Stage] = Stage.IMAGE
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter(
            name="readout",
            unit="s",
            low=0.0,
            high=0.1,
            neutral=0.0,
            probes=(0.01, 0.02, 0.033, 0.06),
            source="CMOS sensors: up to the time between two frames, 0.033 s at 30 Hz, 0.067 s at 15 Hz",
        ),
    )
    trace: ClassVar[Trace | None] = None

    def begin(self, setting: Setting) -> Late:
        """As if the robot had stood before the first picture for ever."""
        rows = int(setting.nominal["camera_rows"])
        return _late(self.readout * setting.rate_hz * (1.0 - (np.arange(rows) + 0.5) / rows), setting)

    def apply(self, signal: Signal, memory: Late) -> tuple[Signal, Late]:
        """Show each row as old as it is."""
        return _show(signal, memory)


@dataclass(frozen=True)
class CameraLatency:
    """Pictures arrive late by a constant time; between two of them, their linear mix.

    Pictures at known places tell it where speeds and turns vary. What is found without blur in the model is the latency
    and half the blur.
    """

    camera_latency: float
    name: ClassVar[str] = "camera_latency"
    stage: ClassVar[Stage] = Stage.IMAGE
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter(
            name="camera_latency",
            unit="s",
            low=0.0,
            high=0.5,
            neutral=0.0,
            probes=(0.03, 0.06, 0.1, 0.2),
            source="USB cameras 0.03 to 0.1 s; over a wireless link some tenths of a second",
        ),
    )
    trace: ClassVar[Trace | None] = None

    def begin(self, setting: Setting) -> Late:
        """As if the robot had stood before the first picture for ever."""
        return _late(np.array([self.camera_latency * setting.rate_hz]), setting)

    def apply(self, signal: Signal, memory: Late) -> tuple[Signal, Late]:
        """Show each picture as old as it is."""
        return _show(signal, memory)


def _still(setting: Setting, count: int) -> Signal:
    """So many pictures of what was there before time zero."""
    rest = np.asarray(setting.rest, dtype=np.float32)[..., None, :]
    return np.repeat(rest, count, axis=-2)


def _late(samples: Signal, setting: Setting) -> Late:
    """The memory before the first picture of parts that are so many samples old."""
    whole = np.floor(samples + 1e-9).astype(np.int64)
    fraction = np.maximum(0.0, samples - whole).astype(np.float32)
    return Late(_still(setting, int(whole.max()) + 1), whole, fraction)


def _show(signal: Signal, memory: Late) -> tuple[Signal, Late]:
    """Mix, for each part, the two pictures that its age falls between."""
    length, past, parts = signal.shape[-2], memory.pictures.shape[-2], memory.whole.size
    joined = np.concatenate((memory.pictures, signal), axis=-2)
    split = joined.reshape(*joined.shape[:-1], parts, -1)
    newer, part = np.arange(past, past + length)[:, None] - memory.whole, np.arange(parts)
    older = memory.fraction[:, None]
    mixed = (1.0 - older) * split[..., newer, part, :] + older * split[..., newer - 1, part, :]
    return mixed.reshape(signal.shape), memory._replace(pictures=joined[..., length:, :])


_QUANTUM = 2**16
_NONE = 1e-9
"""A window of fewer samples has weight on the newest alone; the arithmetic of the smallest numbers overflows."""


def _window(samples: float) -> Signal:
    """Trapezoid weights of a window that reaches back a fractional number of samples, the newest last.

    They are whole multiples of 2⁻¹⁶ that add up to 1: sums over 8-bit pictures are then exact in single precision, so
    that every processor gives the same picture, whatever the order in which it adds.
    """
    if samples < _NONE:
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
