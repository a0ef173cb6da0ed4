"""What the camera of a blind set is."""

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass

COLUMNS, ROWS = 160, 120
"""Size of the pictures of a set [pixel]."""

PUBLIC = {
    "centre_right": "lens_centre.right",
    "centre_down": "lens_centre.down",
    "gain": "exposure.gain",
    "gamma": "exposure.gamma",
}
"""Parameters whose public name is not that of a field of Sight."""

DECLARED = ("camera_pitch", "blur")
"""What the robot declares itself: a set with another value of these lacks nothing."""


@dataclass(frozen=True)
class Bend:
    """How a lens bends that no catalogue has."""

    form: str  # key of lens.BENDS
    # how far it moves the points of the picture's lower half: all but a twentieth less than this [pixel]
    size_px: float
    turn_rad: float  # phase of the waves, or direction of what has one [rad]


@dataclass(frozen=True)
class Spot:
    """Dirt on the lens: place and radius [pixel], how much it covers, 0 to 1, and its grey level."""

    column: float
    row: float
    radius_px: float
    opacity: float
    grey: float


@dataclass(frozen=True)
class Bumper:
    """A part of the robot in view: its height in the middle [pixel], how much less at the sides, its grey level."""

    rows_px: float
    round_px: float
    grey: float


@dataclass(frozen=True)
class Sight:
    """The camera: nominal unless stated otherwise.

    Angles [deg], lengths [m] and times [s]; k1 for `lens_distortion`; shares of the picture's height for the centre and
    for `defocus` (standard deviation of a Gaussian); `vignetting` is what corners lose; `image_noise` in grey levels.
    """

    camera_pitch: float = 19.15
    camera_roll: float = 0.0
    camera_yaw: float = 0.0
    camera_height: float = 0.108
    field_of_view: float = 75.0
    lens_distortion: float = 0.0
    camera_forward: float = 0.066
    centre_right: float = 0.0
    centre_down: float = 0.0
    pixel_aspect: float = 1.0
    camera_latency: float = 0.0
    blur: float = 0.05
    rolling_shutter: float = 0.0
    defocus: float = 0.0
    vignetting: float = 0.0
    gain: float = 1.0
    gamma: float = 1.0
    image_noise: float = 0.0
    bend: Bend | None = None
    dirt: tuple[Spot, ...] = ()
    bumper: Bumper | None = None

    @property
    def figures(self) -> Mapping[str, float]:
        """Every figure that the catalogue has, by its parameter's public name."""
        return {PUBLIC.get(name, name): value for name, value in vars(self).items() if isinstance(value, float)}

    @property
    def theta(self) -> Mapping[str, float]:
        """The figures that differ from nominal."""
        nominal = Sight().figures
        return {name: value for name, value in self.figures.items() if value != nominal[name]}

    @property
    def outside(self) -> Mapping[str, object]:
        """What no catalogue has."""
        return {name: asdict(self)[name] for name in ("bend", "dirt", "bumper") if getattr(self, name)}

    @property
    def focal_px(self) -> float:
        """Focal length down the picture [pixel]."""
        return ROWS / 2.0 / math.tan(math.radians(self.field_of_view) / 2.0)
