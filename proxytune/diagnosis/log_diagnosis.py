"""Everything that a log says of a robot: its motion where it has commands, its camera where it has frames."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TypeVar

from proxytune.diagnosis.camera.diagnose import camera_effects, declared_camera_effects, diagnose_camera
from proxytune.diagnosis.camera.result import CameraDiagnosis
from proxytune.diagnosis.diagnose import declared_effects, diagnose
from proxytune.diagnosis.naming.candidates import motion_effects
from proxytune.diagnosis.result import Diagnosis
from proxytune.driving.robot import Robot
from proxytune.errors import LogError, SettingsError
from proxytune.logs import Log
from proxytune.settings import nearest

Report = Callable[[str], None]
Part = TypeVar("Part")


@dataclass(frozen=True)
class LogDiagnosis:
    """What a log says of a robot; at least one part is there.

    Attributes:
        log: The log's name.
        robot: The robot.
        motion: What its drives say, or None.
        camera: What its frames say, or None.
        motion_refused: Why its drives say nothing though it has commands and frames, else empty.
        camera_refused: Why its frames say nothing though its drives do, else empty.
    """

    log: str
    robot: Robot
    motion: Diagnosis | None
    camera: CameraDiagnosis | None
    motion_refused: str = ""
    camera_refused: str = ""


def diagnose_log(
    log: Log,
    robot: Robot,
    declared: Sequence[str] | None = None,
    *,
    test: Log | None = None,
    seed: int = 1,
    report: Report = lambda _: None,
) -> LogDiagnosis:
    """Diagnose motion where the log has commands, and the camera where it has frames.

    Args:
        log: The log.
        robot: The robot that drove, whose camera took the frames.
        declared: Effects whose parameters are tuned in any case, of both kinds; the robot's if not given.
        test: Another log to test motion on; without it a part of the drives is kept.
        seed: Of the null distributions and the bootstrap.
        report: Takes a line about each step, as it begins.

    Raises:
        LogError: If neither drives nor frames can bear the question, or a declared effect is unknown.
        SettingsError: If a log of frames alone is of a robot without a camera, or its map cannot be read.
    """
    on_motion, on_camera = _declared_by_kind(log, robot, declared)

    def motion() -> Diagnosis:
        return diagnose(log, robot, on_motion, test=test, seed=seed, report=report)

    def camera() -> CameraDiagnosis:
        return diagnose_camera(log, robot, on_camera, seed=seed, report=report)

    if log.frames is None:
        return LogDiagnosis(log.name, robot, motion(), None)
    if log.command == "none":
        if test is not None:
            raise LogError(
                f"--test: {log.name} has no commands, and frames are tested on some of its own; leave it out"
            )
        return LogDiagnosis(log.name, robot, None, camera())
    (moved, no_motion), (pictured, no_camera) = _or_refusal(motion), _or_refusal(camera)
    if moved is None and pictured is None:
        raise LogError(f"{no_motion}; camera: {no_camera}")
    return LogDiagnosis(log.name, robot, moved, pictured, no_motion, no_camera)


def _or_refusal(part: Callable[[], Part]) -> tuple[Part | None, str]:
    """A part of the diagnosis, or why there is none."""
    try:
        return part(), ""
    except (LogError, SettingsError) as problem:
        return None, str(problem)


def _declared_by_kind(
    log: Log, robot: Robot, declared: Sequence[str] | None
) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Declared effects on motion, and those on the camera and its pictures."""
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
