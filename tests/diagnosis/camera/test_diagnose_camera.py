"""Verdicts on planted cameras, from a log's files to the last line."""

import functools
import sys
import tempfile
from collections import defaultdict
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.ndimage import map_coordinates

sys.path.append(str(Path(__file__).parent))
from pictured import PICTURES, ROBOT, lane_poses, pictures, write_pictures, write_still_frames
from viewed import NEUTRAL, driven, tracked

from proxytune.diagnosis.camera.conclusion import _verdict
from proxytune.diagnosis.camera.diagnose import camera_effects, declared_camera_effects, diagnose_camera
from proxytune.diagnosis.camera.model.drawing import draw_pictures
from proxytune.diagnosis.camera.model.projection import neutral_state
from proxytune.driving.robot import robot_from_geometry
from proxytune.errors import LogError, SettingsError
from proxytune.logs import Frames, Log, LogEpisode, read_log

COUNT, COLUMNS = 30, 96
DECLARED = ("camera_pitch", "blur")
ROLLED = {"camera_roll": 4.0}
SCATTER = (0.002, np.radians(0.3))
STEPS = defaultdict(list)
"""The lines that each diagnosis reported."""


@functools.cache
def folder():
    return tempfile.TemporaryDirectory()


def write(name, shown, rectified=False):
    """A log of frames standing still, whose poses scatter as it states."""
    home = Path(folder().name) / name
    write_still_frames(home, {}, tracked(lane_poses(COUNT), scatter=SCATTER), columns=32)
    for path in (home / "frames").iterdir():
        path.unlink()
    (home / "frames").rmdir()
    write_pictures(home, shown)
    if rectified:
        with (home / "log.toml").open("a") as file:
            file.write("rectified = true\n")
    return read_log(home)


@functools.cache
def shown(theta=()):
    return pictures(dict(theta), lane_poses(COUNT), COLUMNS)


@functools.cache
def diagnosed(name):
    return diagnose_camera(LOGS[name](), ROBOT, DECLARED, report=lambda line: STEPS[name].append(line))


@functools.cache
def nominal():
    return write("nominal", shown())


def waved():
    """What a lens shows that bends as none of the catalogue does."""
    down, right = np.mgrid[:72, :96].astype(float)
    at = (down + 1.5 * np.sin(right / 12.0), right)
    colours = [[map_coordinates(one[..., c], at, order=1, mode="nearest") for c in range(3)] for one in shown()]
    return np.moveaxis(np.array(colours), 1, -1)


LOGS = {
    "nominal": nominal,
    "rolled": lambda: write("rolled", shown(tuple(ROLLED.items()))),
    "waved": lambda: write("waved", waved()),
    "rectified": lambda: write("rectified", shown((("lens_distortion", -0.25),)), rectified=True),
    "bent": lambda: write("bent", shown((("lens_distortion", -0.25),))),
}


def test_nothing_is_missing_of_a_nominal_camera():
    found = diagnosed("nominal")
    assert (found.verdict, found.effects) == ("nothing missing", ())
    low, high = found.declared["camera_pitch"].interval
    assert low < 19.15 < high
    assert set(found.declared) == set(found.theta) == {"camera_pitch"}
    assert found.matched > 0.9
    assert found.notes == ()


def test_a_rolled_camera_is_explained_by_its_roll():
    found = diagnosed("rolled")
    (effect,) = found.effects
    assert (found.verdict, effect.effect, effect.names) == ("explained", "camera_roll", ("camera_roll",))
    assert found.theta["camera_roll"].interval[0] < 4.0 < found.theta["camera_roll"].interval[1]
    assert effect.nats > 6.0
    assert effect.error_without > 1.5
    assert found.pixels.after.value < 0.6 * found.pixels.before.value
    assert [gate.open for gate in found.gates] == [True, False]
    assert found.candidates[0].effects == ("camera_roll",)


@pytest.mark.slow
def test_a_lens_that_the_catalogue_does_not_have_is_not_explained():
    found = diagnosed("waved")
    assert found.verdict in ("partly explained", "unexplained")
    assert found.gates[1].open
    assert (found.verdict == "partly explained") == bool(found.effects)


