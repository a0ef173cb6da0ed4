"""From a log's frames to a verdict on the camera: tuned, tested, named, and the error before and after."""

from collections.abc import Callable, Mapping, Sequence

from proxytune.diagnosis.camera.conclusion import Evidence, conclude
from proxytune.diagnosis.camera.error.weighing import weigh_effects
from proxytune.diagnosis.camera.gathering import Gathered, gather_views
from proxytune.diagnosis.camera.look.appearance import look_at
from proxytune.diagnosis.camera.model.optics import DISTORTION, MOVING, READOUT, effects_of
from proxytune.diagnosis.camera.naming.checks import check_match
from proxytune.diagnosis.camera.naming.search import fit_everything, name_camera_effects
from proxytune.diagnosis.camera.result import CameraDiagnosis
from proxytune.driving.robot import Robot
from proxytune.effects import DECLARED, Catalogue, Stage
from proxytune.errors import LogError
from proxytune.logs import Frames, Log

Report = Callable[[str], None]


def camera_effects(catalogue: Catalogue) -> tuple[str, ...]:
    """The effects on a camera and its pictures."""
    return tuple(name for name in catalogue.names if catalogue.effect(name).stage in (Stage.CAMERA, Stage.IMAGE))


def declared_camera_effects(robot: Robot) -> tuple[str, ...]:
    """The camera's effects that are declared by default: those of θ."""
    return tuple(name for name in DECLARED if name in camera_effects(robot.catalogue))


def diagnose_camera(
    log: Log, robot: Robot, declared: Sequence[str], *, seed: int = 1, report: Report = lambda _: None
) -> CameraDiagnosis:
    """Tune what is declared of a camera, find what is missing, and test both on frames kept aside.

    Args:
        log: With frames.
        robot: Whose camera took them.
        declared: Effects whose parameters are tuned in any case; those on motion are left alone.
        seed: Of the bootstrap.
        report: Takes a line about each step, as it begins.

    Raises:
        LogError: If the frames cannot bear the question: too few markings, or other poses than these.
        SettingsError: If the robot has no camera.
    """
    if log.frames is None:
        raise LogError(f"{log.name}: has no frames; add [camera] to log.toml")
    report("reading frames")
    gathered = gather_views(log, log.frames, robot)
    report("fitting the camera")
    names, fixed = _parameters(gathered, log.frames)
    unknown = log.frames.position_m is None or log.frames.heading_deg is None
    full = fit_everything(gathered.views, names, fixed, learn_scatter=unknown)
    notes = check_match(log.name, full)
    report("looking for what the camera lacks")
    named = name_camera_effects(full, [effect for effect in declared if effect in effects_of(names)])
    report("testing on frames kept aside")
    weighed = weigh_effects(named, seed)
    report("looking at brightness and sharpness")
    look = look_at(gathered, weighed.named.model)
    return conclude(Evidence(gathered, weighed, look, tuple(declared), (*gathered.notes, *notes)), seed)


def _parameters(gathered: Gathered, frames: Frames) -> tuple[tuple[str, ...], Mapping[str, float]]:
    """Parameters of the camera that may differ from neutral, and values that the log states."""
    views = gathered.views
    names = [name for name in views.optics.mounting if not (frames.rectified and name == DISTORTION)]
    fixed = {} if frames.readout_s is None else {READOUT: frames.readout_s}
    names += [name for name in MOVING if views.tracks.moving and name not in fixed]
    return tuple(names), fixed
