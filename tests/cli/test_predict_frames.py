"""`predict --frames` draws what a model's camera would have seen, as a log's frames, and says how far off it is."""

import shutil

import numpy as np
import pandas as pd
import pytest
from pictured import lane_poses, pictures, write_still_frames
from PIL import Image
from planted import TRUTH, planted_log, write_log

from proxytune.cli.main import main
from proxytune.effects import Model, model_text
from proxytune.logs import read_log

ROLLED = {"camera_pitch": 17.0, "camera_roll": 4.0}
POSES = lane_poses(65)


@pytest.fixture(scope="module")
def stills(tmp_path_factory):
    return write_still_frames(tmp_path_factory.mktemp("stills") / "log", ROLLED, POSES, columns=80)


@pytest.fixture
def predicted(stills, tmp_path, answered):
    """Predict with these effects, and read the document."""
    words = (stills, "--frames", "--output", tmp_path / "out")
    return lambda theta: answered("predict", model(tmp_path, theta), *words)


def model(folder, theta):
    path = folder / "model.toml"
    path.write_text(model_text(Model("duckiebot", None, theta, {})), encoding="utf-8")
    return path


def test_the_true_model_draws_the_very_pictures_the_nominal_others_and_both_read_as_frames(predicted, tmp_path, stills):
    told = predicted(ROLLED)
    assert told == {"frames": 65, "output": str(tmp_path / "out"), "grey_error": told["grey_error"]}
    assert told["grey_error"] < 0.1
    drawn = np.stack([np.asarray(Image.open(path)) for path in sorted((tmp_path / "out" / "frames").glob("*.png"))])
    assert np.array_equal(drawn, pictures(ROLLED, POSES, columns=80))
    assert predicted({})["grey_error"] > 5.0
    predicted(ROLLED)
    assert list(pd.read_csv(tmp_path / "out" / "frames.csv").columns) == ["frame", "episode", "time"]
    for name in ("log.toml", "samples.csv"):
        shutil.copy(stills / name, tmp_path / "out" / name)
    frames, own = read_log(tmp_path / "out").frames, read_log(stills).frames
    assert [path.name for path in frames.paths] == [path.name for path in own.paths]
    assert np.array_equal(frames.times, own.times)


def test_pictures_of_an_earlier_longer_run_are_left_alone_and_none_is_drawn_among_them(stills, tmp_path, refused):
    drawn = tmp_path / "out" / "frames"
    drawn.mkdir(parents=True)
    for name in ("000064.png", "000065.png", "000066.png", "mine.png"):
        (drawn / name).touch()
    line = refused("predict", model(tmp_path, ROLLED), stills, "--frames", "--output", tmp_path / "out")
    problem = "is of an earlier, longer run, and there are now 65 pictures"
    assert line.strip().endswith(f"{drawn / '000065.png'}: {problem}; give another folder, or remove {drawn}")
    assert len(list(drawn.iterdir())) == 4
    assert not (drawn / "000064.png").stat().st_size


def test_logs_without_frames_or_commands_are_refused_and_people_read_differences_in_grey(
    tmp_path, refused, stills, capsys
):
    folder = write_log(planted_log(TRUTH, episodes=1, seconds=5.0), tmp_path / "log")
    line = refused("predict", model(tmp_path, {}), folder, "--frames", "--output", tmp_path / "out")
    assert "has no frames to predict; add [camera] to log.toml, or leave --frames out" in line
    assert not (tmp_path / "out").exists()
    line = refused("predict", model(tmp_path, {}), stills, "--output", tmp_path / "poses.csv")
    assert "has no commands to predict poses from; give a log of drives, or give --frames" in line
    assert not (tmp_path / "poses.csv").exists()
    words = ["predict", model(tmp_path, ROLLED), stills, "--frames", "--output", tmp_path / "out"]
    assert main([str(word) for word in words]) == 0
    assert "65 frames: mean absolute difference on the floor 0.0 grey levels" in capsys.readouterr().out