@pytest.mark.parametrize(
    ("left_over", "blemishes", "named", "verdict"),
    [
        (False, (), False, "nothing missing"),
        (False, (), True, "explained"),
        (True, (), True, "partly explained"),
        (True, (), False, "unexplained"),
        (False, ("dirt",), False, "unexplained"),
        (False, ("dirt",), True, "partly explained"),
    ],
)
def test_what_is_left_over_and_what_covers_the_picture_make_the_verdict(left_over, blemishes, named, verdict):
    assert _verdict(SimpleNamespace(open=left_over), SimpleNamespace(blemishes=blemishes), named=named) == verdict


@pytest.mark.slow
def test_frames_whose_distortion_was_taken_out_never_name_it():
    bent, rectified = diagnosed("bent"), diagnosed("rectified")
    assert [effect.effect for effect in bent.effects] == ["lens_distortion"]
    assert "lens_distortion" not in rectified.named.full.names
    assert "lens_distortion" not in {effect.effect for effect in rectified.effects}
    assert "lens_distortion" not in {effect for one in rectified.candidates for effect in one.effects}


def test_frames_standing_still_say_what_they_hide_and_what_to_take():
    found = diagnosed("nominal")
    assert {"camera_latency", "rolling_shutter"} <= set(found.could_not_be_seen)
    assert any("driving bends" in view for view in found.next_views)


def drive_log(home, readout_s=None):
    """A drive by a camera whose rows take 0.06 s to read."""
    count = 30
    views = driven({"rolling_shutter": 0.06}, count)
    tracks = views.tracks
    home.mkdir()
    write_pictures(home, _shown_on(count))
    drive = LogEpisode("drive", tracks.times, np.zeros((len(tracks.times), 2)), tracks.poses, None)
    paths = tuple(home / (PICTURES % number) for number in range(count))
    frames = Frames(paths, np.zeros(count, dtype=int), tracks.instants, "small_loop", 0.002, 0.3, readout_s=readout_s)
    return Log("drive", "duckiebot", "duty", 20.0, {}, (drive,), replace(frames, fixed_exposure=True))


@functools.cache
def _shown_on(count):
    views = driven({"rolling_shutter": 0.06}, count)
    state = neutral_state(views, {**NEUTRAL, "rolling_shutter": 0.06})
    return np.rint(draw_pictures(views, state, {}, np.arange(count))).astype(np.uint8)


@pytest.mark.slow
def test_a_stated_readout_is_used_and_not_named(tmp_path):
    stated, open_ = (
        diagnose_camera(drive_log(tmp_path / name, readout), ROBOT, DECLARED)
        for name, readout in (("stated", 0.06), ("open", None))
    )
    assert stated.named.full.theta["rolling_shutter"] == stated.named.model.theta["rolling_shutter"] == 0.06
    assert "rolling_shutter" not in stated.named.full.names
    assert "rolling_shutter" not in {effect.effect for effect in stated.effects}
    assert "rolling_shutter" not in stated.could_not_be_seen
    assert "rolling_shutter" in open_.named.full.names


def test_steps_are_reported_as_they_begin():
    diagnosed("nominal")
    assert STEPS["nominal"] == [
        "reading frames",
        "fitting the camera",
        "looking for what the camera lacks",
        "testing on frames kept aside",
        "looking at brightness and sharpness",
    ]


def test_a_log_without_frames_is_refused_in_one_line():
    log = replace(nominal(), frames=None)
    with pytest.raises(LogError, match=r"^pictured: has no frames; add \[camera\] to log.toml$"):
        diagnose_camera(log, ROBOT, DECLARED)


def test_a_robot_without_a_camera_is_refused():
    geometry = {"wheel_radius": 0.03, "effective_baseline": 0.16, "full_speed": 0.6}
    with pytest.raises(SettingsError, match="camera"):
        diagnose_camera(nominal(), robot_from_geometry("cart", geometry, 20.0), DECLARED)


def test_effects_of_the_camera_are_those_on_camera_and_pictures():
    effects = camera_effects(ROBOT.catalogue)
    assert {"camera_pitch", "blur", "exposure", "camera_latency"} <= set(effects)
    assert not {"trim", "delay", "yaw_scrub"} & set(effects)
    assert set(declared_camera_effects(ROBOT)) == {"camera_pitch", "blur"}
