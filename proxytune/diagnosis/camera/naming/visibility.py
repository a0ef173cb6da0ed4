"""What frames cannot show of a camera, what cannot be told apart, and what to take next."""

from collections.abc import Mapping, Sequence
from types import MappingProxyType

import numpy as np

from proxytune.diagnosis.camera.model.fitting import CameraFit
from proxytune.diagnosis.camera.model.optics import LATENCY, MOVING, READOUT, effects_of
from proxytune.effects import effect_of

ALWAYS: Mapping[str, str] = MappingProxyType(
    {"camera_yaw": "heading_offset", "camera_forward": "marker_offset", LATENCY: "clock offset"}
)
"""Effects of the tracker that frames cannot tell from one of the camera."""


def hidden_effects(full: CameraFit, model: Sequence[str]) -> tuple[str, ...]:
    """Geometric effects that these frames could not have shown at their smallest usual size.

    Args:
        full: The fit with every effect.
        model: Effects of the model, beside which another one would have to show.
    """
    hidden = [] if full.views.tracks.moving else list(MOVING)
    kept = [name for name in full.names if effect_of(name) in model]
    for name in full.names:
        if name not in kept and 2.0 * _sd_beside(full, kept, name) > _smallest(full, name):
            hidden.append(name)
    return effects_of(tuple(hidden))


def _sd_beside(full: CameraFit, kept: Sequence[str], name: str) -> float:
    """Standard deviation of a parameter if it is free beside those kept."""
    chosen = [full.names.index(one) for one in (*kept, name)]
    matrix = full.information[np.ix_(chosen, chosen)]
    return float(np.sqrt(np.linalg.pinv(matrix, rcond=1e-12)[-1, -1])) if matrix[-1, -1] > 0.0 else float("inf")


def _smallest(full: CameraFit, name: str) -> float:
    """How far the nearest probe lies from the neutral value."""
    parameter = full.views.optics.robot.catalogue.parameters[name]
    neutral = full.views.optics.neutral(name)
    return min((abs(probe - neutral) for probe in parameter.probes if probe != neutral), default=parameter.high)


def next_views(hidden: Sequence[str], *, repeated: bool) -> tuple[str, ...]:
    """What to take to see what was hidden.

    Args:
        hidden: Effects that could not be seen.
        repeated: Whether some frames were taken standing still at one place.
    """
    views = []
    if {LATENCY, READOUT, "blur"} & set(hidden):
        views.append("frames while driving bends at 0.3 m/s and more, for what shows in motion alone")
    if {"camera_height", "camera_forward", "field_of_view", "pixel_aspect", "lens_centre"} & set(hidden):
        views.append("frames with markings nearer than 0.4 m and others far ahead, on straights and in bends")
    if {"camera_yaw", "camera_roll"} & set(hidden):
        views.append("frames from both lanes, driven both ways round")
    if "image_noise" in hidden and not repeated:
        views.append("ten frames standing still at one place, for the noise")
    return tuple(views)
