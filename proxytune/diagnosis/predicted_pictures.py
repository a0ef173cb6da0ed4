"""What a model's camera would have seen on a log's drives, and how far that is from what was seen."""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from proxytune.diagnosis.camera.diagnose import camera_effects
from proxytune.diagnosis.camera.error.comparing import grey_differences
from proxytune.diagnosis.camera.gathering import read_road
from proxytune.diagnosis.camera.measured.edges import Edges
from proxytune.diagnosis.camera.measured.tracks import track_frames
from proxytune.diagnosis.camera.model.drawing import draw_pictures
from proxytune.diagnosis.camera.model.optics import Optics
from proxytune.diagnosis.camera.model.projection import neutral_state
from proxytune.diagnosis.camera.model.views import Views
from proxytune.driving.cameras import ground_points
from proxytune.driving.road.markings import Markings
from proxytune.driving.robot import Robot
from proxytune.effects import effect_of
from proxytune.errors import LogError
from proxytune.logs import Frames, Log
from proxytune.logs.pictures import read_pictures
from proxytune.space import Theta

AT_ONCE = 60
"""Pictures that are drawn together."""


class PredictedPictures(NamedTuple):
    """Some of a log's frames as a model would have seen them.

    Attributes:
        numbers: Which of the log's frames (n,).
        pictures: Red, green and blue (n, rows, columns, 3), 0 to 255.
        grey_errors: Mean absolute difference from the log's pictures on the floor (n,) [grey levels].
    """

    numbers: NDArray[np.intp]
    pictures: NDArray[np.uint8]
    grey_errors: NDArray[np.float64]


def predict_pictures(log: Log, robot: Robot, theta: Theta) -> Iterator[PredictedPictures]:
    """Draw every frame whose pose is known, a few at a time.

    Where the log's exposure is automatic, each frame is compared at its own brightness, which no model knows.

    Args:
        log: With frames.
        robot: Whose camera it is.
        theta: The model; parameters of the camera that it does not name are the robot's.

    Raises:
        LogError: If the log has no frames, or no frame has a pose; while drawing, if a picture cannot be read.
        SettingsError: If the robot has no camera, or the map cannot be read.
    """
    frames = frames_of(log)
    robot.camera_figures()
    sight = set(camera_effects(robot.catalogue))
    own = {name: value for name, value in {**robot.theta, **theta}.items() if effect_of(name) in sight}
    views, numbers = _views(log, frames, robot)
    return _draw(frames, views, numbers, own)


def frames_of(log: Log) -> Frames:
    """The log's frames.

    Raises:
        LogError: If it has none.
    """
    if log.frames is None:
        raise LogError(f"{log.name}: has no frames to predict; add [camera] to log.toml, or leave --frames out")
    return log.frames


def _views(log: Log, frames: Frames, robot: Robot) -> tuple[Views, NDArray[np.intp]]:
    """Where the robot was at each frame, and which of the log's frames these are."""
    tracks, numbers = track_frames(log, frames)
    rows, columns = read_pictures(frames, numbers[:1].tolist()).shape[1:3]
    no_edge, nowhere = np.empty(0, dtype=np.intp), np.empty(0)
    none = Edges(no_edge, no_edge.astype(bool), nowhere, nowhere, np.empty((0, 2)))
    road = read_road(frames.road)
    return Views(none, tracks, Markings(road), Optics(robot, rows, columns), 0.0, 0.0, road.paint.tape_m), numbers


def _draw(frames: Frames, views: Views, numbers: NDArray[np.intp], theta: Theta) -> Iterator[PredictedPictures]:
    optics = views.optics
    state = neutral_state(views, {**{name: optics.neutral(name) for name in optics.mounting}, **theta})
    floor = np.isfinite(ground_points(optics.figures(state.theta))[..., 0])
    on_pictures = {name: value for name, value in theta.items() if name not in optics.mounting}
    for first in range(0, len(numbers), AT_ONCE):
        chosen = np.arange(first, min(first + AT_ONCE, len(numbers)))
        drawn = draw_pictures(views, state, on_pictures, chosen)
        measured = read_pictures(frames, numbers[chosen].tolist()).astype(np.float32)
        apart = grey_differences(measured, drawn, floor, fixed_exposure=frames.fixed_exposure).mean(axis=(1, 2))
        yield PredictedPictures(numbers[chosen], np.rint(drawn).astype(np.uint8), apart.astype(float))
