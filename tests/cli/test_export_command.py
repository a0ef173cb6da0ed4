"""`export` writes a model.toml or a study's answer, and says what has no place."""

import pytest
import skopt
from several import make_several

from proxytune.api import read_study
from proxytune.cli.main import main

MODEL = """format = 1
robot = "duckiebot"
[effects.trim]
trim = { value = 0.05, interval = [0.04, 0.06] }
[effects.dead_band]
width = { value = 0.06, interval = [0.05, 0.07], unit = "duty" }
"""
GEOMETRY = """format = 1
robot = "nobodys"
[geometry]
wheel_radius_m = 0.05
baseline_m = 0.3
full_speed_m_s = 1.0
[effects.wheel_gain]
left = 0.95
"""


@pytest.fixture
def model(write_file):
    return write_file(MODEL, "model.toml")


@pytest.mark.parametrize("form", ["urdf", "mjcf", "ros"])
def test_every_value_is_told_with_its_place_or_that_it_has_none(model, tmp_path, capsys, answered, form):
    output = tmp_path / "out" / "robot.txt"
    arguments = ["export", str(model), "--to", form, "--output", str(output)]
    document = answered(*arguments)
    assert {
        "name": "dead_band.width",
        "value": 0.06,
        "interval": [0.05, 0.07],
        "unit": "duty",
        "place": None,
    } in document["no_place"]
    assert [line["interval"] for line in document["written"] if line["name"] == "trim"] == [[0.04, 0.06]]
    assert "dead_band.width 0.06 duty (0.05 to 0.07): NO PLACE, not in this file" in output.read_text()
    assert "delay 0.15 s" in output.read_text()
    assert main(arguments) == 0
    told = " ".join(capsys.readouterr().out.split())
    assert "dead_band.width 0.06 duty (0.05 to 0.07): NO PLACE, not in this file" in told


SHORT = {
    "family": None,
    "metrics": '["distance:max"]',
    "starts": "1",
    "budget": "3",
    "initial": "3",
    "engine": '"sobol"',
    "domain": {"plant": '"planar"', "seconds": "2"},
}
"""A study of three short trials on the road."""


@pytest.mark.slow
def test_the_best_theta_of_a_study_is_exported_with_intervals_whatever_agents_are_called_and_without_their_code(
    make_study, tmp_path, answered
):
    folder = make_study(agents=None, **SHORT)
    with (folder / "study.toml").open("a") as study:
        study.write('\n[agents]\nslow = "steady"\nwild = "mine:Wild"\n')
    (folder / "mine.py").write_text("from proxytune.driving import AGENTS\n\nWild = AGENTS['daredevil']\n")
    (folder / "target.csv").write_text("agent,episode,distance\nslow,0,0.2\nwild,0,0.5\n")
    best = answered("study", folder)["best"]["theta"]
    (folder / "mine.py").unlink()
    document = answered("export", folder, "--to", "ros", "--output", tmp_path / "robot.yaml")
    values = {line["name"]: line for line in (*document["written"], *document["no_place"])}
    assert {name: values[name]["value"] for name in best} == best
    assert len(values["trim"]["interval"]) == 2
    assert values["motor_lag.time_constant"]["value"] == 0.2


def test_a_study_of_another_simulator_is_refused_before_its_code_is_asked_for(make_study, tmp_path, refused):
    folder = make_study(
        family='"proxytune.environments.family:gymnasium_family"', domain={"environment": '"mine:Cart"'}
    )
    assert "is a study of another simulator" in refused("export", folder, "--to", "ros", "--output", tmp_path / "out")


def test_trials_are_what_scikit_optimize_loads_and_other_simulators_refused(
    finished, tmp_path, write_file, refused, capsys
):
    line = refused("export", finished, "--to", "ros", "--output", tmp_path / "robot.yaml")
    assert "is a study of another simulator" in line
    assert not (tmp_path / "robot.yaml").exists()
    path = write_file('format = 1\nrobot = "rover"\n', "model.toml")
    line = refused("export", path, "--to", "ros", "--output", tmp_path / "out.yaml")
    assert "its robot 'rover' is unknown here; go to the folder that rover lies in" in line
    assert main(["export", str(finished), "--to", "skopt", "--output", str(tmp_path / "trials.pkl")]) == 0
    assert "7 trials of 'wobbly'" in capsys.readouterr().out
    found, report = skopt.load(tmp_path / "trials.pkl"), read_study(finished)
    assert dict(zip(("delay", "trim"), found.x, strict=True)) == report.theta
    assert found.func_vals.tolist() == report.trials().score.tolist()


def test_effects_of_ones_own_that_the_model_does_not_name_are_refused(model, tmp_path, refused):
    line = refused("export", model, "--to", "ros", "--effects", "mine:Mine", "--output", tmp_path / "new")
    assert line.endswith("--effects mine:Mine: " + f"{model} names no such effect; known are: dead_band, trim\n")


def test_the_study_around_a_family_and_a_target_elsewhere_are_kept(make_study, tmp_path, refused):
    folder = make_several(make_study, target='"../real.csv"')
    (tmp_path / "real.csv").write_text((folder / "target.csv").read_text())
    for kept in (folder / "study.toml", folder / "right.toml", tmp_path / "real.csv"):
        told = refused("export", folder / "families" / "right", "--to", "ros", "--output", kept)
        assert f"{kept.name}: is read by this command, and would be lost" in told


def test_a_robot_without_a_folder_has_ros_parameters_but_no_body(tmp_path, answered, refused):
    path, output = tmp_path / "model.toml", tmp_path / "robot.out"
    path.write_text(GEOMETRY)
    answered("export", path, "--to", "ros", "--output", output)
    assert "left_wheel_radius_multiplier: 0.95" in output.read_text()
    output.unlink()
    for form, expected in {"urdf": "has no body", "mjcf": "states no mass"}.items():
        assert expected in refused("export", path, "--to", form, "--output", output)
        assert not output.exists()


@pytest.mark.slow
@pytest.mark.parametrize("form", ["optuna", "skopt"])
def test_the_same_export_again_is_no_error_and_another_file_is_left_alone(finished, tmp_path, answered, refused, form):
    """A killed export may have been through."""
    if form == "optuna":
        pytest.importorskip("optuna")
    file = tmp_path / "trials"
    words = ("export", finished, "--to", form, "--output", file)
    answered(*words)
    first = file.read_bytes()
    answered(*words)
    assert file.read_bytes() == first
    file.write_bytes(first + b" ")
    assert "trials: is there already; give another name, or move it away" in refused(*words)
    assert file.read_bytes() == first + b" "


@pytest.mark.parametrize("form", ["optuna", "skopt"])
def test_a_model_has_no_trials_to_write(model, tmp_path, refused, form):
    if form == "optuna":
        pytest.importorskip("optuna")
    line = refused("export", model, "--to", form, "--output", tmp_path / "new")
    assert "takes the trials of a study; give the study's folder" in line
    assert not (tmp_path / "new").exists()
