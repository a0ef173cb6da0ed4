"""Verdicts on planted cameras, from a log's files to the last line, on frames that another renderer drew."""

import functools
import tempfile
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from camera_rates import confusion, coverage, diagnosed, rates
from pictured import PICTURES, ROAD, ROBOT, lane_poses, pictures, write_pictures, write_still_frames
from planted import look_for_few
from scipy.ndimage import map_coordinates
from viewed import NEUTRAL, at_truth, driven, everything, pushed, stood, tracked

from proxytune.diagnosis import camera_effects, project
from proxytune.diagnosis.answer import verdict
from proxytune.diagnosis.camera.diagnose import declared_camera_effects, describe_map, diagnose_camera, is_explained
from proxytune.diagnosis.camera.edges import GREY
from proxytune.diagnosis.camera.fitting import fit_camera
from proxytune.diagnosis.camera.model import draw_pictures, neutral_state
from proxytune.diagnosis.camera.selection import NEAR, USUAL_MATCHED
from proxytune.driving import LINES
from proxytune.errors import LogError
from proxytune.logs import Frames, Log, LogEpisode, read_log
from proxytune.report.diagnosis import document
from proxytune.report.diagnosis.camera_notes import camera_headline

SETS = (
    ("none drive horseshoe 20mm_tape", 501, 40),
    ("camera_latency", 504, 40),
    ("vignetting", 505, 40),
    ("camera_height+field_of_view", 506, 40),
    ("dirt", 507, 120),
)
"""Sets whose seeds nothing was developed on, of what tests below leave out, with their frames: dirt needs all."""


@pytest.mark.slow
def test_what_a_camera_lacks_is_named_and_what_no_name_explains_is_flagged(capsys, monkeypatch):
    look_for_few(monkeypatch)  # of motion
    answers = []
    for case, seed, frames in SETS:
        monkeypatch.setattr("camera_truth.routes.FRAMES", frames)
        answers.append(diagnosed(case, seed))
    counted = rates(answers)
    held = coverage(answers)
    with capsys.disabled():
        print()
        print("\n".join(f"{name}: {rate}" for name, rate in counted.items()))
        print("\n".join(f"{name}: {rate}" for name, rate in held.items()))
        print(confusion(answers))
    assert counted["failed"].hits == 0
    assert counted["timed: named"].hits == 1
    assert counted["light: named"].hits == 1
    assert counted["pairs: both named"].hits == 1
    assert counted["nothing missing: false alarms"].hits == 0
    assert counted["outside: flagged"].hits == 1
    assert sum(rate.hits for rate in held.values()) >= 0.8 * sum(rate.of for rate in held.values())


COUNT, COLUMNS = 30, 96
DECLARED = ("camera_pitch", "blur")
SCATTER = (0.002, np.radians(0.3))


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
def diagnosed_frames(name):
    return diagnose_camera(LOGS[name](), ROBOT, DECLARED)


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
    "waved": lambda: write("waved", waved()),
    "rectified": lambda: write("rectified", shown((("lens_distortion", -0.25),)), rectified=True),
    "bent": lambda: write("bent", shown((("lens_distortion", -0.25),))),
    "grey": lambda: write("grey", shown().mean(axis=-1, keepdims=True).astype(np.uint8).repeat(3, axis=-1)),
    "squeezed": lambda: write("squeezed", shown((("pixel_aspect", 1.4),))),
}


@pytest.mark.slow
def test_nothing_is_missing_of_a_nominal_camera_and_a_lens_outside_the_catalogue_is_not_explained():
    found = diagnosed_frames("nominal")
    assert (found.verdict, found.effects) == ("nothing missing", ())
    low, high = found.declared["camera_pitch"].interval
    assert low < 19.15 < high
    assert set(found.declared) == set(found.theta) == {"camera_pitch"}
    assert found.matched > 0.9
    assert found.notes == ()
    found = diagnosed_frames("waved")
    assert found.verdict in ("partly explained", "unexplained")
    assert found.residual_fields[1].significant
    assert (found.verdict == "partly explained") == bool(found.effects)


@pytest.mark.parametrize(
    ("left_over", "blemishes", "named", "said"),
    [
        (False, (), False, "nothing missing"),
        (False, (), True, "explained"),
        (True, (), True, "partly explained"),
        (True, (), False, "unexplained"),
        (False, ("dirt",), False, "unexplained"),
        (False, ("dirt",), True, "partly explained"),
    ],
)
def test_what_is_left_over_and_what_covers_the_picture_make_the_verdict(left_over, blemishes, named, said):
    field, look = SimpleNamespace(significant=left_over), SimpleNamespace(blemishes=blemishes)
    assert verdict(is_explained(field, look), named=named) == said


@pytest.mark.slow
def test_frames_whose_distortion_was_taken_out_never_name_it():
    bent, rectified = diagnosed_frames("bent"), diagnosed_frames("rectified")
    assert [effect.effect for effect in bent.effects] == ["lens_distortion"]
    assert "lens_distortion" not in rectified.named.full.names
    assert "lens_distortion" not in {effect.effect for effect in rectified.effects}
    assert "lens_distortion" not in {effect for one in rectified.candidates for effect in one.effects}


