"""`predict` replays any log with a model file and says how far it strays."""

import shutil
from dataclasses import replace

import hidden_cases as hidden
import numpy as np
import pandas as pd
import pytest
from planted import TRUTH, planted_log, with_poses, write_log

from proxytune.cli.main import main
from proxytune.diagnosis import on_one_clock, robot_of
from proxytune.effects import Model, model_text
from proxytune.logs import read_log
from proxytune.report import clocks_document


@pytest.fixture
def folder(tmp_path):
    return write_log(planted_log(TRUTH, episodes=2, seconds=10.0, noise=None), tmp_path / "log")


@pytest.fixture
def model(tmp_path):
    def write(theta=TRUTH, robot="duckiebot", **more):
        path = tmp_path / "model.toml"
        path.write_text(model_text(Model(robot, None, theta, {}, **more)), encoding="utf-8")
        return path

    return write


def test_every_window_is_written_and_the_error_told_is_that_of_its_poses(folder, model, tmp_path, answered, capsys):
    told = answered("predict", model(), folder, "--horizon", 2, "--output", tmp_path / "poses.csv")
    table = pd.read_csv(tmp_path / "poses.csv", dtype={"episode": str})
    assert list(table.columns) == ["episode", "start_time", "time", "x", "y", "heading"]
    assert told["rows"] == len(table)
    assert told["windows"] == len(table[["episode", "start_time"]].drop_duplicates()) == 10
    assert told["horizon_s"] == 2.0
    assert told["error"]["value"] < 1e-6
    assert told["error"]["unit"] == "m"
    assert told["error"]["poses"] == 2 * 199

    told = answered("predict", model({"trim": 0.1, "delay": 0.12}), folder, "--output", tmp_path / "poses.csv")
    table = pd.read_csv(tmp_path / "poses.csv")
    measured = pd.read_csv(folder / "samples.csv")[["episode", "time", "x", "y"]]
    both = table[table.time > table.start_time].merge(measured, on=["episode", "time"], suffixes=("", "_seen"))
    apart = np.hypot(both.x - both.x_seen, both.y - both.y_seen)
    assert told["error"]["value"] == pytest.approx(np.sqrt(np.mean(apart**2)))
    assert told["error"]["value"] > 0.005
    assert main(["predict", str(model()), str(folder), "--output", str(tmp_path / "p.csv")]) == 0
    assert "10 windows of 2 s: RMSE 0.0 mm" in capsys.readouterr().out


def test_a_robot_of_its_own_needs_geometry_in_the_model_or_the_log(model, tmp_path, refused, answered):
    log = replace(planted_log(TRUTH, episodes=2, seconds=10.0, noise=None), robot="my_robot")
    own = {"wheel_radius": 0.0318, "effective_baseline": 0.16, "full_speed": 0.6}
    theta = {**TRUTH, "motor_lag.time_constant": 0.2}
    bare = write_log(log, tmp_path / "bare")
    told = answered("predict", model(theta, "my_robot", geometry=own), bare, "--output", tmp_path / "p.csv")
    assert told["error"]["value"] < 1e-6
    stated = write_log(log, tmp_path / "stated", wheel_radius_m=0.0318, baseline_m=0.16, full_speed_m_s=0.6)
    told = answered("predict", model(theta, "my_robot"), stated, "--output", tmp_path / "p.csv")
    assert told["error"]["value"] < 1e-6
    line = refused("predict", model(theta, "my_robot"), bare, "--output", tmp_path / "q.csv")
    assert "robot 'my_robot' is unknown" in line
    assert not (tmp_path / "q.csv").exists()


def test_a_log_without_a_pose_to_compare_with_is_still_predicted(model, tmp_path, answered):
    log = planted_log(TRUTH, episodes=1, seconds=10.0, noise=None)

    def sparse(poses):
        out = np.full_like(poses, np.nan)
        out[::40] = poses[::40]
        return out

    folder = write_log(with_poses(log, sparse), tmp_path / "sparse")
    told = answered("predict", model(), folder, "--horizon", 1, "--output", tmp_path / "p.csv")
    assert (told["windows"], told["error"]["poses"]) == (0, 0), "no window has a pose near its end"


@pytest.mark.slow
def test_a_log_whose_clock_jumps_is_judged_on_one_clock_as_a_diagnosis_does(model, tmp_path, answered, capsys):
    case, late = hidden.CLEAN[2], np.zeros((6, 800))
    late[3, 500:] = 0.5
    path, errors = model({"trim": case.trim, "delay": case.delay}), {}
    for name, late_s in (("apart", late), ("right", 0.0)):
        folder = write_log(hidden.make_log(case, episodes=6, seconds=40.0, late_s=late_s), tmp_path / name)
        told = answered("predict", path, folder, "--output", tmp_path / f"{name}.csv")
        log = read_log(folder)
        assert told["clocks"] == clocks_document([on_one_clock(log, robot_of(log))[1]])
        errors[name] = told["error"]["value"]
    assert errors["apart"] == pytest.approx(errors["right"], rel=0.1)
    assert pd.read_csv(tmp_path / "apart.csv").query("episode == 3").start_time.max() < 25.0
    capsys.readouterr()
    assert main(["predict", str(path), str(tmp_path / "apart"), "--output", str(tmp_path / "p.csv")]) == 0
    said = " ".join(capsys.readouterr().out.split())
    assert "in drive 03 the clock jumps at about 24 s: poses are stamped 0.4" in said


