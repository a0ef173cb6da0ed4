"""What is allowed in a log and probably not meant is told in a sentence; hidden effects and noise draw none."""

import re
from dataclasses import replace

import numpy as np
import pytest
from hidden_cases import CLEAN, IN_FORM, OTHER_FORM, OUTSIDE, make_log

from proxytune.driving import read_robot
from proxytune.logs import log_cautions
from proxytune.settings import figure_cautions

LOG = make_log(CLEAN[0], episodes=3, seconds=40.0)


def cautions(log):
    return log_cautions(log, read_robot("duckiebot").figures)


def changed(change):
    return replace(LOG, episodes=tuple(change(episode) for episode in LOG.episodes))


def moved(*signs):
    return changed(lambda episode: replace(episode, poses=episode.poses * signs))


def exchanged(episode):
    return replace(episode, poses=episode.poses[:, [1, 0, 2]])


def commanded(factor):
    return changed(lambda episode: replace(episode, commands=factor * episode.commands))


def named(*names):
    pairs = zip(LOG.episodes, names, strict=False)
    return replace(LOG, episodes=tuple(replace(episode, name=name) for episode, name in pairs))


def lost(episode):
    """The tracker keeps what it saw last, from half of the drive on."""
    half = len(episode.poses) // 2
    return replace(episode, poses=np.concatenate((episode.poses[:half], np.tile(episode.poses[half], (half, 1)))))


def elsewhere(episode):
    return replace(episode, poses=episode.poses + (np.arange(len(episode.poses)) > 400)[:, None] * (3.0, 0.0, 0.0))


def in_degrees():
    """Twists whose omega is in degrees a second."""
    twists = [one.commands @ np.array(((0.3, -150.0), (0.3, 150.0))) for one in LOG.episodes]
    pairs = zip(LOG.episodes, twists, strict=True)
    return replace(LOG, command="twist", episodes=tuple(replace(one, commands=own) for one, own in pairs))


THRICE = replace(LOG, episodes=tuple(replace(LOG.episodes[0], name=name) for name in ("00", "again", "third")))
CASES = {
    "headings along y": (
        changed(lambda episode: replace(episode, poses=episode.poses + (0.0, 0.0, np.pi / 2))),
        "moves at (89|90)° to where its headings point",
    ),
    "headings to the rear": (
        changed(lambda episode: replace(episode, poses=episode.poses + (0.0, 0.0, np.pi))),
        "drives backwards where its commands say forwards",
    ),
    "a frozen tracker": (changed(lost), r"drive '00' keeps one pose to the last digit for 2\d s, from \d+ s on"),
    "a jump": (changed(elsewhere), r"drive '00' jumps by 3(\.\d)? m after (19|20)"),
    "no commands": (commanded(0.0), "every command is zero"),
    "omega in degrees": (in_degrees(), r"turns 0\.0\d+ times as fast as its commands say: check the unit of omega"),
    "y reversed": (moved(1, -1, 1), "places are mirrored against headings"),
    "x and y exchanged": (changed(exchanged), "places are mirrored against headings"),
    "a left-handed frame": (moved(1, -1, -1), "turns the other way than its commands say"),
    "duties at half scale": (commanded(0.5), r"drives (1.9|2|2.1) times as fast as its largest commands say: ch"),
    "a figure that its robot has otherwise": (
        replace(LOG, geometry={"full_speed": 1.5, "wheel_radius": 0.0318}),
        r"log.toml states full_speed_m_s = 1.5, which is not used: its robot's own 0.6 counts; leave it out, or put",
    ),
    "drives given three times": (THRICE, r"drive 'again' is a copy of '00' to the last digit \(and 1 more"),
    "an é in two forms": (named("\u00e9", "e\u0301"), "read the same and are taken for different ones"),
}


@pytest.mark.parametrize(("log", "expected"), CASES.values(), ids=CASES)
def test_what_is_probably_not_meant_is_told_in_one_sentence(log, expected):
    (line,) = cautions(log)
    assert re.search(expected, line)


@pytest.mark.parametrize("mirror", [False, True])
def test_a_mirror_is_told_of_a_drive_that_hardly_turns(mirror):
    """Most of its way leads straight ahead, and there a mirror image looks the same."""
    times = np.arange(0.0, 20.0, 0.05)
    heading = np.clip(times - 14.0, 0.0, np.pi / 3.0)
    step = 0.3 * 0.05 * np.stack((np.cos(heading), np.sin(heading)), axis=1)
    places = np.cumsum(step, axis=0) * ((1.0, -1.0) if mirror else (1.0, 1.0))
    poses = np.column_stack((places, heading))
    duties = np.full((len(times), 2), 0.5)
    log = replace(LOG, episodes=(replace(LOG.episodes[0], times=times, poses=poses, commands=duties),))
    assert any("mirrored against headings" in line for line in cautions(log)) is mirror


CALM = [CLEAN[0], *IN_FORM[::10], *OTHER_FORM[::7], *OUTSIDE[::3]]


@pytest.mark.parametrize("case", CALM, ids=lambda case: case.name)
def test_what_a_diagnosis_is_for_draws_no_caution(case):
    assert cautions(make_log(case, episodes=3, seconds=40.0)) == ()


def test_thin_wheels_are_told_and_nothing_without_poses_or_figures():
    (line,) = figure_cautions({"wheel_radius": 3e-5, "full_speed": 0.6}, "robot mine")
    assert line.startswith("robot mine: its wheel_radius is 3e-05 m, and robots have 0.002 to 1.5 m")
    (line,) = log_cautions(replace(LOG, geometry={"wheel_radius": 31.8}), {})
    assert "its wheel_radius is 31.8 m, and robots have" in line
    assert cautions(changed(lambda episode: replace(episode, poses=np.full_like(episode.poses, np.nan)))) == ()
    assert log_cautions(commanded(0.5), {}) == ()


def drive_of_car(exchange):
    """A kinematic car whose throttle and steering both change, its two columns exchanged or not."""
    rng = np.random.default_rng(4)
    times = np.arange(0.0, 30.0, 0.05)
    held = np.repeat(rng.uniform((0.2, -0.6), (0.6, 0.6), (30, 2)), 20, axis=0)
    speed, turn = 2.0 * held[:, 0], 2.0 * held[:, 0] * np.tan(0.42 * held[:, 1]) / 0.33
    heading = np.concatenate(([0.0], np.cumsum(0.05 * turn)[:-1]))
    x, y = (np.concatenate(([0.0], np.cumsum(0.05 * speed * of(heading))[:-1])) for of in (np.cos, np.sin))
    commands, poses = held[:, ::-1] if exchange else held, np.column_stack((x, y, heading))
    drive = replace(LOG.episodes[0], times=times, poses=poses, commands=commands)
    return replace(LOG, command="ackermann", episodes=(drive,))


def test_throttle_and_steering_exchanged_are_told_and_rightly_named_ones_are_not():
    figures = read_robot("car").figures
    assert log_cautions(drive_of_car(exchange=False), figures) == ()
    (line,) = log_cautions(drive_of_car(exchange=True), figures)
    assert line.startswith("the robot turns with throttle (correlation 0.9")
    assert line.endswith("are the two exchanged?")
