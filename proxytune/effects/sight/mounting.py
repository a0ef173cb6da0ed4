"""Effects on how the camera is mounted: each sets one of the camera's figures."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from proxytune.effects.effect import CHANNELS, Setting, Signal, Stage
from proxytune.effects.trace import Trace
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
        return with_figure(signal, "pitch_deg", self.camera_pitch), None


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
        return with_figure(signal, "roll_deg", self.camera_roll), None


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
        return with_figure(signal, "yaw_deg", self.camera_yaw), None


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
        Parameter(
            name="camera_forward",
            unit="m",
            low=-0.1,
            high=0.2,
            neutral="camera_forward",
            probes=(0.0, 0.03, 0.1, 0.15),
            source="gym-duckietown: 0.066 m; bounds take in lenses behind the axle and on long noses",
        ),
    )
    trace: ClassVar[Trace | None] = None

    def begin(self, setting: Setting) -> None:
        """Nothing to remember."""

    def apply(self, signal: Signal, memory: None) -> tuple[Signal, None]:
        """Set how far the lens is ahead of the axle [m]."""
        return with_figure(signal, "forward_m", self.camera_forward), None
