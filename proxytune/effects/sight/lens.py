"""Effects on how the lens draws: each sets figures of the camera."""

from dataclasses import dataclass
from typing import ClassVar

from proxytune.effects.effect import Setting, Signal, Stage
from proxytune.effects.sight.mounting import with_figure
from proxytune.effects.trace import Trace
from proxytune.space import Parameter


@dataclass(frozen=True)
class FieldOfView:
    """The lens sees a wider or narrower angle than nominal."""

    field_of_view: float
    name: ClassVar[str] = "field_of_view"
    stage: ClassVar[Stage] = Stage.CAMERA
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter(
            name="field_of_view",
            unit="deg",
            low=50.0,
            high=100.0,
            neutral="field_of_view",
            probes=(65.0, 70.0, 80.0, 90.0),
            source="lenses on the market",
        ),
    )
    trace: ClassVar[Trace | None] = None

    def begin(self, setting: Setting) -> None:
        """Nothing to remember."""

    def apply(self, signal: Signal, memory: None) -> tuple[Signal, None]:
        """Set the vertical field of view [deg]."""
        return with_figure(signal, "field_of_view_deg", self.field_of_view), None


@dataclass(frozen=True)
class LensDistortion:
    """The lens bends straight lines: the radial coefficient k1 of the plumb-bob model."""

    k1: float
    name: ClassVar[str] = "lens_distortion"
    stage: ClassVar[Stage] = Stage.CAMERA
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter(
            name="k1",
            unit="",
            low=-0.4,
            high=0.2,
            neutral=0.0,
            probes=(-0.3, -0.2, -0.1, 0.1),
            source="Duckiebot calibrations: k1 about −0.27",
        ),
    )
    trace: ClassVar[Trace | None] = None

    def begin(self, setting: Setting) -> None:
        """Nothing to remember."""

    def apply(self, signal: Signal, memory: None) -> tuple[Signal, None]:
        """Set k1."""
        return with_figure(signal, "k1", self.k1), None


@dataclass(frozen=True)
class LensCentre:
    """The lens' axis does not meet the middle of the picture.

    Pictures at known places tell `right` from the camera's yaw and `down` from its pitch only by how the picture is
    stretched towards its edges: both need markings far from the middle.
    """

    right: float
    down: float
    name: ClassVar[str] = "lens_centre"
    stage: ClassVar[Stage] = Stage.CAMERA
    parameters: ClassVar[tuple[Parameter, ...]] = tuple(
        Parameter(
            name=name,
            unit="",
            low=-0.25,
            high=0.25,
            neutral=0.0,
            probes=(-0.1, -0.04, 0.04, 0.1),
            source="calibrations: some hundredths of the picture's height; cropped pictures more",
        )
        for name in ("right", "down")
    )
    trace: ClassVar[Trace | None] = None

    def begin(self, setting: Setting) -> None:
        """Nothing to remember."""

    def apply(self, signal: Signal, memory: None) -> tuple[Signal, None]:
        """Set where the axis meets the picture, from its middle, as shares of the picture's height."""
        return with_figure(with_figure(signal, "centre_right", self.right), "centre_down", self.down), None


@dataclass(frozen=True)
class PixelAspect:
    """Pixels are not square: the horizontal focal length is another than the vertical one."""

    aspect: float
    name: ClassVar[str] = "pixel_aspect"
    stage: ClassVar[Stage] = Stage.CAMERA
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter(
            name="aspect",
            unit="",
            low=0.7,
            high=1.4,
            neutral=1.0,
            probes=(0.8, 0.95, 1.05, 1.25),
            source="sensors: 1 within 0.01; pictures squeezed from 16:9 to 4:3 or stretched back: 0.75 and 1.33",
        ),
    )
    trace: ClassVar[Trace | None] = None

    def begin(self, setting: Setting) -> None:
        """Nothing to remember."""

    def apply(self, signal: Signal, memory: None) -> tuple[Signal, None]:
        """Set how much wider than they are things look."""
        return with_figure(signal, "aspect", self.aspect), None
