"""Effects of lens and sensor on how bright and how sharp a picture is: each picture by itself."""

import math
from dataclasses import dataclass
from typing import ClassVar, NamedTuple

import numpy as np
from scipy.ndimage import correlate1d
from scipy.special import ive

from proxytune.effects.effect import Setting, Signal, Stage
from proxytune.effects.trace import Trace
from proxytune.seeds import picture_generator
from proxytune.space import Parameter


def _size(setting: Setting) -> tuple[int, int]:
    """Rows and columns of the pictures."""
    return int(setting.nominal["camera_rows"]), int(setting.nominal["camera_columns"])


class Softness(NamedTuple):
    """Rows and columns of the pictures, and how a point spreads along either."""

    rows: int
    columns: int
    weights: Signal


@dataclass(frozen=True)
class Defocus:
    """The lens is out of focus: a point becomes a Gaussian spot, of the same width all over the picture.

    Edges tell it by the width that they have when nothing moves; motion widens them by blur.
    """

    deviation: float
    name: ClassVar[str] = "defocus"
    stage: ClassVar[Stage] = Stage.IMAGE
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter(
            name="deviation",
            unit="",
            low=0.0,
            high=0.05,
            neutral=0.0,
            probes=(0.005, 0.01, 0.02, 0.04),
            source="standard deviation as a share of the picture's height: 1 to 5 pixels of 480 on well-kept cameras",
        ),
    )
    trace: ClassVar[Trace | None] = None

    def begin(self, setting: Setting) -> Softness:
        """The spot's width in pixels of this picture."""
        rows, columns = _size(setting)
        return Softness(rows, columns, _gaussian(self.deviation * rows))

    def apply(self, signal: Signal, memory: Softness) -> tuple[Signal, Softness]:
        """Spread every point; beyond its edges the picture goes on as it ends."""
        soft = signal.reshape(*signal.shape[:-1], memory.rows, memory.columns, 3)
        for axis in (-3, -2):
            soft = correlate1d(soft, memory.weights, axis, output=np.float32, mode="nearest")
        return soft.reshape(signal.shape), memory


def _gaussian(deviation: float) -> Signal:
    """The Gaussian on whole pixels (Lindeberg 1990): it has this standard deviation even if that is part of a pixel."""
    reach = math.ceil(4.0 * deviation) + 2
    weights = ive(np.abs(np.arange(-reach, reach + 1)), deviation**2)
    return np.asarray(weights / weights.sum())


@dataclass(frozen=True)
class Vignetting:
    """The picture is darker towards its corners: by the factor 1 − strength · (r/r_corner)² about its middle.

    The floor tells it without knowledge of the paint, for the same paint is seen near the middle and near the corners.
    """

    strength: float
    name: ClassVar[str] = "vignetting"
    stage: ClassVar[Stage] = Stage.IMAGE
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter(
            name="strength",
            unit="",
            low=0.0,
            high=0.9,
            neutral=0.0,
            probes=(0.1, 0.2, 0.4, 0.7),
            source="the cos⁴ law: 0.5 in corners 33° off the axis, 0.85 in those of a Duckiebot, 52° off",
        ),
    )
    trace: ClassVar[Trace | None] = None

    def begin(self, setting: Setting) -> Signal:
        """The factor of every pixel and colour (channels,)."""
        rows, columns = _size(setting)
        down, right = np.mgrid[:rows, :columns] + 0.5 - np.reshape([rows / 2.0, columns / 2.0], (2, 1, 1))
        share = 4.0 * (down**2 + right**2) / (rows**2 + columns**2)
        return np.repeat(1.0 - self.strength * share, 3).astype(np.float32)

    def apply(self, signal: Signal, memory: Signal) -> tuple[Signal, Signal]:
        """Darken every pixel by its factor."""
        return signal * memory, memory


@dataclass(frozen=True)
class Exposure:
    """Brightness x of 255 becomes 255 · gain · (x/255)^gamma.

    Pictures tell both only relative to the paint that the map declares: a brighter floor is the same as a greater gain.
    What is found makes the proxy's pictures match; it is no statement about the camera.
    """

    gain: float
    gamma: float
    name: ClassVar[str] = "exposure"
    stage: ClassVar[Stage] = Stage.IMAGE
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter(
            name="gain",
            unit="",
            low=0.2,
            high=4.0,
            neutral=1.0,
            probes=(0.5, 0.8, 1.25, 2.0),
            source="about two stops to either side",
        ),
        Parameter(
            name="gamma",
            unit="",
            low=0.3,
            high=3.0,
            neutral=1.0,
            probes=(0.45, 0.75, 1.3, 2.2),
            source="a sensor's linear pictures against encoded ones (sRGB): 2.2, or 1/2.2 the other way",
        ),
    )
    trace: ClassVar[Trace | None] = None

    def begin(self, setting: Setting) -> None:
        """Nothing to remember."""

    def apply(self, signal: Signal, memory: None) -> tuple[Signal, None]:
        """Brighten or darken; the picture is clipped only once it is complete."""
        if self.gamma == 1.0:
            return self.gain * signal, None
        # In double precision: powers in single precision differ from processor to processor
        bright = np.power(signal / 255.0, self.gamma, dtype=np.float64)
        return (255.0 * self.gain * bright).astype(np.float32), None


class Draw(NamedTuple):
    """The number of the next picture, and the seed of the noise."""

    next: int
    seed: int


@dataclass(frozen=True)
class ImageNoise:
    """White noise on every pixel and colour, drawn anew for each picture.

    It takes two pictures standing still to tell it from the floor's texture; one will do where the floor is plain.
    """

    deviation: float
    name: ClassVar[str] = "image_noise"
    stage: ClassVar[Stage] = Stage.IMAGE
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter(
            name="deviation",
            unit="grey levels",
            low=0.0,
            high=40.0,
            neutral=0.0,
            probes=(2.0, 5.0, 10.0, 20.0),
            source="standard deviation, of 255: small sensors 1 to 5 by daylight, 10 to 30 in a dim room",
        ),
    )
    trace: ClassVar[Trace | None] = None

    def begin(self, setting: Setting) -> Draw:
        """No picture drawn yet."""
        return Draw(0, setting.seed)

    def apply(self, signal: Signal, memory: Draw) -> tuple[Signal, Draw]:
        """Add each picture's own noise; the same to all members of a batch."""
        channels, end = signal.shape[-1], memory.next + signal.shape[-2]
        generators = (picture_generator(memory.seed, number) for number in range(memory.next, end))
        drawn = np.stack([one.standard_normal(channels, dtype=np.float32) for one in generators])
        return signal + self.deviation * drawn, memory._replace(next=end)
