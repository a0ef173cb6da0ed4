"""What a model would have seen: pictures drawn at a log's poses, with every effect on camera and picture."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from proxytune.diagnosis.camera.model.optics import LATENCY, READOUT
from proxytune.diagnosis.camera.model.projection import State
from proxytune.diagnosis.camera.model.views import Views
from proxytune.driving.ground_plane import GroundPlaneCamera
from proxytune.driving.road.texture import draw_floor
from proxytune.effects import Setting, Stage, effects_from, stage_chain

Pictures = NDArray[np.float32]
Floats = NDArray[np.float64]

BLUR = "blur"
NOISE = "image_noise"
TIMED = (LATENCY, READOUT, BLUR)
"""Effects that say when a picture is taken: they are drawn by moving the camera."""

SHOTS = 9
"""Pictures that the mean over an exposure is taken of; as many instants of a rolling shutter."""


def draw_pictures(views: Views, state: State, theta: Mapping[str, float], frames: NDArray[np.intp]) -> Pictures:
    """Draw what a model would have seen.

    Args:
        views: Where the robot was, and the map.
        state: Camera, and what is added to the tracked poses.
        theta: Values of effects on pictures by name in θ; noise is left out, since no model knows it.
        frames: Which frames (n,).

    Returns:
        Red, green and blue (n, rows, columns, 3), 0 to 255.
    """
    camera = GroundPlaneCamera(views.optics.figures(state.theta), draw_floor(views.markings.road))
    poses, rates = (each[frames] for each in views.tracks.at(state.theta.get(LATENCY, 0.0)))
    poses = poses + state.poses[frames]
    readout, blur = (theta.get(READOUT, state.theta.get(READOUT, 0.0)), theta.get(BLUR, 0.0))
    if not np.any(rates) or readout == 0.0:
        return _develop(views, theta, _exposed(camera, poses, rates, blur))
    instants = (np.arange(SHOTS) / (SHOTS - 1) - 0.5) * readout
    shots = np.stack([_exposed(camera, poses + late * rates, rates, blur) for late in instants])
    return _develop(views, theta, _by_rows(shots))


def _exposed(camera: GroundPlaneCamera, poses: Floats, rates: Floats, blur_s: float) -> Pictures:
    """The mean over an exposure about the poses' instants."""
    if blur_s == 0.0 or not np.any(rates):
        return camera.render(poses).astype(np.float32)
    total = np.zeros((), dtype=np.float32)
    for late in ((np.arange(SHOTS) + 0.5) / SHOTS - 0.5) * blur_s:
        total = total + camera.render(poses + late * rates).astype(np.float32)
    return np.asarray(total / SHOTS, dtype=np.float32)


def _by_rows(shots: Pictures) -> Pictures:
    """Each row from the instant at which it is read out, of shots (SHOTS, n, rows, columns, 3)."""
    rows = shots.shape[2]
    when = (np.arange(rows) + 0.5) / rows * (SHOTS - 1)
    first = np.clip(np.floor(when).astype(int), 0, SHOTS - 2)
    share = (when - first)[:, None, None, None].astype(np.float32)
    row = np.arange(rows)
    mixed = (1.0 - share) * shots[first, :, row] + share * shots[first + 1, :, row]
    return np.asarray(np.moveaxis(mixed, 0, 1))


def _develop(views: Views, theta: Mapping[str, float], pictures: Pictures) -> Pictures:
    """Apply the effects on pictures that have nothing to do with time."""
    robot, optics = views.optics.robot, views.optics
    own = {name: value for name, value in theta.items() if name not in (*TIMED, NOISE)}
    chain = stage_chain(effects_from(own, robot.figures, robot.catalogue), Stage.IMAGE)
    if not chain.effects:
        return pictures
    figures = {**robot.figures, "camera_columns": float(optics.columns), "camera_rows": float(optics.rows)}
    signal = pictures.reshape(len(pictures), 1, -1)
    developed, _ = chain.apply(signal, chain.begin(Setting(60.0, signal[:, 0], figures)))
    return np.clip(developed, 0.0, 255.0).reshape(pictures.shape).astype(np.float32)
