"""`drive`: what it says and writes, and each bad input in one line."""

import pytest
from PIL import Image

from proxytune.cli.main import main

DOMAIN = {"robot": '"duckiebot"', "plant": '"planar"', "seconds": "2.0"}
FAMILY = '"proxytune.driving.family:lane_following"'
MODEL = 'format = 1\nrobot = "{}"\n[effects.trim]\ntrim = {}\n'
TARGET = "agent,episode,distance,survival_time\n" + "".join(f"{a},{e},1,1\n" for a in ("steady", "wary") for e in "012")


@pytest.fixture(scope="module")
def lane(make_studies):
    """A study of lane following that names the truth."""
    folder = make_studies("lane", domain=DOMAIN, family=FAMILY, agents='["steady", "wary"]', truth='"truth.toml"')
    (folder / "truth.toml").write_text(MODEL.format("duckiebot", 0.2))
    (folder / "other.toml").write_text(MODEL.format("irobot_create", 0.2))
    (folder / "target.csv").write_text(TARGET)
    return folder


def test_the_document_has_both_scores_and_when_they_part_which_they_do_not_at_the_target_s_own_values(lane, answered):
    answer = answered("drive", lane, "--agent", "steady", "--theta", "trim=-0.2")
    keys = "agent start seed theta proxy target parted_s theta_from against output cautions"
    assert list(answer) == keys.split()
    assert (answer["agent"], answer["start"], answer["seed"], answer["theta"]) == ("steady", 0, 1, {"trim": -0.2})
    assert answer["proxy"]["metrics"]["distance"] != answer["target"]["metrics"]["distance"]
    assert 0.0 < answer["parted_s"] < 2.0
    assert (answer["theta_from"], answer["against"], answer["output"]) == ("given", str(lane / "truth.toml"), None)
    assert answer["cautions"] == []
    answer = answered("drive", lane, "--agent", "steady", "--theta", lane / "truth.toml", "--start", "2", "--seed", "7")
    assert answer["proxy"] == answer["target"]
    assert (answer["parted_s"], answer["start"], answer["seed"]) == (None, 2, 7)


def test_an_interval_without_its_value_in_the_target_s_model_is_a_caution(lane, capsys, answered):
    (lane / "odd.toml").write_text(MODEL.format("duckiebot", "{ value = 0.2, interval = [0.01, 0.05] }"))
    words = (lane, "--agent", "steady", "--against", lane / "odd.toml")
    (line,) = answered("drive", *words)["cautions"]
    assert "the interval of trim, 0.01 to 0.05, does not hold its value 0.2" in line
    assert main(["drive", *map(str, words)]) == 0
    assert capsys.readouterr().out.startswith("beware: model of duckiebot: the interval of trim")


def test_people_see_which_episode_it_is_both_scores_and_when_they_part(lane, capsys):
    assert main(["drive", str(lane), "--agent", "steady", "--theta", "trim=-0.2"]) == 0
    shown = capsys.readouterr().out
    assert "steady from start 0 under seed 1, as in every trial of this study" in shown
    assert "proxy: the θ given: trim=-0.2" in shown
    assert "distance [m]" in shown
    assert "first more than 5 cm apart at" in shown
    assert main(["drive", str(lane), "--agent", "brisk"]) == 0
    assert "brisk from start 0 under seed 1, as in no trial of this study" in capsys.readouterr().out


def test_theta_is_nominal_before_a_trial_is_finished_then_best_unless_nominal_is_asked_for(lane, answered, finished):
    answer = answered("drive", lane, "--agent", "steady")
    assert (answer["theta_from"], answer["theta"]) == ("nominal", {})
    best = answered("drive", finished, "--agent", "agent0")
    assert best["theta_from"] == "best"
    assert set(best["theta"]) == {"trim", "delay"}
    assert answered("drive", finished, "--agent", "agent0", "--theta", "nominal")["theta"] == {}


def test_a_study_without_a_truth_has_no_target_until_one_is_given(make_study, tmp_path, answered):
    folder = make_study(domain=DOMAIN, family=FAMILY, agents='["steady", "wary"]')
    alone = answered("drive", folder, "--agent", "steady")
    assert (alone["target"], alone["parted_s"], alone["against"]) == (None, None, None)
    (tmp_path / "model.toml").write_text(MODEL.format("duckiebot", 0.2))
    assert answered("drive", folder, "--agent", "steady", "--against", tmp_path / "model.toml")["target"] is not None


