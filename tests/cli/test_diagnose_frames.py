"""`diagnose` takes frames as it takes poses: a camera alone, motion and camera together, and refusals in one line."""

import io
import json
from contextlib import redirect_stderr, redirect_stdout
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest
from pictured import ROLLED, add_frames
from planted import CALM, RATE_HZ, TRUTH, driven_log, write_log

from proxytune.cli.diagnose import shares as shares_of
from proxytune.cli.main import main
from proxytune.effects import read_model
from proxytune.logs import read_log

pytestmark = pytest.mark.usefixtures("few_effects")
KEYS = {
    *("verdict", "declared", "effects", "immaterial", "candidates", "error", "grey_error", "fixed_to_camera"),
    *("blemishes", "could_not_be_seen", "next_views", "map", "matched_share", "frames", "pose_scatter"),
    "notes",
}
MEASURED = Path(__file__).resolve().parents[2] / "../shared/data/logs/gym_duckietown_frames"


class Found(NamedTuple):
    folder: Path
    document: dict
    out: str
    err: str


@pytest.fixture(scope="module")
def found(rolled_frames, tmp_path_factory):
    """The folder and the document of a diagnosis of still frames, what people read, and the steps."""
    folder, out, err = tmp_path_factory.mktemp("found") / "out", io.StringIO(), io.StringIO()
    with redirect_stdout(out), redirect_stderr(err):
        assert main(["diagnose", str(rolled_frames), "--output", str(folder)]) == 0
    return Found(folder, json.loads((folder / "diagnosis.json").read_text()), out.getvalue(), err.getvalue())


