"""Replaying recorded commands through a model: the planar plant over whole batches of drives."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from proxytune.diagnosis.measured.drives import Drives, Floats, Whole, relative
from proxytune.diagnosis.model.walk import walk
from proxytune.driving.drivetrain import Drivetrain, drivetrain
from proxytune.effects import CATALOGUE, PARAMETERS, Chain, Setting, Stage, effects_from, stage_chain
from proxytune.effects.learnt.effect import Learnt
from proxytune.effects.trace import Draws
from proxytune.space import Theta

RANDOM_EFFECTS: Mapping[str, Draws] = {
    name: effect.trace.draws for name, effect in CATALOGUE.items() if effect.trace and effect.trace.draws
}
"""Effects that draw, each of one parameter; to first order they make commands late by their mean lateness."""


def lateness(theta: Theta, rate_hz: float) -> float:
    """How late random effects make commands on average [s], at this many commands per second."""
    drawn = ((draws, theta.get(name, 0.0)) for name, draws in RANDOM_EFFECTS.items())
    return sum((draws.lateness(value, rate_hz).mean_s for draws, value in drawn if value > 0.0), 0.0)


def expected_theta(theta: Theta, rate_hz: float) -> dict[str, float]:
    """θ without random effects, their mean lateness added to the delay."""
    late = lateness(theta, rate_hz)
    calm = {name: value for name, value in theta.items() if name not in RANDOM_EFFECTS}
    if late > 0.0:
        calm["delay"] = min(PARAMETERS["delay"].high, calm.get("delay", 0.0) + late)
    return calm


def paths(drives: Drives, theta: Theta, duties: Floats | None = None) -> Floats:
    """The measured poses that a model expects from the origin (E, T + 1, 3), each episode in one go.

    Args:
        drives: The commands.
        theta: Values of effects besides the robot's nominal ones.
        duties: Other commands instead (E, T, 2).

    Raises:
        SettingsError: If a value is out of its parameter's bounds.
    """
    train, measurement = _model(drives, theta)
    return _walk_and_track(drives, _twists(drives, train, duties), measurement)


def twists_of(drives: Drives, theta: Theta) -> Floats:
    """The motion that a model asks of the plant, tick by tick (E, T, 3): [m/s], [m/s], [rad/s]."""
    return _twists(drives, _model(drives, theta)[0])


def _twists(drives: Drives, train: Drivetrain, duties: Floats | None = None) -> Floats:
    given = drives.duties if duties is None else duties
    return np.asarray(train.apply(given, train.begin(_setting(drives)))[0])


def measured_paths(drives: Drives, theta: Theta, poses: Floats) -> Floats:
    """Poses after each tick (E, T, 3) from the origin on, as a model's tracker sees them (E, T + 1, 3)."""
    walked = np.concatenate((np.zeros((len(poses), 1, 3)), poses), axis=1)
    return _track(drives, walked, _model(drives, theta)[1])


def increments(drives: Drives, theta: Theta) -> Floats:
    """The motion between the measured poses (N, 3): forward, left [m], turn [rad], in the body frame; read only."""
    return drives.replays.get(tuple(theta.items()), lambda: _increments(drives, theta))


def _increments(drives: Drives, theta: Theta) -> Floats:
    made = increments_along(drives, paths(drives, theta))
    made.setflags(write=False)
    return made


def increments_along(drives: Drives, walked: Floats) -> Floats:
    """The increments of paths (E, T + 1, 3) between the measured poses."""
    every = np.arange(len(drives.episode))
    begins, ends = (drives.along(walked, drives.episode, every, end=end) for end in (False, True))
    return relative(begins, ends)


def increments_of_twists(drives: Drives, theta: Theta, twists: Floats) -> Floats:
    """The increments that these twists of every tick (E, T, 3) make, as a model's tracker sees them."""
    return increments_along(drives, _walk_and_track(drives, twists, _model(drives, theta)[1]))


def disturbed_increments(drives: Drives, theta: Theta, extra: Floats) -> Floats:
    """The increments when something adds to the twist of every tick (E, T, 3)."""
    return increments_of_twists(drives, theta, twists_of(drives, theta) + extra)


def window_paths(drives: Drives, theta: Theta, begin: Whole, length: int) -> Floats:
    """Measured poses from windows' beginnings on, each from the origin (W, length + 1, 3).

    A window starts from the measured pose, and from measured wheel speeds where there are any. The commands before it
    count; nothing measured after it does.

    Args:
        drives: The commands.
        theta: Values of effects besides the robot's nominal ones.
        begin: The increments at whose beginnings the windows start (W,).
        length: Ticks to go on for; commands after an episode's end are those at its end.
    """
    train, measurement = _model(drives, theta)
    return _walk_and_track(drives, _window_twists(drives, train, begin, length), measurement)


def window_twists(drives: Drives, theta: Theta, begin: Whole, length: int) -> Floats:
    """The motion that a model asks of the plant in such windows (W, length, 3): [m/s], [m/s], [rad/s]."""
    return _window_twists(drives, _model(drives, theta)[0], begin, length)