@pytest.mark.parametrize(("ending", "frames"), [("png", 1), pytest.param("gif", 2, marks=pytest.mark.slow)])
def test_a_picture_is_written_and_named(lane, tmp_path, answered, ending, frames):
    path = tmp_path / "new" / f"episode.{ending}"
    assert answered("drive", lane, "--agent", "steady", "--output", path)["output"] == str(path)
    with Image.open(path) as picture:
        assert picture.format == ending.upper()
        assert getattr(picture, "n_frames", 1) >= frames
    assert list(path.parent.iterdir()) == [path]


def test_where_there_are_no_places_metrics_are_told_and_else_a_robot_is_drawn(make_study, tmp_path, refused, answered):
    folder = make_study(family='"walking:walking"', domain={"columns": '"z"'})
    assert answered("drive", folder, "--agent", "agent0")["proxy"]["metrics"]["distance"] > 0.0
    line = refused("drive", folder, "--agent", "agent0", "--output", tmp_path / "walk.png")
    assert "nothing can be drawn, as this study's domain family records no x and y; leave the option out" in line
    assert not (tmp_path / "walk.png").exists()
    folder = make_study(domain={"journal": f'"{tmp_path / "journal"}"'})
    assert "nothing can be drawn" in refused("drive", folder, "--agent", "agent0", "--output", tmp_path / "walk.png")
    assert not (tmp_path / "journal").exists()
    answered("drive", folder, "--agent", "agent0")
    assert (tmp_path / "journal").exists()
    folder = make_study(family='"walking:walking"')
    (tmp_path / "model.toml").write_text("trim = 0.2\n")
    words = ["--agent", "agent0", "--against", tmp_path / "model.toml", "--output", tmp_path / "walk.png"]
    assert answered("drive", folder, *words)["parted_s"] == pytest.approx(0.3)
    assert (tmp_path / "walk.png").exists()


BAD = {
    "an unknown agent": (["--agent", "wry"], "agent 'wry' is unknown (your own is written module:attribute)"),
    "a negative seed": (["--seed", "-1"], "--seed must be at least 0, got -1"),
    "an unknown format": (["--output", "a.bmp"], "unknown format '.bmp'; end the name in .png, .gif or .mp4"),
    "a folder that is a file": (["--output", f"{__file__}/a.png"], "cannot be written there, as "),
    "a θ that is none": (["--theta", "well"], "--theta well: write NAME=VALUE,NAME=VALUE, best, nominal or a model"),
    "a best θ before any trial": (["--theta", "best"], "has no finished trial; run it first"),
    "no such model": (["--against", "no.toml"], "--against no.toml: no such file; check the path"),
}
WITH_MODELS = {
    "measure": ("--model", "--output", "scores.csv"),
    "record": ("--model", "--output", "log"),
    "sweep": ("--target-model", "--parameter", "trim", "--points", "2", "--at", "nominal"),
}


@pytest.mark.parametrize("command", WITH_MODELS)
def test_a_model_of_another_robot_is_named_by_its_file_and_option_not_study_toml(lane, refused, command):
    option, *rest = WITH_MODELS[command]
    told = f"proxytune {command}: {option} {OF_ANOTHER.format(lane=lane)}"
    assert refused(command, lane, option, lane / "other.toml", *rest).startswith(told)


OF_ANOTHER = "{lane}/other.toml: is of the robot 'irobot_create'; give a model of 'duckiebot'"
BAD |= {option: ([option, "{lane}/other.toml"], f"{option} {OF_ANOTHER}") for option in ("--against", "--theta")}


@pytest.mark.parametrize(("words", "line"), BAD.values(), ids=BAD)
def test_bad_input_and_a_model_of_another_robot_are_told_in_one_line(lane, refused, words, line):
    words = (word.format(lane=lane) for word in words)
    assert line.format(lane=lane) in refused("drive", lane, "--agent", "steady", *words)


def test_a_movie_without_its_writer_is_refused_before_anything_is_driven(lane, tmp_path, refused, monkeypatch):
    monkeypatch.setattr("shutil.which", lambda name: None)
    monkeypatch.setitem(__import__("sys").modules, "imageio_ffmpeg", None)
    line = refused("drive", lane, "--agent", "steady", "--output", tmp_path / "a.mp4")
    assert line == "proxytune drive: an .mp4 takes ffmpeg: pip install imageio-ffmpeg, or write a .gif\n"
