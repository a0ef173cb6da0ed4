"""The diagnosis of a whole log: of motion where it has commands, of the camera where it has frames.

`diagnose_log` asks the two parts, which know nothing of one another, and joins their answers; where one refuses, its
reason is told. `predict_pictures` draws what a fitted model's camera would have seen on a log's drives.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from proxytune.diagnosis.answer import RULES, Progress, Rules
from proxytune.diagnosis.camera.diagnose import camera_effects, declared_camera_effects, diagnose_camera
from proxytune.diagnosis.camera.edges import Edges, Optics, Views, read_road, track_frames
from proxytune.diagnosis.camera.error import CameraDiagnosis, grey_differences
from proxytune.diagnosis.camera.model import draw_pictures, neutral_state
from proxytune.diagnosis.motion.diagnose import Diagnosis, declared_effects, diagnose
from proxytune.diagnosis.motion.excitation import LIMITS, Limits
from proxytune.diagnosis.motion.screening import motion_effects
from proxytune.driving import Markings, Robot, ground_points, is_robot
from proxytune.effects import Catalogue, effect_of
from proxytune.errors import LogError, SettingsError
from proxytune.logs import Frames, Log, log_cautions, read_pictures
from proxytune.settings import nearest
from proxytune.space import Theta

Part = TypeVar("Part")


@dataclass(frozen=True)
class LogDiagnosis:
    """The diagnosis of a robot from a log; at least one part is there."""

    log: str  # the log's name
    robot: Robot
    motion: Diagnosis | None  # what its drives say, or None
    camera: CameraDiagnosis | None  # what its frames say, or None
    motion_refused: str = ""  # why its drives say nothing though it has commands and frames, else empty
    camera_refused: str = ""  # why its frames say nothing though its drives do, else empty
    cautions: tuple[str, ...] = ()  # what is probably not meant in the log, a sentence each


def diagnose_log(
    log: Log,
    robot: Robot,
    declared: Sequence[str] | None = None,
    *,
    test: Log | None = None,
    seed: int = 1,
    report: Progress = lambda _: None,
    rules: Rules = RULES,
    limits: Limits = LIMITS,
    folder: Path | None = None,
) -> LogDiagnosis:
    """Diagnose motion where the log has commands, and the camera where it has frames.

    Args:
        log: The log.
        robot: The robot that drove, whose camera took the frames.
        declared: Effects whose parameters are tuned in any case, of both kinds; the robot's if not given.
        test: Another log to test motion on; without it a part of the drives is kept.
        seed: Of the null distributions and the bootstrap.
        report: Takes a line about each step, as it begins.
        rules: Thresholds of what is named, believed and told of motion.
        limits: Of the next drive.
        folder: Where the findings go: what is known is kept there on the way, and a diagnosis that was killed goes on
            with it; None: nothing is kept.

    Raises:
        LogError: If neither drives nor frames can bear the question, or a declared effect is unknown.
        SettingsError: If a log of frames alone is of a robot without a camera, or its map cannot be read.
    """
    on_motion, on_camera = _declared_by_kind(log, robot, declared)
    motion = partial(
        diagnose, log, robot, on_motion, test=test, seed=seed, report=report, rules=rules, limits=limits, folder=folder
    )
    camera = partial(diagnose_camera, log, robot, on_camera, seed=seed, report=report, folder=folder)
    cautions = (*_say_other(log, robot), *log_cautions(log, robot.figures), *_say_untried(robot.catalogue))
    if log.frames is None:
        return LogDiagnosis(log.name, robot, motion(), None, cautions=cautions)
    if log.command == "none":
        if test is not None:
            problem = f"--test: {log.name} has no commands, and frames are tested on some of its own"
            raise LogError(f"{problem}; leave it out")
        return LogDiagnosis(log.name, robot, None, camera(), cautions=cautions)
    (moved, no_motion), (pictured, no_camera) = _or_refusal(motion), _or_refusal(camera)
    if moved is None and pictured is None:
        raise LogError(f"{no_motion}; camera: {no_camera}")
    return LogDiagnosis(log.name, robot, moved, pictured, no_motion, no_camera, cautions)


def _say_other(log: Log, robot: Robot) -> Iterator[str]:
    """Say so where the log names another robot that there is."""
    if log.robot != robot.name and is_robot(log.robot, robot.catalogue.folder):
        yield f"log.toml names the robot '{log.robot}', and '{robot.name}', which was given, counts"


def _say_untried(catalogue: Catalogue) -> Iterator[str]:
    """Say which effects of the user's and of plug-ins no log can show."""
    tried = {*catalogue.shipped, *motion_effects(catalogue), *camera_effects(catalogue)}
    for name in catalogue.names:
        if name not in tried:
            yield f"effect '{name}' has no trace, by which a log would show it, so it was not tried; give it one"


def _or_refusal(ask: Callable[[], Part]) -> tuple[Part | None, str]:
    try:
        return ask(), ""
    except (LogError, SettingsError) as problem:
        return None, str(problem)


def _declared_by_kind(
    log: Log, robot: Robot, declared: Sequence[str] | None
) -> tuple[tuple[str, ...], tuple[str, ...]]:
    if declared is None:
        return declared_effects(robot), declared_camera_effects(robot)
    if log.frames is None:
        return tuple(declared), ()
    on_motion, on_camera = motion_effects(robot.catalogue), camera_effects(robot.catalogue)
    for name in declared:
        if name not in (*on_motion, *on_camera):
            hint = nearest(name, (*on_motion, *on_camera))
            raise LogError(f"--declared {name}: no effect on motion, camera or pictures has this name; {hint}")
    return tuple(name for name in declared if name in on_motion), tuple(name for name in declared if name in on_camera)


AT_ONCE = 60
"""Pictures that are drawn together."""


class PredictedPictures(NamedTuple):
    """Some of a log's frames as a model would have seen them."""

    numbers: NDArray[np.intp]  # of these frames (n,)
    pictures: NDArray[np.uint8]  # red, green and blue (n, rows, columns, 3), 0 to 255
    grey_errors: NDArray[np.float64]  # mean absolute differences from the log's, on the floor (n,) [grey levels]


def predict_pictures(log: Log, robot: Robot, theta: Theta) -> Iterator[PredictedPictures]:
    """Draw every frame whose pose is known, a few at a time; what θ does not name is the robot's.

    Where the log's exposure is automatic, each frame is compared at its own brightness, which no model knows.

    Raises:
        LogError: If the log has no frames, or no frame has a pose; while drawing, if a picture cannot be read.
        SettingsError: If the robot has no camera, or the map cannot be read.
    """
    frames = frames_of(log)
    robot.camera_figures()
    sight = set(camera_effects(robot.catalogue))
    own = {name: value for name, value in {**robot.theta, **theta}.items() if effect_of(name) in sight}
    tracks, numbers = track_frames(log, frames)
    rows, columns = read_pictures(frames, numbers[:1].tolist()).shape[1:3]
    no_edge, nowhere = np.empty(0, dtype=np.intp), np.empty(0)
    none = Edges(no_edge, no_edge.astype(bool), nowhere, nowhere, np.empty((0, 2)))
    road = read_road(frames.road)
    views = Views(none, tracks, Markings(road), Optics(robot, rows, columns), 0.0, 0.0, road.paint.tape_m)
    return _draw(frames, views, numbers, own)


def frames_of(log: Log) -> Frames:
    """Give the log's frames; a LogError if it has none."""
    if log.frames is None:
        raise LogError(f"{log.name}: has no frames to predict; add [camera] to log.toml, or leave --frames out")
    return log.frames


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
