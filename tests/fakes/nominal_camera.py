"""The Duckiebot's camera as its makers state it, where it looks from on the small loop, and one that sees nothing."""

import numpy as np

from proxytune.driving import CameraFigures, shipped_map

CAMERA = CameraFigures(
    columns=160,
    rows=120,
    forward_m=0.066,
    pitch_deg=19.15,
    roll_deg=0.0,
    yaw_deg=0.0,
    height_m=0.108,
    field_of_view_deg=75.0,
    k1=0.0,
)


class Dark:
    """A camera that costs nothing: the expert does not look."""

    def render(self, poses):
        return np.zeros((len(poses), 1, 1, 3), dtype=np.uint8)


def loop_poses(count):
    """Poses along both lanes of the small loop, in their directions, curves and straights."""
    angles = np.linspace(0.0, 2 * np.pi, count, endpoint=False)
    outer = np.arange(count) % 2 == 0
    radius, middle = np.where(outer, 0.72, 0.46), shipped_map("small_loop").size[0] / 2
    heading = angles + np.where(outer, np.pi / 2, -np.pi / 2)
    return np.stack((middle + radius * np.cos(angles), middle + radius * np.sin(angles), heading), axis=1)
