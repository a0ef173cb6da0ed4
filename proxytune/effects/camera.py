"""Effects on how a camera is mounted and on what its lens draws: each sets one of the camera's figures, for good."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from proxytune.effects.effect import CHANNELS, Signal, Stage, Trace, remember_nothing
from proxytune.space import Parameter


def with_figure(signal: Signal, channel: str, value: float) -> Signal:
    """A signal of camera figures (…, time, channels) with another value in one of the channels of Stage.CAMERA."""
    changed = np.array(signal, dtype=float)
    changed[..., CHANNELS[Stage.CAMERA].index(channel)] = value
    return changed


@dataclass(frozen=True)
class CameraPitch:
    """The camera looks down by another angle than nominal."""

    camera_pitch: float
    name: ClassVar[str] = "camera_pitch"
    stage: ClassVar[Stage] = Stage.CAMERA
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter(name="camera_pitch", unit="deg", low=0.0, high=45.0, neutral="camera_pitch",
                  probes=(10.0, 15.0, 17.0, 21.0, 24.0, 30.0),
                  source="39 camera mounts: 21.9° ± 2.7°; box of the paper 3° to 35°"),
    )  # fmt: skip
    trace: ClassVar[Trace | None] = None
    begin = remember_nothing

    def apply(self, signal: Signal, memory: None) -> tuple[Signal, None]:
        """Set the pitch [deg], downwards positive."""
        return with_figure(signal, "pitch_deg", self.camera_pitch), None


@dataclass(frozen=True)
class CameraRoll:
    """The camera is mounted tilted to one side."""

    camera_roll: float
    name: ClassVar[str] = "camera_roll"
    stage: ClassVar[Stage] = Stage.CAMERA
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter(name="camera_roll", unit="deg", low=-10.0, high=10.0, neutral=0.0, probes=(-5.0, -2.0, 2.0, 5.0),
                  source="a camera mount's play"),
    )  # fmt: skip
    trace: ClassVar[Trace | None] = None
    begin = remember_nothing

    def apply(self, signal: Signal, memory: None) -> tuple[Signal, None]:
        """Set the roll [deg], clockwise in the driver's view positive."""
        return with_figure(signal, "roll_deg", self.camera_roll), None


@dataclass(frozen=True)
class CameraYaw:
    """The camera looks to one side."""

    camera_yaw: float
    name: ClassVar[str] = "camera_yaw"
    stage: ClassVar[Stage] = Stage.CAMERA
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter(name="camera_yaw", unit="deg", low=-15.0, high=15.0, neutral=0.0, probes=(-8.0, -4.0, 4.0, 8.0),
                  source="a camera mount's play"),
    )  # fmt: skip
    trace: ClassVar[Trace | None] = None
    begin = remember_nothing

    def apply(self, signal: Signal, memory: None) -> tuple[Signal, None]:
        """Set the yaw [deg], to the left positive."""
        return with_figure(signal, "yaw_deg", self.camera_yaw), None


@dataclass(frozen=True)
class CameraHeight:
    """The camera is mounted higher or lower than nominal."""

    camera_height: float
    name: ClassVar[str] = "camera_height"
    stage: ClassVar[Stage] = Stage.CAMERA
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter(name="camera_height", unit="m", low=0.05, high=0.20, neutral="camera_height",
                  probes=(0.08, 0.095, 0.115, 0.13), source="39 camera mounts: 0.112 ± 0.008 m"),
    )  # fmt: skip
    trace: ClassVar[Trace | None] = None
    begin = remember_nothing

    def apply(self, signal: Signal, memory: None) -> tuple[Signal, None]:
        """Set the height above the floor [m]."""
        return with_figure(signal, "height_m", self.camera_height), None


@dataclass(frozen=True)
class CameraForward:
    """The lens is further ahead of the axle than nominal, or less far.

    Pictures at known places tell it from the field of view and from latency: at a constant speed without turns, a lens
    that lies further back is the same as older pictures.
    """

    camera_forward: float
    name: ClassVar[str] = "camera_forward"
    stage: ClassVar[Stage] = Stage.CAMERA
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter(name="camera_forward", unit="m", low=-0.1, high=0.2, neutral="camera_forward",
                  probes=(0.0, 0.03, 0.1, 0.15),
                  source="gym-duckietown: 0.066 m; bounds take in lenses behind the axle and on long noses"),
    )  # fmt: skip
    trace: ClassVar[Trace | None] = None
    begin = remember_nothing

    def apply(self, signal: Signal, memory: None) -> tuple[Signal, None]:
        """Set how far the lens is ahead of the axle [m]."""
        return with_figure(signal, "forward_m", self.camera_forward), None


@dataclass(frozen=True)
class FieldOfView:
    """The lens sees a wider or narrower angle than nominal."""

    field_of_view: float
    name: ClassVar[str] = "field_of_view"
    stage: ClassVar[Stage] = Stage.CAMERA
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter(name="field_of_view", unit="deg", low=50.0, high=100.0, neutral="field_of_view",
                  probes=(65.0, 70.0, 80.0, 90.0), source="lenses on the market"),
    )  # fmt: skip
    trace: ClassVar[Trace | None] = None
    begin = remember_nothing

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
        Parameter(name="k1", unit="", low=-0.4, high=0.2, neutral=0.0, probes=(-0.3, -0.2, -0.1, 0.1),
                  source="Duckiebot calibrations: k1 about −0.27"),
    )  # fmt: skip
    trace: ClassVar[Trace | None] = None
    begin = remember_nothing

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
        Parameter(name=name, unit="", low=-0.25, high=0.25, neutral=0.0, probes=(-0.1, -0.04, 0.04, 0.1),
                  source="calibrations: some hundredths of the picture's height; cropped pictures more")
        for name in ("right", "down")
    )  # fmt: skip
    trace: ClassVar[Trace | None] = None
    begin = remember_nothing

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
        Parameter(name="aspect", unit="", low=0.7, high=1.4, neutral=1.0, probes=(0.8, 0.95, 1.05, 1.25),
                  source="sensors: 1 within 0.01; pictures squeezed from 16:9 to 4:3 or stretched back: 0.75 and 1.33"),
    )  # fmt: skip
    trace: ClassVar[Trace | None] = None
    begin = remember_nothing

    def apply(self, signal: Signal, memory: None) -> tuple[Signal, None]:
        """Set how much wider than they are things look."""
        return with_figure(signal, "aspect", self.aspect), None
