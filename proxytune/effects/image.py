"""Effects on how a picture comes out, once it is known what is before the lens.

Focus, vignetting, exposure and noise change each picture by itself. Blur, rolling shutter and latency mix it with those
before it, and are seen only in motion.
"""

import math
from typing import NamedTuple

import numpy as np
from scipy.ndimage import correlate1d
from scipy.special import ive

from proxytune.arrays import Whole
from proxytune.effects.effect import FilterContext, ShippedEffect, Signal, Stage, effect, parameter, skip_nothing
from proxytune.seeds import picture_generator


def _size(context: FilterContext) -> tuple[int, int]:
    """Rows and columns of the pictures."""
    return int(context.nominal["camera_rows"]), int(context.nominal["camera_columns"])


class PointSpread(NamedTuple):
    """Rows and columns of the pictures, and how a point spreads along either."""

    rows: int
    columns: int
    weights: Signal


@effect("defocus", Stage.IMAGE)
class Defocus(ShippedEffect):
    """The lens is out of focus: a point becomes a Gaussian spot, of the same width all over the picture.

    Edges tell it by the width that they have when nothing moves; motion widens them by blur.
    """

    deviation: float = parameter("", 0.0, 0.05, probes=(0.005, 0.01, 0.02, 0.04),
        source="standard deviation as a share of the picture's height: 1 to 5 pixels of 480 on "
               "well-kept cameras")  # fmt: skip
    skip = skip_nothing

    def begin(self, context: FilterContext) -> PointSpread:
        """The spot's width in pixels of this picture."""
        rows, columns = _size(context)
        deviation = self.deviation * rows
        # The Gaussian on whole pixels (Lindeberg 1990) has this standard deviation even if that is part of a pixel
        reach = math.ceil(4.0 * deviation) + 2
        weights = ive(np.abs(np.arange(-reach, reach + 1)), deviation**2)
        return PointSpread(rows, columns, np.asarray(weights / weights.sum()))

    def apply(self, signal: Signal, memory: PointSpread) -> tuple[Signal, PointSpread]:
        """Spread every point; beyond its edges the picture goes on as it ends."""
        soft = signal.reshape(*signal.shape[:-1], memory.rows, memory.columns, 3)
        for axis in (-3, -2):
            soft = correlate1d(soft, memory.weights, axis, output=np.float32, mode="nearest")
        return soft.reshape(signal.shape), memory


@effect("vignetting", Stage.IMAGE)
class Vignetting(ShippedEffect):
    """The picture is darker towards its corners: by the factor 1 − strength · (r/r_corner)² about its middle.

    The floor tells it without knowledge of the paint, for the same paint is seen near the middle and near the corners.
    """

    strength: float = parameter("", 0.0, 0.9, probes=(0.1, 0.2, 0.4, 0.7),
        source="the cos⁴ law: 0.5 in corners 33° off the axis, 0.85 in those of a Duckiebot, 52° off")  # fmt: skip
    skip = skip_nothing

    def begin(self, context: FilterContext) -> Signal:
        """The factor of every pixel and colour (channels,)."""
        rows, columns = _size(context)
        down, right = np.mgrid[:rows, :columns] + 0.5 - np.reshape([rows / 2.0, columns / 2.0], (2, 1, 1))
        share = 4.0 * (down**2 + right**2) / (rows**2 + columns**2)
        return np.repeat(1.0 - self.strength * share, 3).astype(np.float32)

    def apply(self, signal: Signal, memory: Signal) -> tuple[Signal, Signal]:
        """Darken every pixel by its factor."""
        return signal * memory, memory


@effect("exposure", Stage.IMAGE)
class Exposure(ShippedEffect):
    """Brightness x of 255 becomes 255 · gain · (x/255)^gamma.

    Pictures tell both only relative to the paint that the map declares: a brighter floor is the same as a greater gain.
    What is found makes the proxy's pictures match; it is no statement about the camera.
    """

    gain: float = parameter("", 0.2, 4.0, 1.0, probes=(0.5, 0.8, 1.25, 2.0), source="about two stops to either side")
    gamma: float = parameter("", 0.3, 3.0, 1.0, probes=(0.45, 0.75, 1.3, 2.2),
        source="a sensor's linear pictures against encoded ones (sRGB): 2.2, or 1/2.2 the other way")  # fmt: skip
    skip = skip_nothing

    def apply(self, signal: Signal, memory: None) -> tuple[Signal, None]:
        """Brighten or darken; the picture is clipped only once it is complete."""
        if self.gamma == 1.0:
            return self.gain * signal, None
        # In double precision: powers in single precision differ from processor to processor
        bright = np.power(signal / 255.0, self.gamma, dtype=np.float64)
        return (255.0 * self.gain * bright).astype(np.float32), None


class NoiseState(NamedTuple):
    """The number of the next picture, and the seed of the noise."""

    next: int
    seed: int


@effect("image_noise", Stage.IMAGE)
class ImageNoise(ShippedEffect):
    """White noise on every pixel and colour, drawn anew for each picture.

    It takes two pictures standing still to tell it from the floor's texture; one will do where the floor is plain.
    """

    deviation: float = parameter("grey levels", 0.0, 40.0, probes=(2.0, 5.0, 10.0, 20.0),
        source="standard deviation, of 255: small sensors 1 to 5 by daylight, 10 to 30 in a dim room")  # fmt: skip

    def begin(self, context: FilterContext) -> NoiseState:
        """No picture drawn yet."""
        return NoiseState(0, context.seed)

    def apply(self, signal: Signal, memory: NoiseState) -> tuple[Signal, NoiseState]:
        """Add each picture's own noise; the same to all members of a batch."""
        channels, end = signal.shape[-1], memory.next + signal.shape[-2]
        generators = (picture_generator(memory.seed, number) for number in range(memory.next, end))
        drawn = np.stack([one.standard_normal(channels, dtype=np.float32) for one in generators])
        return signal + self.deviation * drawn, memory._replace(next=end)

    def skip(self, memory: NoiseState, samples: int) -> NoiseState:
        """Leave the noise of some pictures undrawn."""
        return memory._replace(next=memory.next + samples)