def _window_twists(drives: Drives, train: Drivetrain, begin: Whole, length: int) -> Floats:
    whole, wheels = _window_wheels(drives, train, begin, length)
    if not train.motion.effects:
        return train.ideal(wheels)
    asked, driven = train.ideal(whole), replace(_setting(drives), rest=np.zeros((len(whole), 3)))
    before = np.zeros_like(asked)
    before[:, 1:] = train.motion.apply(asked, train.motion.begin(driven))[0][:, :-1]
    ahead = _window_setting(drives, begin, before)
    past = train.motion.begin_amid(ahead, driven, asked, drives.episode[begin], drives.first[begin])
    return np.asarray(train.motion.apply(train.ideal(wheels), past)[0])


def _window_wheels(drives: Drives, train: Drivetrain, begin: Whole, length: int) -> tuple[Floats, Floats]:
    """Wheel speeds in whole drives (E, T, 2), and in windows (W, length, 2), there from measured ones on if any are."""
    setting = _setting(drives)
    memory = train.begin(setting)
    arrived = np.clip(train.command.apply(drives.duties, memory.command)[0], -1.0, 1.0)
    episode, start = drives.episode[begin], drives.first[begin]
    ticks = np.minimum(start[:, None] + np.arange(length), arrived.shape[1] - 1)
    whole = train.actuation.apply(arrived, memory.actuation)[0]
    if drives.wheels is None:
        return whole, whole[episode[:, None], ticks]
    turning = replace(setting, rest=drives.wheels[episode, start])
    return whole, train.actuation.apply(arrived[episode[:, None], ticks], train.actuation.begin(turning))[0]


def window_features(
    drives: Drives, theta: Theta, learnt: Learnt, begin: Whole, length: int
) -> list[tuple[Floats, Floats]]:
    """What each weight of a learnt effect beside a model adds to its motion in such windows, curve by curve.

    Returns:
        Features (W, length, knots) and the twist that one unit of them makes (3,).
    """
    whole = twists_of(drives, theta)
    past = learnt.recall(_window_setting(drives, begin, whole), whole, drives.episode[begin], drives.first[begin])
    return learnt.features(window_twists(drives, theta, begin, length), past)


def tracked_paths(drives: Drives, theta: Theta, twists: Floats) -> Floats:
    """Measured poses, from the origin on, that twists lead to (W, length + 1, 3)."""
    return _walk_and_track(drives, twists, _model(drives, theta)[1])


def _window_setting(drives: Drives, begin: Whole, before: Floats) -> Setting:
    """The setting of motion effects in windows: the motion before each, its place, and the angles of its wheels."""
    episode, start = drives.episode[begin], drives.first[begin]
    return replace(
        _setting(drives),
        rest=before[episode, start],
        headings=drives.poses[begin, 0, 2:],
        places=drives.poses[begin, :1, :2],
        angles=drives.angles[episode, start][:, None],
    )


def wheel_speeds(drives: Drives, theta: Theta) -> Floats:
    """The wheel speeds of a model (E, T, 2), as fractions of full speed."""
    return _wheel_speeds(drives, _model(drives, theta)[0], _setting(drives))


def drawn_wheel_speeds(drives: Drives, theta: Theta, seed: int) -> Floats:
    """The wheel speeds (E, T, 2) with random effects as one seed draws them, instead of as expected."""
    robot = drives.robot
    train = drivetrain(robot, effects_from({**robot.theta, **theta}, robot.figures, robot.catalogue))
    return _wheel_speeds(drives, train, replace(_setting(drives), seed=seed))


def drawn_paths(drives: Drives, theta: Theta, seed: int) -> Floats:
    """The paths (E, T + 1, 3) with random effects as one seed draws them, instead of as expected."""
    robot = drives.robot
    effects = effects_from({**robot.theta, **theta}, robot.figures, robot.catalogue)
    train = drivetrain(robot, effects)
    twists, _ = train.apply(drives.duties, train.begin(replace(_setting(drives), seed=seed)))
    return _walk_and_track(drives, np.asarray(twists), stage_chain(effects, Stage.MEASUREMENT))


def _wheel_speeds(drives: Drives, train: Drivetrain, setting: Setting) -> Floats:
    memory = train.begin(setting)
    arrived, _ = train.command.apply(drives.duties, memory.command)
    return np.asarray(train.actuation.apply(np.clip(arrived, -1.0, 1.0), memory.actuation)[0])


def arrived_commands(drives: Drives, theta: Theta) -> Floats:
    """The commands that reach the motors (E, T, 2)."""
    train, _ = _model(drives, theta)
    return np.asarray(train.command.apply(drives.duties, train.begin(_setting(drives)).command)[0])


def _model(drives: Drives, theta: Theta) -> tuple[Drivetrain, Chain]:
    robot = drives.robot
    effects = effects_from(expected_theta({**robot.theta, **theta}, drives.rate_hz), robot.figures, robot.catalogue)
    return drivetrain(robot, effects), stage_chain(effects, Stage.MEASUREMENT)


def _setting(drives: Drives) -> Setting:
    nominal: Mapping[str, float] = {**drives.robot.figures, "control_rate": drives.rate_hz}
    setting = Setting(drives.tick_hz, drives.rest, nominal)
    return replace(setting, headings=drives.headings, places=drives.places, angles=drives.angles)


def _walk_and_track(drives: Drives, twists: Floats, measurement: Chain) -> Floats:
    return _track(drives, walk(twists, 1.0 / drives.tick_hz), measurement)


def _track(drives: Drives, walked: Floats, measurement: Chain) -> Floats:
    if not measurement.effects:
        return walked
    rest = replace(_setting(drives), rest=walked[:, 0])
    return np.asarray(measurement.apply(walked, measurement.begin(rest))[0])
