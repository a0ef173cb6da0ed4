"""The robot in MuJoCo of studies/mujoco_target: calibrated as robot.toml says, and made as its README says."""

import dataclasses
import subprocess
import sys
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from one_line import complaint_of

from proxytune.cli.main import main
from proxytune.domain import make_episode
from proxytune.driving import read_robot
from proxytune.extensions import load
from proxytune.logs import read_log
from proxytune.study import bare_family, load_family, read_study_settings

pytest.importorskip("mujoco")


STUDY = Path(__file__).resolve().parent.parent.parent / "studies" / "mujoco_target"
ROBOT = STUDY / "robot"
FIGURES = read_robot("duckiebot").figures


def speeds(duty, seconds=3.0, **motors):
    """Forward speeds [m/s] and yaw rates [rad/s] under a constant duty, tick by tick."""
    plant = load("mujoco_plant:MujocoPlant", kind="plant", beside=ROBOT)
    values = {"gear_friction": 0.0, "motor_imbalance": 0.0, "latency": 0.0} | motors
    start = (0.2, -0.1, 0.5)
    with plant(start, **values) as robot:
        poses, crashed = robot.move(np.tile(duty, (round(60 * seconds), 1)))
    assert not crashed
    steps = np.diff(np.concatenate(([start], poses)), axis=0) * 60.0
    headings = np.concatenate(([start[2]], poses[:-1, 2]))
    return steps[:, 0] * np.cos(headings) + steps[:, 1] * np.sin(headings), steps[:, 2]


def test_it_drives_and_turns_as_robot_toml_says():
    forward, yaw = speeds((1.0, 1.0))
    assert forward[-1] == pytest.approx(FIGURES["full_speed"], rel=0.02)
    assert np.argmax(forward > 0.632 * forward[-1]) / 60.0 == pytest.approx(FIGURES["motor_time_constant"], abs=0.02)
    assert np.abs(yaw).max() < 1e-6
    _, yaw = speeds((0.0, 1.0))
    assert yaw[-1] == pytest.approx(FIGURES["full_speed"] / FIGURES["effective_baseline"], rel=0.08)


def test_friction_holds_wheels_under_small_duties_a_stronger_motor_turns_it_and_commands_arrive_late():
    assert abs(speeds((0.1, 0.1), gear_friction=0.12)[0][-1]) < 0.002
    slower = speeds((0.5, 0.5), gear_friction=0.12)[0][-1] / speeds((0.5, 0.5))[0][-1]
    assert slower == pytest.approx((0.5 - 0.12) / 0.5, rel=0.02)
    assert speeds((0.5, 0.5), motor_imbalance=0.04)[1][-1] > 0.05
    forward = speeds((1.0, 1.0), seconds=0.5, latency=0.2)[0]
    assert np.abs(forward[:11]).max() < 1e-3
    assert forward[13] > 1e-2


def test_the_family_scores_an_episode_alike_again_and_refuses_what_its_model_must_not_hold(write_file):
    pytest.importorskip("pybullet", reason="PyBullet is not installed")
    settings = read_study_settings(ROBOT)
    whole = bare_family(settings, ROBOT / "truth.toml")
    robot = dataclasses.replace(whole, view=dataclasses.replace(whole.view, seconds=2.0))
    episode = make_episode({"latency": 0.1}, agent="daredevil", start=1, seed=3)
    assert robot.run(episode) == robot.run(episode)
    assert robot.identity != load_family(settings, None).identity
    wrong = write_file("[parameters]\nlatncy = 0.1\n", "wrong.toml")
    assert "did you mean 'latency'" in complaint_of(load_family, settings, wrong)


@pytest.mark.slow
def test_the_log_is_made_as_the_readme_says_and_can_be_read(tmp_path):
    command = [sys.executable, str(ROBOT / "make_log.py"), str(ROBOT / "truth.toml"), str(tmp_path / "log")]
    subprocess.run(command, check=True, cwd=tmp_path)
    log = read_log(tmp_path / "log")
    assert (len(log.episodes), log.robot, log.command, log.rate_hz) == (16, "duckiebot", "duty", 20.0)
    assert all(np.isfinite(drive.poses).all() for drive in log.episodes)
    assert np.ptp(log.episodes[0].poses[:, :2]) > 1.0


@pytest.mark.slow
def test_the_target_is_reproduced(tmp_path, capsys):
    """By the MuJoCo that made it: another version may settle contacts otherwise."""
    import mujoco

    if mujoco.__version__ != "4.0.0":
        pytest.skip("the target was made with MuJoCo 4.0.0")
    made = tmp_path / "target.csv"
    assert main(["measure", str(ROBOT), "--model", str(ROBOT / "truth.toml"), "--output", str(made)]) == 0
    pd.testing.assert_frame_equal(pd.read_csv(made), pd.read_csv(STUDY / "target.csv"), rtol=1e-6)