class ShutterWindow(NamedTuple):
    """The newest past pictures, and the weight of each picture in the window, the newest last."""

    pictures: Signal
    weights: Signal


class DelayedPictures(NamedTuple):
    """The newest past pictures, and how old each of their equal parts, from above, is: whole samples and a fraction."""

    pictures: Signal
    whole: Whole
    fraction: Signal


@effect("blur", Stage.IMAGE)
class Blur(ShippedEffect):
    """A picture is the mean of what was before the lens during the last `blur` seconds.

    Between two rendered pictures the scene is taken to change linearly, so the mean is continuous in `blur`.
    Moving edges tell it by their width, which grows with their speed. It makes pictures older by half of itself: a
    latency that is found without it is too long by as much.
    """

    blur: float = parameter("s", 0.0, 0.2, probes=(0.0125, 0.025, 0.05, 0.1), source="box of the paper 0 to 0.10 s")

    def begin(self, context: FilterContext) -> ShutterWindow:
        """Begin as if the robot had stood before the first picture for ever."""
        weights = _window(self.blur * context.rate_hz)
        return ShutterWindow(_still(context, weights.size - 1), weights)

    def apply(self, signal: Signal, memory: ShutterWindow) -> tuple[Signal, ShutterWindow]:
        """Average over the window that ends with each picture."""
        length, past = signal.shape[-2], memory.weights.size - 1
        joined = np.concatenate((memory.pictures, signal), axis=-2)
        band = np.zeros((length, length + past), dtype=np.float32)
        for row in range(length):
            band[row, row : row + past + 1] = memory.weights
        return band @ joined, memory._replace(pictures=joined[..., length:, :])

    def mean_weights(self, rate_hz: float) -> Signal:
        """Weights of the last pictures in the newest mean, the newest last: exact for pictures of 8 bits."""
        weights = _window(self.blur * rate_hz)
        return weights[int(np.argmax(weights > 0.0)) :]


class Delaying(ShippedEffect):
    """Shows equal parts of the pictures, from above, each as old as it is."""

    def apply(self, signal: Signal, memory: DelayedPictures) -> tuple[Signal, DelayedPictures]:
        """Mix, for each part, the two pictures that its age falls between."""
        length, past, parts = signal.shape[-2], memory.pictures.shape[-2], memory.whole.size
        joined = np.concatenate((memory.pictures, signal), axis=-2)
        split = joined.reshape(*joined.shape[:-1], parts, -1)
        newer, part = np.arange(past, past + length)[:, None] - memory.whole, np.arange(parts)
        older = memory.fraction[:, None]
        mixed = (1.0 - older) * split[..., newer, part, :] + older * split[..., newer - 1, part, :]
        return mixed.reshape(signal.shape), memory._replace(pictures=joined[..., length:, :])


@effect("rolling_shutter", Stage.IMAGE)
class RollingShutter(Delaying):
    """Rows are read out one after another: the last is on time, row r of R older by readout · (1 − (r + ½)/R).

    The picture as a whole is thus older by half the readout, which looks like a latency; bends alone show that the rows
    differ.
    """

    readout: float = parameter("s", 0.0, 0.1, probes=(0.01, 0.02, 0.033, 0.06),
        source="CMOS sensors: up to the time between two frames, 0.033 s at 30 Hz, 0.067 s at 15 Hz")  # fmt: skip

    def begin(self, context: FilterContext) -> DelayedPictures:
        """Begin as if the robot had stood before the first picture for ever."""
        rows = int(context.nominal["camera_rows"])
        return _late(self.readout * context.rate_hz * (1.0 - (np.arange(rows) + 0.5) / rows), context)


@effect("camera_latency", Stage.IMAGE)
class CameraLatency(Delaying):
    """Pictures arrive late by a constant time; between two of them, their linear mix.

    Pictures at known places tell it where speeds and turns vary. What is found without blur in the model is the latency
    and half the blur.
    """

    camera_latency: float = parameter("s", 0.0, 0.5, probes=(0.03, 0.06, 0.1, 0.2),
        source="USB cameras 0.03 to 0.1 s; over a wireless link some tenths of a second")  # fmt: skip

    def begin(self, context: FilterContext) -> DelayedPictures:
        """Begin as if the robot had stood before the first picture for ever."""
        return _late(np.array([self.camera_latency * context.rate_hz]), context)


def _still(context: FilterContext, count: int) -> Signal:
    """So many pictures of what was there before time zero."""
    rest = np.asarray(context.rest, dtype=np.float32)[..., None, :]
    return np.repeat(rest, count, axis=-2)


def _late(samples: Signal, context: FilterContext) -> DelayedPictures:
    """The memory before the first picture of parts that are so many samples old."""
    whole = np.floor(samples + 1e-9).astype(np.int64)
    fraction = np.maximum(0.0, samples - whole).astype(np.float32)
    return DelayedPictures(_still(context, int(whole.max()) + 1), whole, fraction)


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
