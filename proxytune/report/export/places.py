"""Where each effect goes in each format; what has no place there is said, never left out silently."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import NamedTuple

FORMATS = ("urdf", "mjcf", "ros")
"""What can be written, as `export --to` calls it."""


class Places(NamedTuple):
    """Where an effect goes, by format; empty where it has no place.

    Attributes:
        urdf: In a URDF.
        mjcf: In a MuJoCo model.
        ros: In ROS parameters.
    """

    urdf: str = ""
    mjcf: str = ""
    ros: str = ""


_MOUNT = Places("joint camera_mount", "camera pos and xyaxes", "static_transform base_link to camera")
_MARKER = Places("link tracked_point", "site tracked_point", "static_transform base_link to tracked_point")
_NOWHERE = Places()

PLACES: Mapping[str, Places] = MappingProxyType(
    {
        "delay_jitter": _NOWHERE,
        "dropped_commands": _NOWHERE,
        "command_quantisation": _NOWHERE,
        "delay": Places(mjcf="actuator delay"),
        "slew_rate": Places(ros="max_acceleration"),
        "driver_map": _NOWHERE,
        "dead_band": _NOWHERE,
        "stiction": _NOWHERE,
        "saturation": Places("joint limit velocity", "actuator ctrlrange", "max_velocity"),
        "trim": Places("wheel radii", "actuator gainprm", "wheel_radius_multiplier, max_velocity"),
        "wheel_gain": Places("wheel radii", "actuator gainprm", "wheel_radius_multiplier, max_velocity"),
        "battery_sag": _NOWHERE,
        "thermal_fade": _NOWHERE,
        "motor_lag": Places(mjcf="actuator dynprm"),
        "backlash": _NOWHERE,
        "wheel_ripple": _NOWHERE,
        "yaw_scrub": Places("wheel distance", "wheel distance", "wheel_separation_multiplier, max_velocity"),
        "understeer": _NOWHERE,
        "yaw_lag": _NOWHERE,
        "turn_slip": _NOWHERE,
        "lateral_slip": _NOWHERE,
        "cross_coupling": _NOWHERE,
        "floor_slope": _NOWHERE,
        "slippery_patch": _NOWHERE,
        "marker_offset": _MARKER,
        "heading_offset": _MARKER,
        "camera_pitch": _MOUNT,
        "camera_roll": _MOUNT,
        "camera_yaw": _MOUNT,
        "camera_height": _MOUNT,
        "camera_forward": _MOUNT,
        "field_of_view": Places(mjcf="camera fovy", ros="camera_info k, p"),
        "lens_distortion": Places(ros="camera_info d"),
        "lens_centre": Places(ros="camera_info k, p"),
        "pixel_aspect": Places(ros="camera_info k, p"),
        "blur": _NOWHERE,
        "rolling_shutter": _NOWHERE,
        "camera_latency": _NOWHERE,
        "defocus": _NOWHERE,
        "vignetting": _NOWHERE,
        "exposure": _NOWHERE,
        "image_noise": _NOWHERE,
    }
)
"""By effect of the catalogue; a user's own effect and what was learnt have no place anywhere."""


def place_of(effect: str, form: str) -> str:
    """Where an effect goes in a format; empty where it has no place."""
    place: str = getattr(PLACES.get(effect, _NOWHERE), form)
    return place
