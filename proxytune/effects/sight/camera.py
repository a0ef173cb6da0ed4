"""Effects on how the camera is mounted and how its lens draws: each sets one of the camera's figures."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from proxytune.effects.effect import CHANNELS, Setting, Signal, Stage
from proxytune.effects.trace import Trace
from proxytune.space import Parameter


def _set(signal: Signal, channel: str, value: float) -> Signal:
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
        Parameter(
            name="camera_pitch",
            unit="deg",
            low=0.0,
            high=45.0,
            neutral="camera_pitch",
            probes=(10.0, 15.0, 17.0, 21.0, 24.0, 30.0),
            source="39 camera mounts: 21.9° ± 2.7°; box of the paper 3° to 35°",
        ),
    )
    trace: ClassVar[Trace | None] = None

    def begin(self, setting: Setting) -> None:
        """Nothing to remember."""

    def apply(self, signal: Signal, memory: None) -> tuple[Signal, None]:
        """Set the pitch [deg], downwards positive."""
        return _set(signal, "pitch_deg", self.camera_pitch), None


@dataclass(frozen=True)
class CameraRoll:
    """The camera is mounted tilted to one side."""

    camera_roll: float
    name: ClassVar[str] = "camera_roll"
    stage: ClassVar[Stage] = Stage.CAMERA
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter(
            name="camera_roll",
            unit="deg",
            low=-10.0,
            high=10.0,
            neutral=0.0,
            probes=(-5.0, -2.0, 2.0, 5.0),
            source="a camera mount's play",
        ),
    )
    trace: ClassVar[Trace | None] = None

    def begin(self, setting: Setting) -> None:
        """Nothing to remember."""

    def apply(self, signal: Signal, memory: None) -> tuple[Signal, None]:
        """Set the roll [deg], clockwise in the driver's view positive."""
        return _set(signal, "roll_deg", self.camera_roll), None


@dataclass(frozen=True)
class CameraYaw:
    """The camera looks to one side."""

    camera_yaw: float
    name: ClassVar[str] = "camera_yaw"
    stage: ClassVar[Stage] = Stage.CAMERA
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter(
            name="camera_yaw",
            unit="deg",
            low=-15.0,
            high=15.0,
            neutral=0.0,
            probes=(-8.0, -4.0, 4.0, 8.0),
            source="a camera mount's play",
        ),
    )
    trace: ClassVar[Trace | None] = None

    def begin(self, setting: Setting) -> None:
        """Nothing to remember."""

    def apply(self, signal: Signal, memory: None) -> tuple[Signal, None]:
        """Set the yaw [deg], to the left positive."""
        return _set(signal, "yaw_deg", self.camera_yaw), None


@dataclass(frozen=True)
class CameraHeight:
    """The camera is mounted higher or lower than nominal."""

    camera_height: float
    name: ClassVar[str] = "camera_height"
    stage: ClassVar[Stage] = Stage.CAMERA
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter(
            name="camera_height",
            unit="m",
            low=0.05,
            high=0.20,
            neutral="camera_height",
            probes=(0.08, 0.095, 0.115, 0.13),
            source="39 camera mounts: 0.112 ± 0.008 m",
        ),
    )
    trace: ClassVar[Trace | None] = None

    def begin(self, setting: Setting) -> None:
        """Nothing to remember."""

    def apply(self, signal: Signal, memory: None) -> tuple[Signal, None]:
        """Set the height above the floor [m]."""
        return _set(signal, "height_m", self.camera_height), None


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
        return _set(signal, "field_of_view_deg", self.field_of_view), None


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
        return _set(signal, "k1", self.k1), None