BAD = {
    "no such model": (["{home}/gone.toml", "{log}"], "gone.toml"),
    "no such log": (["{model}", "{home}/gone"], "gone: no such folder"),
    "a horizon of nothing": (["{model}", "{log}", "--horizon", "0"], "--horizon must be a positive number of seconds"),
    "a horizon that is no number": (["{model}", "{log}", "--horizon", "nan"], "--horizon must be a positive number"),
    "an endless horizon": (["{model}", "{log}", "--horizon", "inf"], "--horizon must be a positive number"),
    "its own model": (["{model}", "{log}", "--output", "{model}"], "is read by this command, and would be lost"),
    "its own log": (["{model}", "{log}", "--output", "{log}/samples.csv"], "is read by this command"),
    "its log's settings": (["{model}", "{log}", "--output", "{log}/log.toml"], "is read by this command"),
    "its own frames": (["{model}", "{log}", "--frames", "--output", "{log}"], "is read by this command"),
    "an effect that the model has not": (["{model}", "{log}", "--effects", "trimm"], "trimm: {model} names no such"),
    "a horizon of pictures": (["{model}", "{log}", "--frames", "--horizon", "2"], "--horizon: is for poses"),
    "a figure for a log": (
        ["{model}", "{log}", "--figure", "baseline_m=0.2"],
        "log is a log already; state it in its log.toml",
    ),
    "a map for a log": (["{model}", "{log}", "--map", "small_loop"], "--map: is for a bag or table"),
    "a bag's option for a log": (["{model}", "{log}", "--clock-offset", "5"], "is a log already"),
    "a horizon shorter than a sample": (["{model}", "{log}", "--horizon", "0.01"], "shorter than a sample"),
}


@pytest.mark.parametrize(("words", "says"), BAD.values(), ids=BAD)
def test_bad_input_is_one_line_and_nothing_is_written(words, says, folder, model, tmp_path, refused):
    path = model()
    given = [word.format(home=tmp_path, log=folder, model=path) for word in words]
    line = refused("predict", *(given if "--output" in given else [*given, "--output", tmp_path / "p.csv"]))
    assert line.startswith("proxytune predict: ")
    assert says.format(model=path) in line
    assert not (tmp_path / "p.csv").exists()


def test_a_pose_off_the_way_is_left_out_and_another_robots_model_a_caution(folder, model, tmp_path, answered):
    path = model({"trim": 0.2, "delay": 0.12})
    good = answered("predict", path, folder, "--output", tmp_path / "poses.csv")
    shutil.copytree(folder, tmp_path / "off")
    samples = pd.read_csv(folder / "samples.csv")
    samples.loc[len(samples) // 2, "x"] += 10.0
    samples.to_csv(tmp_path / "off" / "samples.csv", index=False)
    told = answered("predict", path, tmp_path / "off", "--output", tmp_path / "poses.csv")
    assert told["error"]["value"] == pytest.approx(good["error"]["value"], rel=0.02)
    (line,) = answered("predict", model(robot="husky"), folder, "--output", tmp_path / "poses.csv")["cautions"][-1:]
    assert line == "the log is of the robot 'duckiebot', and the model of 'husky'"


def test_an_interval_without_its_value_is_a_caution_and_a_camera_no_matter_of_poses(folder, model, tmp_path, answered):
    path = model({"trim": 0.2, "delay": 0.12})
    good = answered("predict", path, folder, "--output", tmp_path / "poses.csv")
    assert good["cautions"] == []
    path.write_text(path.read_text().replace("value = 0.2", "value = 0.2, interval = [0.01, 0.05]"))
    told = answered("predict", path, folder, "--output", tmp_path / "poses.csv")
    (line,) = told.pop("cautions")
    assert "the interval of trim, 0.01 to 0.05, does not hold its value 0.2" in line
    assert told == {key: value for key, value in good.items() if key != "cautions"}
    assert answered("export", path, "--to", "urdf", "--output", tmp_path / "o.urdf")["cautions"] == [line]
    geometry = {"wheel_radius": 0.0318, "effective_baseline": 0.16, "full_speed": 0.6}
    path = model({"camera_pitch": 20.0}, robot="nobodys", geometry=geometry)
    assert answered("predict", path, folder, "--output", tmp_path / "poses.csv")["rows"]


def test_without_a_place_for_the_poses_their_error_alone_is_told(folder, model, tmp_path, answered, refused, capsys):
    path = model()
    known, before = answered("predict", path, folder, "--output", tmp_path / "poses.csv"), set(tmp_path.iterdir())
    assert answered("predict", path, folder) == {**known, "predictions": None}
    assert main(["predict", str(path), str(folder)]) == 0
    assert capsys.readouterr().out.startswith("10 windows of 2 s: RMSE 0.0 mm")
    assert "--frames: needs a folder for the pictures; give it by --output DIR" in refused(
        "predict", path, folder, "--frames"
    )
    assert set(tmp_path.iterdir()) == before
