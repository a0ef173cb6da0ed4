"""Effects on how a camera is mounted and on what its lens draws: each sets figures of the camera, for good."""

from typing import ClassVar

import numpy as np

from proxytune.effects.effect import CHANNELS, ShippedEffect, Signal, Stage, effect, like, parameter
from proxytune.space import Parameter


class Mounting(ShippedEffect):
    """Sets one of the camera's figures, a channel of Stage.CAMERA, to each of its parameters, in their order."""

    channels: ClassVar[tuple[str, ...]]

    def apply(self, signal: Signal, memory: None) -> tuple[Signal, None]:
        """The figures (…, time, channels) with its own in place of others."""
        changed = np.array(signal, dtype=float)
        for channel, own in zip(self.channels, self.parameters, strict=True):
            changed[..., CHANNELS[Stage.CAMERA].index(channel)] = getattr(self, own.name)
        return changed, None


@effect("camera_pitch", Stage.CAMERA)
class CameraPitch(Mounting):
    """The camera looks down by another angle than nominal."""

    channels = ("pitch_deg",)  # downwards positive
    camera_pitch: float = parameter("deg", 0.0, 45.0, "camera_pitch", probes=(10.0, 15.0, 17.0, 21.0, 24.0, 30.0),
        source="39 camera mounts: 21.9° ± 2.7°; box of the paper 3° to 35°")  # fmt: skip


@effect("camera_roll", Stage.CAMERA)
class CameraRoll(Mounting):
    """The camera is mounted tilted to one side."""

    channels = ("roll_deg",)  # clockwise in the driver's view positive
    camera_roll: float = parameter("deg", -10.0, 10.0, probes=(-5.0, -2.0, 2.0, 5.0), source="a camera mount's play")


@effect("camera_yaw", Stage.CAMERA)
class CameraYaw(Mounting):
    """The camera looks to one side."""

    channels = ("yaw_deg",)  # to the left positive
    camera_yaw: float = parameter("deg", -15.0, 15.0, probes=(-8.0, -4.0, 4.0, 8.0), source="a camera mount's play")


@effect("camera_height", Stage.CAMERA)
class CameraHeight(Mounting):
    """The camera is mounted higher or lower than nominal."""

    channels = ("height_m",)  # above the floor
    camera_height: float = parameter("m", 0.05, 0.20, "camera_height", probes=(0.08, 0.095, 0.115, 0.13),
        source="39 camera mounts: 0.112 ± 0.008 m")  # fmt: skip


@effect("camera_forward", Stage.CAMERA)
class CameraForward(Mounting):
    """The lens is further ahead of the axle than nominal, or less far.

    Pictures at known places tell it from the field of view and from latency: at a constant speed without turns, a lens
    that lies further back is the same as older pictures.
    """

    channels = ("forward_m",)  # ahead of the axle
    camera_forward: float = parameter("m", -0.1, 0.2, "camera_forward", probes=(0.0, 0.03, 0.1, 0.15),
        source="gym-duckietown: 0.066 m; bounds take in lenses behind the axle and on long noses")  # fmt: skip


@effect("field_of_view", Stage.CAMERA)
class FieldOfView(Mounting):
    """The lens sees a wider or narrower angle than nominal."""

    channels = ("field_of_view_deg",)  # vertical
    field_of_view: float = parameter("deg", 50.0, 100.0, "field_of_view", probes=(65.0, 70.0, 80.0, 90.0),
        source="lenses on the market")  # fmt: skip


@effect("lens_distortion", Stage.CAMERA)
class LensDistortion(Mounting):
    """The lens bends straight lines: the radial coefficient k1 of the plumb-bob model."""

    channels = ("k1",)
    k1: float = parameter("", -0.4, 0.2, probes=(-0.3, -0.2, -0.1, 0.1),
        source="Duckiebot calibrations: k1 about −0.27")  # fmt: skip


CENTRE = Parameter(name="centre", unit="", low=-0.25, high=0.25, neutral=0.0, probes=(-0.1, -0.04, 0.04, 0.1),
                   source="calibrations: some hundredths of the picture's height; cropped pictures more")  # fmt: skip


@effect("lens_centre", Stage.CAMERA)
class LensCentre(Mounting):
    """The lens' axis does not meet the middle of the picture.

    Pictures at known places tell `right` from the camera's yaw and `down` from its pitch only by how the picture is
    stretched towards its edges: both need markings far from the middle.
    """

    channels = ("centre_right", "centre_down")  # from the picture's middle, as shares of its height
    right: float = like(CENTRE)
    down: float = like(CENTRE)


@effect("pixel_aspect", Stage.CAMERA)
class PixelAspect(Mounting):
    """Pixels are not square: the horizontal focal length is another than the vertical one."""

    channels = ("aspect",)  # how much wider than they are things look
    aspect: float = parameter("", 0.7, 1.4, 1.0, probes=(0.8, 0.95, 1.05, 1.25),
        source="sensors: 1 within 0.01; pictures squeezed from 16:9 to 4:3 or stretched back: "
               "0.75 and 1.33")  # fmt: skip
