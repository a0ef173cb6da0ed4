"""From the light on the sensor to the file: dirt, defocus, vignetting, exposure, noise."""

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter

from camera_truth.sight import COLUMNS, ROWS, Bumper, Sight, Spot

Values = NDArray[np.float64]

INSTANTS_S = 0.01
"""Instants of an exposure lie at most so far apart [s]."""


def instants(sight: Sight, *, moves: bool) -> tuple[Values, Values]:
    """When the parts of an exposure are, from a frame's time [s], and their weight in each row of the picture.

    Between two instants the scene is taken to change linearly. Row r of R shows the mean over the blur around
    readout · ((r + 0.5)/R − 0.5), less the latency.
    """
    if not moves:
        return np.zeros(1), np.ones((1, ROWS))
    rows = sight.rolling_shutter * ((np.arange(ROWS) + 0.5) / ROWS - 0.5)
    span = sight.rolling_shutter + sight.blur
    count = max(2, int(np.ceil(span / INSTANTS_S)) + 1)
    times = np.linspace(-span / 2.0, span / 2.0, count) if span else np.zeros(1)
    within = np.linspace(-0.5, 0.5, 201)[:, None] * sight.blur + rows
    if len(times) == 1:
        return times - sight.camera_latency, np.ones((1, ROWS))
    weights = np.clip(1.0 - np.abs(within - times[:, None, None]) / (times[1] - times[0]), 0.0, 1.0).mean(axis=1)
    return times - sight.camera_latency, weights / weights.sum(axis=0)


def exposed(scene: Values, sight: Sight, gain: float, noise: float, random: np.random.Generator) -> NDArray[np.uint8]:
    """The picture of a scene (ROWS, COLUMNS, 3), with a frame's own gain and the noise of the sensor [grey levels]."""
    picture = scene
    if sight.bumper is not None:
        picture = _behind(picture, _bumper(sight.bumper), sight.bumper.grey)
    for spot in sight.dirt:
        picture = _behind(picture, _spot(spot), spot.grey)
    if sight.defocus:
        sigma = sight.defocus * ROWS
        picture = gaussian_filter(picture, (sigma, sigma, 0.0), mode="nearest")
    picture = picture * _corners(sight.vignetting)[..., None] * gain
    picture = 255.0 * sight.gain * np.clip(picture / 255.0, 0.0, None) ** sight.gamma
    picture = picture + random.normal(0.0, np.hypot(noise, sight.image_noise), picture.shape)
    return np.rint(np.clip(picture, 0.0, 255.0)).astype(np.uint8)


def _places() -> tuple[Values, Values]:
    columns, rows = np.meshgrid(np.arange(COLUMNS) + 0.5, np.arange(ROWS) + 0.5)
    return columns, rows


def _behind(picture: Values, cover: Values, grey: float) -> Values:
    return picture + cover[..., None] * (grey - picture)


def _spot(spot: Spot) -> Values:
    """How much a spot covers: out of focus, so its edge is a third of it."""
    columns, rows = _places()
    away = np.hypot(columns - spot.column, rows - spot.row) / spot.radius_px
    return spot.opacity * np.clip((1.0 - away) / 0.3 + 0.5, 0.0, 1.0)


def _bumper(bumper: Bumper) -> Values:
    columns, rows = _places()
    edge = ROWS - bumper.rows_px + bumper.round_px * ((columns - COLUMNS / 2.0) / (COLUMNS / 2.0)) ** 2
    return np.clip((rows - edge) / 2.0 + 0.5, 0.0, 1.0)


def _corners(loss: float) -> Values:
    """What is left of the light: less by the square of the distance from the middle, least in the corners."""
    columns, rows = _places()
    square = (columns - COLUMNS / 2.0) ** 2 + (rows - ROWS / 2.0) ** 2
    return 1.0 - loss * square / ((COLUMNS / 2.0) ** 2 + (ROWS / 2.0) ** 2)
