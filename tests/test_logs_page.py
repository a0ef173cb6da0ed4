"""The commands at the head of docs/how-to/logs.md work as they stand, in order, on a bag of a robot of nobody's."""

import json
import re
import shlex
from pathlib import Path

import foreign_robot
import pytest

from proxytune.cli.main import main

PAGE = (Path(__file__).resolve().parent.parent / "docs" / "how-to" / "logs.md").read_text(encoding="utf-8")
LINES = [line for block in re.findall(r"```sh\n(.*?)```", PAGE, flags=re.DOTALL) for line in block.splitlines()]
FIGURES = (
    "wheel_radius=0.033,wheel_distance=0.16,full_speed=0.5,motor_time_constant=0.1,camera_height=0.1,camera_pitch=20"
)


@pytest.fixture
def recorded(tmp_path, monkeypatch, capsys):
    pytest.importorskip("rosbags")
    monkeypatch.chdir(tmp_path)
    assert main(["new", "robot", "my_robot", "--figures", FIGURES]) == 0
    made = foreign_robot.write_form(tmp_path, "ros1", [foreign_robot.drive(7, seconds=120.0)])
    (made / "run0.bag").rename("my_drives.bag")
    capsys.readouterr()


@pytest.mark.slow
def test_every_command_of_the_page_runs_and_a_bag_says_what_its_log_says(recorded, capsys):
    answers = []
    for line in LINES:
        assert main([*shlex.split(line, comments=True)[3:], "--json"]) == 0, f"{line}: {capsys.readouterr().err}"
        answers.append(json.loads(capsys.readouterr().out))
    listed, imported, of_the_log, of_the_bag = answers
    assert listed != imported
    assert of_the_log["verdict"] == of_the_bag["verdict"]
    assert of_the_log["effects"] == of_the_bag["effects"]
    assert "dead_band" in [effect["name"] for effect in of_the_bag["effects"]]
