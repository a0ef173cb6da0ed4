"""Blind sets are what they say: their camera has the figures of CameraFigures, their lines lie where they should."""

import csv
import json
import tomllib
from dataclasses import asdict, replace

import numpy as np
import pytest
from camera_rates import EXAM, Answer, Rate, accuracy, all_sets, append, coverage, rates, read_answers
from camera_truth import CASES, draw_case, ground, routes, write_set, write_truth
from camera_truth.exposure import exposed, instants
from camera_truth.ground import photographed_floor
from camera_truth.lens import BENDS, rays
from camera_truth.pinhole import Pinhole
from camera_truth.room import sky
from camera_truth.sight import COLUMNS, PUBLIC, ROWS, Bend, Bumper, Sight, Spot
from camera_truth.tape import lay_tape, line_distances, straight_tape
from hypothesis import given, strategies as st

from proxytune.driving import COLOURS, CameraFigures, GroundPlaneCamera, draw_floor, lane_pose, shipped_map
from proxytune.driving.optics import lens_rays
from proxytune.effects import PARAMETERS

SMALL_LOOP = shipped_map("small_loop")
STARTS = np.array(SMALL_LOOP.starts[:2]) * (1.0, 1.0, np.pi / 180.0)
FIGURES = {
    "camera_pitch": "pitch_deg",
    "camera_roll": "roll_deg",
    "camera_yaw": "yaw_deg",
    "camera_height": "height_m",
    "field_of_view": "field_of_view_deg",
    "lens_distortion": "k1",
    "camera_forward": "forward_m",
    "centre_right": "centre_right",
    "centre_down": "centre_down",
    "pixel_aspect": "aspect",
}
OTHERS = (
    {},
    {"camera_roll": 5.0},
    {"camera_yaw": -7.0},
    {"camera_height": 0.13},
    {"field_of_view": 66.0},
    {"lens_distortion": -0.3},
    {"camera_forward": 0.1},
    {"centre_right": 0.1, "centre_down": -0.05},
    {"pixel_aspect": 1.1},
)
PLACES = np.meshgrid(np.arange(COLUMNS) + 0.5, np.arange(ROWS) + 0.5)


@pytest.fixture
def coarse(monkeypatch):
    """Floors that are quick to draw."""
    monkeypatch.setattr(ground, "PIXELS_PER_METRE", 150)


@pytest.fixture
def few_frames(monkeypatch, coarse):
    """One frame for each drive."""
    monkeypatch.setattr(routes, "FRAMES", 4)


def figures(sight):
    """The same camera as the package has it."""
    values = {theirs: getattr(sight, ours) for ours, theirs in FIGURES.items()}
    return CameraFigures(columns=COLUMNS, rows=ROWS, **values)


def pictures(sight, poses, middles=None):
    """What a camera draws of the package's own floor."""
    still = np.ones((1, ROWS))
    middles = poses if middles is None else middles
    with Pinhole(sight, draw_floor(SMALL_LOOP), sky(), moves=middles is not poses) as pinhole:
        pairs = zip(middles, poses, strict=True)
        return np.stack([pinhole.expose(middle, pose[None], still) for middle, pose in pairs])


