"""What an environment renders: the camera's picture beside the map from above, with the robot's way."""

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw

from proxytune.driving.agents import Picture
from proxytune.driving.road.maps import Road
from proxytune.driving.road.texture import draw_floor
from proxytune.effects import Signal

ROWS = 480
"""Height of what is rendered [pixel]."""

WAY, ROBOT = (235, 70, 60), (70, 160, 255)
"""Colours of the robot's way and of the robot."""

ARROW_M = 0.09
"""From the middle of the robot to the tip of what is drawn of it [m]."""


def render(picture: Picture, road: Road, poses: Signal) -> NDArray[np.uint8]:
    """A picture beside the map.

    Args:
        picture: What the camera sees, (rows, columns, 3).
        road: The map.
        poses: The robot's way until now, (ticks, 3): x [m], y [m], heading [rad].

    Returns:
        Red, green, blue, (ROWS, columns, 3); the number of columns is even, as video encoders ask for.
    """
    seen = Image.fromarray(picture)
    seen = seen.resize((_even(ROWS * seen.width / seen.height), ROWS), Image.Resampling.NEAREST)
    above = _map(road)
    _draw_way(ImageDraw.Draw(above), poses, ROWS / road.size[1])
    return np.concatenate((np.asarray(seen), np.asarray(above)), axis=1)


def _map(road: Road) -> Image.Image:
    """The map seen from above, north up."""
    floor = draw_floor(road)
    columns, rows = (
        slice(*(round((end - floor.origin) * floor.pixels_per_metre) for end in (0.0, s))) for s in road.size
    )
    above = Image.fromarray(np.ascontiguousarray(floor.pixels[rows, columns][::-1]))
    return above.resize((_even(ROWS * road.size[0] / road.size[1]), ROWS), Image.Resampling.BOX)


def _draw_way(draw: ImageDraw.ImageDraw, poses: Signal, pixels_per_metre: float) -> None:
    way = poses[:, :2] * (pixels_per_metre, -pixels_per_metre) + (0.0, ROWS)
    draw.line([(float(x), float(y)) for x, y in way], fill=WAY, width=3)
    angles = poses[-1, 2] + np.radians((0.0, 140.0, 220.0))
    corners = way[-1] + ARROW_M * pixels_per_metre * np.stack((np.cos(angles), -np.sin(angles)), axis=-1)
    draw.polygon([(float(x), float(y)) for x, y in corners], fill=ROBOT, outline=(255, 255, 255))


def _even(number: float) -> int:
    return 2 * round(number / 2.0)