def drive_log(home, readout_s=None):
    """A drive by a camera whose rows take 0.06 s to read."""
    count = 30
    views = driven({"rolling_shutter": 0.06}, count)
    tracks, state = views.tracks, neutral_state(views, {**NEUTRAL, "rolling_shutter": 0.06})
    home.mkdir()
    write_pictures(home, np.rint(draw_pictures(views, state, {}, np.arange(count))).astype(np.uint8))
    drive = LogEpisode("drive", tracks.times, np.zeros((len(tracks.times), 2)), tracks.poses, None)
    paths = tuple(home / (PICTURES % number) for number in range(count))
    frames = Frames(paths, np.zeros(count, dtype=int), tracks.instants, "small_loop", 0.002, 0.3, readout_s=readout_s)
    return Log("drive", "duckiebot", "duty", 20.0, {}, (drive,), replace(frames, fixed_exposure=True))


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


def test_effects_are_those_on_camera_and_pictures_and_a_log_needs_frames():
    log = replace(nominal(), frames=None)
    with pytest.raises(LogError, match=r"^pictured: has no frames; add \[camera\] to log.toml$"):
        diagnose_camera(log, ROBOT, DECLARED)
    effects = camera_effects(ROBOT.catalogue)
    assert {"camera_pitch", "blur", "exposure", "camera_latency"} <= set(effects)
    assert not {"trim", "delay", "yaw_scrub"} & set(effects)
    assert set(declared_camera_effects(ROBOT)) == {"camera_pitch", "blur"}


def test_an_effect_at_the_end_of_all_that_is_possible_is_no_explanation_and_no_interval_goes_beyond_it():
    """Things look 1.4 times as wide as they are, which is the most there is; nothing else is left over."""
    found = diagnosed_frames("squeezed")
    assert not found.residual_fields[1].significant
    assert found.at_ends == ("pixel_aspect",)
    assert found.verdict == "partly explained"
    assert found.theta["pixel_aspect"].interval[0] < found.theta["pixel_aspect"].interval[1] == 1.4
    assert [one["at_edge"] for one in document.camera_effects(found)] == [["pixel_aspect"]]
    assert ": pixel_aspect at the end of the range stands for something else, " in camera_headline("log", found)


def test_grey_pictures_whose_edges_match_poorly_say_nothing_of_poses_and_map():
    found = diagnosed_frames("grey")
    assert found.matched < USUAL_MATCHED
    assert found.notes == (GREY,)


STRETCH = 2


def fitted(views):
    return fit_camera(views, at_truth(views), ["camera_pitch"], NEAR)


def moved(line, by_m):
    """Views in which one line of one stretch lies so far to the right, seen driving counter-clockwise."""
    views = replace(stood(noisy=False), tape_m=0.01)
    there = project(views, at_truth(views))
    own = (there.marks.line == LINES.index(line)) & (there.marks.stretch == STRETCH)
    # The edge moves by side · by against the distance's slope; normals point into the marking, so with it
    return pushed(views, np.where(own & there.near, there.marks.side * by_m / there.metres, 0.0))


@pytest.mark.parametrize("line", ["left white line", "right white line", "yellow line"])
@pytest.mark.parametrize("by_m", [0.01, -0.01])
def test_a_line_ten_millimetres_beside_its_place_is_told_first(line, by_m):
    first = describe_map(fitted(moved(line, by_m))).lines[0]
    assert (first.line, first.stretch) == (line, STRETCH)
    assert first.right_m == pytest.approx(by_m, abs=0.0035)
    low, high = first.interval
    assert low < first.right_m < high
    assert low > 0.0 or high < 0.0


@pytest.mark.slow
def test_little_is_told_of_a_map_that_lies_where_it_should():
    laid = describe_map(everything())
    assert all(abs(line.right_m) < 0.004 for line in laid.lines)
    for name, within in (("x_m", 0.004), ("y_m", 0.004), ("heading_deg", 0.5)):
        assert laid.offset[name].value == pytest.approx(0.0, abs=within)


def test_a_whole_map_that_lies_off_and_wider_lines_are_told_the_farthest_line_first():
    """Poses are those of a tracker whose frame has the map 15 mm to the right, 10 mm down and 1° turned."""
    views = stood()
    middle, by, turn = np.array(ROAD.size) / 2.0, np.array((0.015, -0.01)), np.radians(1.0)
    poses = views.tracks.poses
    rotation = np.array(((np.cos(turn), -np.sin(turn)), (np.sin(turn), np.cos(turn))))
    places = (poses[:, :2] - middle) @ rotation.T + middle + by
    off = replace(views, tracks=replace(views.tracks, poses=np.column_stack((places, poses[:, 2] + turn))))
    laid = describe_map(fitted(off))
    assert [laid.offset[name].value for name in ("x_m", "y_m")] == pytest.approx([0.015, -0.01], abs=0.002)
    assert laid.offset["heading_deg"].value == pytest.approx(1.0, abs=0.2)
    for name, truth in (("x_m", 0.015), ("y_m", -0.01), ("heading_deg", 1.0)):
        low, high = laid.offset[name].interval
        assert low < truth < high
    assert [laid.offset[name].unit for name in ("x_m", "y_m", "heading_deg")] == ["m", "m", "deg"]

    views = replace(stood(noisy=False), tape_m=0.005)
    there = project(views, at_truth(views))
    out = np.where(views.edges.white & there.near, -0.002 / there.metres, 0.0)
    before, after = (describe_map(fitted(each)).widths["white lines"].value for each in (views, pushed(views, out)))
    assert after - before == pytest.approx(0.004, abs=0.001)
    fit = everything()
    tape = np.zeros_like(fit.state.tape)
    tape[[0, 1, 2]] = 0.03, -0.06, 0.04
    laid = describe_map(replace(fit, state=replace(fit.state, tape=tape)))
    assert [(line.line, line.right_m) for line in laid.lines] == [
        ("right white line", -0.06),
        ("yellow line", 0.04),
        ("left white line", 0.03),
    ]