@given(
    camera_roll=st.floats(-8, 8),
    camera_pitch=st.floats(5, 35),
    camera_yaw=st.floats(-10, 10),
    lens_distortion=st.floats(-0.3, 0.15),
    centre_right=st.floats(-0.15, 0.15),
    centre_down=st.floats(-0.15, 0.15),
    pixel_aspect=st.floats(0.85, 1.15),
    field_of_view=st.floats(60, 90),
)
def test_rays_are_those_of_the_figures_definitions(**figures_):
    sight = Sight(**figures_)
    assert np.allclose(rays(sight, *PLACES), lens_rays(figures(sight), *PLACES) * (1.0, 1.0, -1.0), atol=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize("changed", OTHERS, ids=lambda changed: "+".join(changed) or "nominal")
def test_pictures_are_the_ground_plane_cameras_with_the_same_figures(changed):
    """Mean difference 0.7 to 1.4 grey levels, from the nominal camera's picture 5 to 18."""
    sight = replace(Sight(), **changed)
    drawn = pictures(sight, STARTS)
    theirs = [GroundPlaneCamera(figures(one), draw_floor(SMALL_LOOP)).render(STARTS) for one in (sight, Sight())]
    off, from_nominal = (np.abs(drawn - one).mean() for one in theirs)
    assert off < 1.5
    assert from_nominal > 3.0 * off or not changed


@pytest.mark.slow
def test_what_moves_during_an_exposure_is_seen_from_where_the_robot_was():
    before = STARTS - (0.02, -0.01, 0.05)
    right = pictures(Sight(), before)
    assert np.abs(pictures(Sight(), before, STARTS) - right).mean() < 1.0
    assert np.abs(pictures(Sight(), STARTS) - right).mean() > 3.0


@given(latency=st.floats(0, 0.2), blur=st.floats(0.01, 0.12), readout=st.floats(0, 0.08))
def test_rows_show_the_mean_over_the_blur_about_their_own_instant(latency, blur, readout):
    times, weights = instants(Sight(camera_latency=latency, blur=blur, rolling_shutter=readout), moves=True)
    instant = readout * ((np.arange(ROWS) + 0.5) / ROWS - 0.5) - latency
    assert np.allclose(weights.sum(axis=0), 1.0)
    assert np.allclose(times @ weights, instant, atol=5e-4)
    deviation = np.sqrt(((times[:, None] - instant) ** 2 * weights).sum(axis=0))
    assert np.allclose(deviation, blur / np.sqrt(12.0), atol=4e-3)


def test_a_picture_in_motion_is_what_each_row_sees_at_its_own_time():
    """Mean difference on the floor below 1.5 grey levels; with the opposite sign of either more than twice that."""
    sight = Sight(camera_latency=0.1, rolling_shutter=0.08)
    drive = routes.drives(SMALL_LOOP, np.random.default_rng(3))[0]
    time, rows = drive.frames[4], np.arange(ROWS)
    moments, weights = instants(sight, moves=True)
    with Pinhole(sight, draw_floor(SMALL_LOOP), sky(), moves=True) as pinhole:
        drawn = pinhole.expose(drive.at(time + moments.mean()), drive.at(time + moments), weights)
    camera = GroundPlaneCamera(figures(sight), draw_floor(SMALL_LOOP))
    off = []
    for late, bent in ((-1.0, 1.0), (1.0, 1.0), (-1.0, -1.0)):
        own = late * sight.camera_latency + bent * sight.rolling_shutter * ((rows + 0.5) / ROWS - 0.5)
        during = np.linspace(-0.5, 0.5, 7) * sight.blur
        seen = np.mean([camera.render(drive.at(time + own + part))[rows, rows] for part in during], axis=0)
        off.append(np.abs(drawn - seen)[45:].mean())
    assert off[0] < 1.5
    assert min(off[1:]) > 2.0 * off[0]


@pytest.mark.parametrize("form", BENDS)
def test_a_bend_moves_the_lower_half_as_far_as_it_says(form):
    sight = Sight(camera_pitch=0.0, bend=Bend(form, 3.0, 1.0))
    straight, bent = (rays(one, *PLACES) for one in (replace(sight, bend=None), sight))
    moved = np.linalg.norm(bent[..., 1:] - straight[..., 1:], axis=-1) * sight.focal_px
    assert np.quantile(moved[ROWS // 2 :], 0.95) == pytest.approx(3.0, rel=1e-6)


@pytest.mark.slow
def test_straight_tape_lies_where_the_map_has_it():
    floor = draw_floor(SMALL_LOOP)
    places = floor.origin + (np.arange(len(floor.pixels)) + 0.5) / floor.pixels_per_metre
    white, yellow, _ = line_distances(SMALL_LOOP, straight_tape(SMALL_LOOP), np.stack(np.meshgrid(places, places), -1))
    for distance, colour in ((white, "white"), (yellow, "yellow")):
        painted = (floor.pixels == COLOURS[colour]).all(axis=-1)
        off_edges = np.abs(distance) * floor.pixels_per_metre > 0.51
        assert (painted == (distance < 0.0))[off_edges].all()


def test_laid_tape_lies_beside_its_place_by_its_tolerance():
    rough, fine = (lay_tape(SMALL_LOOP, tape_m, np.random.default_rng(1)) for tape_m in (0.02, 0.005))
    assert np.abs(rough.shift).max() <= 0.02
    assert rough.shift.std() > 0.009
    assert 0.003 < fine.shift.std() < 0.007


@pytest.mark.slow
def test_a_photographed_floor_is_the_map_with_texture(coarse):
    """Paint is where the map has it but for its edges, and no patch of asphalt is one grey."""
    floor = photographed_floor(SMALL_LOOP, 0.0, np.random.default_rng(1))
    places = floor.origin + (np.arange(len(floor.pixels)) + 0.5) / floor.pixels_per_metre
    distances = line_distances(SMALL_LOOP, straight_tape(SMALL_LOOP), np.stack(np.meshgrid(places, places), -1))[:2]
    white, asphalt = distances[0] < -0.01, (distances[1] > 0.02) & (distances[1] < 0.1)
    assert np.median(floor.pixels[white]) > 2.0 * np.median(floor.pixels[asphalt])
    change = np.diff(floor.pixels.astype(int), axis=0)
    assert change[asphalt[1:] & asphalt[:-1]].std() > 0.02 * np.median(floor.pixels[asphalt])


def test_outside_effects_and_light_change_the_picture_where_they_should():
    grey = np.full((ROWS, COLUMNS, 3), 120.0)

    def picture(**changed):
        return exposed(grey, Sight(**changed), 1.0, 0.0, np.random.default_rng(1)).astype(int)[..., 0]

    bumper = picture(bumper=Bumper(rows_px=20.0, round_px=5.0, grey=10.0))
    assert (bumper[:95] == 120).all()
    assert (bumper[105:, 60:100] == 10).all()
    spot = picture(dirt=(Spot(column=80.0, row=60.0, radius_px=10.0, opacity=0.5, grey=20.0),))
    assert (spot[60, 80], spot[60, 100]) == (70, 120)
    dark = picture(vignetting=0.4)
    assert dark[60, 80] == 120
    assert dark[0, 0] == pytest.approx(0.6 * 120, abs=2)
    assert picture(gain=1.2, gamma=1.3)[0, 0] == round(255 * 1.2 * (120 / 255) ** 1.3)
    assert picture(image_noise=8.0).std() == pytest.approx(8.0, rel=0.05)


@pytest.mark.parametrize("name", CASES)
def test_a_case_changes_nothing_but_what_it_names(name):
    for seed in range(5):
        case = draw_case(name, seed)
        changed, outside = set(case.sight.theta), set(case.sight.outside)
        assert {key.split(".")[0] for key in changed} <= set(case.effects)
        assert len(case.effects) == len({key.split(".")[0] for key in changed}) + len(outside)


def test_a_case_that_nobody_knows_is_refused_and_what_others_state_holds():
    case = draw_case("camera_yaw drive horseshoe 20mm_tape 10mm walls fixed", 3)
    assert (case.moves, case.road, case.tape_m, case.scatter) == (True, "horseshoe", 0.02, "10mm")
    assert (case.walls, case.fixed) == (True, True)
    with pytest.raises(ValueError, match="no case 'camera_rol'; effects: camera_pitch"):
        draw_case("camera_rol", 1)
    known = {*PARAMETERS, "camera_forward", "lens_centre.right", "lens_centre.down", "pixel_aspect", "camera_latency"}
    known |= {"rolling_shutter", "defocus", "vignetting", "exposure.gain", "exposure.gamma", "image_noise"}
    assert set(Sight().figures) <= known
    assert set(PUBLIC.values()) <= set(Sight().figures)


@pytest.mark.parametrize("name", ["small_loop", "horseshoe"])
def test_drives_stay_near_their_lane_and_in_their_speeds(name):
    road = shipped_map(name)
    for drive in routes.drives(road, np.random.default_rng(2)):
        rows = drive.rows
        assert np.abs(lane_pose(road, rows[:, :2], rows[:, 2]).deviation).max() < 0.2
        speeds = np.hypot(*np.diff(rows[:, :2], axis=0).T) * routes.ROWS_HZ
        assert (speeds.min() > 0.1, speeds.max() < 0.5) == (True, True)
        assert drive.frames[0] > 0.5
        assert drive.frames[-1] + 0.3 < len(rows) / routes.ROWS_HZ
        assert len(drive.rows) == len(drive.duties)


def rows_of(file):
    with file.open(encoding="utf-8") as lines:
        return list(csv.DictReader(lines))


def test_a_still_set_is_a_log_with_a_row_for_every_frame(few_frames, tmp_path):
    truth = write_set(tmp_path / "set", "camera_roll plain still 10mm", 1)
    settings = tomllib.loads((tmp_path / "set" / "log.toml").read_text())
    assert settings["command"] == "none"
    assert settings["camera"]["poses"] == {"position_m": 0.01, "heading_deg": 2.0}
    assert len(rows_of(tmp_path / "set" / "samples.csv")) == len(list((tmp_path / "set" / "frames").iterdir())) == 4
    assert truth.effects == ("camera_roll",)
    assert 2.0 <= abs(truth.theta["camera_roll"]) <= 6.0


@pytest.mark.slow
def test_a_driven_set_tells_when_its_frames_were_taken_and_one_seed_writes_one_set_and_truth(few_frames, tmp_path):
    write_set(tmp_path / "set", "camera_latency plain", 1)
    frames, samples = (rows_of(tmp_path / "set" / name) for name in ("frames.csv", "samples.csv"))
    assert [int(row["frame"]) for row in frames] == list(range(4))
    assert {row["episode"] for row in frames} == {row["episode"] for row in samples}
    assert {"left", "right", "x", "y", "heading"} <= set(samples[0])
    for name in ("one", "other"):
        write_truth(tmp_path / name / "truth.json", write_set(tmp_path / name, "dirt still small_loop", 4))
    files = [sorted(path for path in (tmp_path / name).rglob("*") if path.is_file()) for name in ("one", "other")]
    same = [a.read_bytes() == b.read_bytes() for a, b in zip(*files, strict=True) if a.name != "log.toml"]
    assert all(same)
    told = json.loads((tmp_path / "one" / "truth.json").read_text())
    assert told["outside"]["dirt"] == [asdict(spot) for spot in draw_case("dirt still small_loop", 4).sight.dirt]


@pytest.mark.slow
def test_worse_tape_comes_with_a_map_that_says_so(few_frames, tmp_path):
    from proxytune.driving import read_map

    write_set(tmp_path, "none still small_loop 20mm_tape", 1)
    assert tomllib.loads((tmp_path / "log.toml").read_text())["map"] == "laid.toml"
    assert read_map(tmp_path / "laid.toml").paint.tape_m == 0.02


def answer(case="camera_roll still", camera=None, problem=""):
    """What was said of a set, as it is kept in a file."""
    drawn = draw_case(case, 1)
    parts = {"effects": drawn.effects, "theta": drawn.sight.theta, "figures": drawn.sight.figures}
    truth = {"case": case, "seed": 1, **parts, "outside": drawn.sight.outside, "scene": {"moves": drawn.moves}}
    return Answer(truth, camera or {}, 1.0, problem)


def said(verdict, *names, declared=None, **parameters):
    """A diagnosis' document of the camera."""
    effects = [{"name": name, "parameters": parameters, "indistinguishable_from": []} for name in names]
    return {"verdict": verdict, "declared": declared or {}, "effects": effects}


def test_sets_are_counted_by_names_alarms_and_flags_and_coverage_is_of_their_own_truth():
    rival = said("explained", "camera_yaw")
    rival["effects"][0]["indistinguishable_from"] = ["camera_roll"]
    answers = [answer(camera=said("explained", name)) for name in ("camera_roll", "camera_yaw")]
    both, flagged = said("explained", "camera_roll", "camera_yaw"), said("partly explained", "camera_height")
    counted = rates([*answers, *(answer(camera=one) for one in (rival, both, flagged))])
    assert str(counted["geometric: named"]) == "3 of 5 (60 %)"
    assert counted["geometric: named, nothing beside"].hits == 2
    assert counted["geometric: named by itself, no rival"].hits == 1
    assert counted["geometric: wrong without a flag"].hits == 2

    quiet = [answer(case, said("nothing missing")) for case in ("none", "camera_pitch", "blur")]
    loud = [answer("none", said("explained", "camera_yaw")), answer("none", said("partly explained"))]
    counted = rates([*quiet, *loud, answer("none", problem="LogError: no frames")])
    assert counted["nothing missing: false alarms"] == Rate(2, 5)
    assert counted["failed"] == Rate(1, 6)

    blemish = {**said("nothing missing"), "blemishes": [{"column": 3}]}
    answers = [answer("dirt", said("explained")), answer("dirt", said("unexplained")), answer("dirt", blemish)]
    counted = rates(answers)
    assert counted["outside: flagged"] == Rate(2, 3)
    assert counted["outside: called explained or nothing missing"] == Rate(1, 3)
    true = draw_case("lens_centre still", 1).sight.figures["lens_centre.right"]
    right = {"lens_centre.right": {"value": true, "interval": [true - 0.01, true + 0.01], "unit": ""}}
    pitch = {"camera_pitch": {"value": 25.0, "interval": [24.0, 26.0], "unit": "deg"}}
    other = {"camera_roll": {"value": 1.0, "interval": [0.5, 1.5], "unit": "deg"}}
    extended = {"extended": {**right, **pitch, **other}}
    counted = coverage([answer("lens_centre still", {**said("explained", "lens_centre"), **extended})])
    assert (counted["lens_centre.right"], counted["camera_pitch"]) == (Rate(1, 1), Rate(0, 1))
    assert counted["all"] == Rate(1, 2)
    true = draw_case("camera_roll still", 1).sight.figures["camera_roll"]
    told = [{"camera_roll": {"value": true + off, "interval": [-9.0, 9.0], "unit": "deg"}} for off in (0.29, 0.31)]
    answers = [answer(camera={**said("explained", "camera_roll"), "extended": one}) for one in told]
    assert accuracy(answers) == {"camera_roll within 0.3": Rate(1, 2)}


def test_answers_are_read_back_and_a_line_that_was_cut_off_is_not(tmp_path):
    file = tmp_path / "answers.jsonl"
    append(file, answer(camera=said("explained", "camera_roll")))
    with file.open("a") as lines:
        lines.write('{"truth": {"case"')
    append(file, answer(problem="failed"))
    read = read_answers(file)
    assert [one.verdict for one in read] == ["explained", "failed"]
    assert read[0].key == ("camera_roll still", 1)


def test_an_examination_has_every_case_and_any_beginning_a_share_of_each_kind():
    sets = all_sets()
    assert {name for name, _ in sets} == set(CASES)
    assert len(set(sets)) == len(sets)
    assert min(seed for _, seed in sets) >= EXAM
    assert {name.count("+") for name, _ in sets[:20]} == {0, 1}
    assert all_sets(["camera_roll horseshoe"]) == [("camera_roll horseshoe", EXAM + number) for number in range(4)]