def circling_log(theta, *, noise, episodes=6, seconds=12.0, seed=1):
    """Drives in small circles, one way round or the other, so that a camera sees markings all the time."""
    random = np.random.default_rng(seed)
    rows = round(seconds * RATE_HZ)
    steps = random.normal(0.0, 0.06, (episodes, rows // 10 + 1, 2)).repeat(10, axis=1)[:, :rows]
    turn = np.where(np.arange(episodes)[:, None] % 2 == 0, (0.2, 0.34), (0.34, 0.2))
    places = np.array([(0.29, 0.88), (0.88, 0.29), (1.46, 0.88), (0.88, 1.46), (0.29, 0.5), (1.46, 1.2)])
    starts = np.column_stack((places[np.arange(episodes) % len(places)], random.uniform(-np.pi, np.pi, episodes)))
    return driven_log(theta, np.clip(turn[:, None] + steps, 0.0, 1.0), starts, seed=seed, noise=noise)


def short_drives(folder):
    """Drives too short for motion, with frames enough for the camera."""
    log = circling_log(TRUTH, noise=CALM, episodes=2, seconds=6.0)
    return add_frames(write_log(log, folder), log, ROLLED, every=6)


def test_a_roll_that_nobody_declared_is_found_in_still_frames_and_the_document_s_top_is_the_camera_s(found):
    camera = found.document["camera"]
    assert set(camera) >= KEYS
    (effect,) = camera["effects"]
    assert (camera["verdict"], effect["name"]) == ("explained", "camera_roll")
    assert set(effect) == {"name", "parameters", "held_out_gain", "indistinguishable_from", "error_without", "at_edge"}
    low, high = effect["parameters"]["camera_roll"]["interval"]
    assert low < 4.0 < high < 6.0
    assert effect["error_without"] > 2.0
    assert camera["error"]["after"] < 0.4 * camera["error"]["before"]
    assert (camera["error"]["unit"], camera["grey_error"]["unit"]) == ("px", "grey levels")
    assert camera["frames"] == {"used": 30, "of": 30}
    assert camera["pose_scatter"] == pytest.approx({"position_m": 0.002, "heading_deg": 0.3})
    before, after = camera["fixed_to_camera"]["before"], camera["fixed_to_camera"]["after"]
    assert set(before) == {"nats", "share", "rms_px", "open"}
    assert before["rms_px"] > 2.0 * after["rms_px"]
    assert after["open"] is False
    document = found.document
    for key in ("verdict", "declared", "effects", "could_not_be_seen"):
        assert document[key] == document["camera"][key]
    assert (document["log"], document["robot"]) == ("pictured", "duckiebot")
    assert not {"residual_depends_on", "next_manoeuvre", "clocks"} & set(document)
    assert document["motion_refused"] is None


def test_model_toml_and_figures_are_the_camera_s_and_people_read_its_verdict_roll_and_errors(found):
    model = read_model(found.folder / "model.toml")
    told = found.document["camera"]["effects"][0]["parameters"]["camera_roll"]
    assert model.theta["camera_roll"] == pytest.approx(told["value"])
    assert model.intervals["camera_roll"] == pytest.approx(tuple(told["interval"]))
    comment = "# camera: explained: fitted to pictured; added to what was declared: camera_roll"
    assert comment in (found.folder / "model.toml").read_text().splitlines()
    pictures = {path.name for path in found.folder.glob("*.png")}
    assert pictures == {f"camera_{name}.png" for name in ("markings", "displacement", "ranking", "error")}
    words = " ".join(found.out.split())
    assert "pictured: camera: camera roll: the camera is tilted by 4." in words
    assert ". Explained: with the effects added, the camera explains the frames" in words
    assert "added camera_roll: log-likelihood gain" in words
    assert "markings [px]" in words
    assert "brightness [grey]" in words
    assert "these frames could not have shown: " in words
    assert "fitting the camera" in found.err


def test_an_unknown_effect_and_a_log_to_test_on_are_refused_in_one_line(rolled_frames, tmp_path, refused):
    line = refused("diagnose", rolled_frames, "--declared", "camera_rol", "--output", tmp_path / "out")
    assert "--declared camera_rol: no effect on motion, camera or pictures has this name; did you mean" in line
    assert "'camera_roll'" in line
    assert not (tmp_path / "out").exists()
    line = refused("diagnose", rolled_frames, "--test", rolled_frames, "--output", tmp_path / "out")
    assert "--test: pictured has no commands" in line


@pytest.mark.slow
def test_where_motion_is_refused_the_camera_still_comes_out(tmp_path, answered):
    document = answered("diagnose", short_drives(tmp_path / "log"), "--output", tmp_path / "out")
    assert "at least 20 s" in document["motion_refused"]
    assert [effect["name"] for effect in document["effects"]] == ["camera_roll"]
    assert not {"errors", "clocks"} & set(document)
    names = {path.name for path in (tmp_path / "out").iterdir()}
    assert {Path(name).name for name in document["files"]} == names >= {"model.toml", "camera_markings.png"}


@pytest.mark.slow
def test_where_both_are_refused_both_reasons_are_told_in_one_line(tmp_path, refused):
    log = circling_log(TRUTH, noise=CALM, episodes=2, seconds=6.0)
    folder = add_frames(write_log(log, tmp_path / "log"), log, ROLLED, every=20)
    line = refused("diagnose", folder, "--output", tmp_path / "out")
    assert "at least 20 s" in line
    assert "camera: pictured: frames: 9 of 12 frames show markings" in line


@pytest.mark.slow
def test_motion_and_camera_come_out_in_one_document_one_model_and_one_folder(tmp_path, answered):
    log = circling_log({**TRUTH, "yaw_scrub": 0.12}, noise=CALM)
    folder = add_frames(write_log(log, tmp_path / "log"), log, ROLLED, every=36)
    document = answered("diagnose", folder, "--output", tmp_path / "out")
    assert [effect["name"] for effect in document["effects"]] == ["yaw_scrub"]
    assert [effect["name"] for effect in document["camera"]["effects"]] == ["camera_roll"]
    assert set(document["declared"]) == {"trim", "delay"}
    assert set(document["camera"]["declared"]) >= {"camera_pitch"}
    assert (document["error"]["unit"], document["camera"]["error"]["unit"]) == ("m", "px")
    theta = read_model(tmp_path / "out" / "model.toml").theta
    assert theta["yaw_scrub"] == pytest.approx(0.12, abs=0.005)
    assert theta["camera_roll"] == pytest.approx(4.0, abs=0.5)
    assert (tmp_path / "out" / "model.toml").read_text().count("added to what was declared") == 2
    names = {path.stem for path in (tmp_path / "out").glob("*.png")}
    assert names >= {"residual_map", "error", "camera_markings", "camera_error"}


def test_progress_of_both_goes_from_motion_to_the_camera(tmp_path):
    shares = shares_of(read_log(short_drives(tmp_path / "log")))
    assert shares["testing on drives kept aside"] < shares["reading frames"] < shares["testing on frames kept aside"]
    assert shares["drawing"] == max(shares.values()) < 1.0


@pytest.mark.slow
@pytest.mark.skipif(not MEASURED.is_dir(), reason=f"needs measured data in {MEASURED.parent.name}/{MEASURED.name}")
def test_nothing_is_missing_of_the_camera_that_took_the_measured_frames(tmp_path, answered):
    document = answered("diagnose", MEASURED, "--output", tmp_path / "out")
    assert (document["verdict"], document["effects"]) == ("nothing missing", [])
    low, high = document["declared"]["camera_pitch"]["interval"]
    assert low < 19.15 < high
    assert document["camera"]["error"]["after"] < 1.0
