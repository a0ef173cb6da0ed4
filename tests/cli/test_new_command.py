"""`new` writes folders that work as they are, and nothing over what is there."""

import shlex
import sys

import pytest
from one_line import complaint_of

from proxytune.cli.new import pasteable, read_figures
from proxytune.extensions import load

SIX = "wheel_radius=0.04,wheel_distance=0.2,full_speed=0.4,motor_time_constant=0.15,camera_height=0.12,camera_pitch=25"


@pytest.fixture
def typed(tmp_path, monkeypatch, answered):
    """Runs a command in an empty folder and gives its document."""
    monkeypatch.chdir(tmp_path)
    return lambda line: answered(*shlex.split(line.removeprefix("python -m proxytune ")))


def shorten(path, *pairs):
    """Make a study quick: each old text is replaced once."""
    text = path.read_text()
    for before, after in pairs:
        assert text.count(before) == 1, before
        text = text.replace(before, after)
    path.write_text(text)


QUICK = (("budget = 16", "budget = 4"), ("initial = 8", "initial = 3\nconfirm = 0\npreflight = false"))
QUICK_ROBOT = (*QUICK, ("starts = 4", "starts = 2"), ("seconds = 10.0", "seconds = 3.0"), ("jobs = 2", "jobs = 1"))


@pytest.mark.slow
@pytest.mark.parametrize("plant", ["bullet", "planar"])
def test_a_new_robot_runs_a_new_study_on_either_plant_by_the_commands_that_are_named(typed, tmp_path, plant):
    made = typed(f"new robot rover --figures {SIX}")
    assert made["files"] == ["rover/robot.toml", "rover/rover.urdf"]
    assert "rover" in [row["name"] for row in typed(made["next"][0])["robots"]]
    study = typed(made["next"][1])
    changes = () if plant == "bullet" else (('plant = "bullet"', 'plant = "planar"'),)
    shorten(tmp_path / "rover_study" / "study.toml", *QUICK_ROBOT, *changes)
    measure, run = study["next"]
    assert typed(measure)["agents"][0] == "steady"
    assert len(typed(run)["trials"]) == 4


@pytest.mark.slow
def test_a_new_family_runs_by_the_commands_that_are_named_and_keeps_every_promise(typed, tmp_path, monkeypatch):
    made = typed("new family carts")
    shorten(tmp_path / "carts" / "study.toml", ("budget = 20", "budget = 9"))
    measure, run, test = made["next"]
    assert len(typed(measure)["agents"]) == 6
    assert set(typed(run)["best"]["theta"]) == {"friction", "gain"}
    assert test == "PYTHONPATH=carts python -m pytest carts/test_carts.py"
    monkeypatch.syspath_prepend(str(tmp_path / "carts"))
    load("test_carts:test_the_family_keeps_what_a_study_relies_on", kind="test")()
    for module in ("carts", "test_carts"):
        sys.modules.pop(module, None)


def test_a_family_follows_its_truth_and_refuses_what_it_does_not_know(typed, tmp_path, refused):
    typed("new family sleds")
    (tmp_path / "sleds" / "truth.toml").write_text("grip = 1.0\n")
    line = ("measure", "sleds", "--model", "sleds/truth.toml", "--output", "sleds/target.csv")
    assert "truth.toml: grip: unknown key" in refused(*line)


@pytest.mark.parametrize("words", ["robot rover", "study mine", "family sleighs"])
def test_the_same_again_is_no_error_until_something_was_edited(typed, tmp_path, refused, words):
    for _ in range(2):
        typed(f"new {words}")
    (tmp_path / words.split()[1] / "mine.txt").write_text("mine")
    name = words.split()[1]
    assert f"{name}: is there already; choose another name, or move it away" in refused("new", *words.split())
    assert (tmp_path / name / "mine.txt").read_text() == "mine"


BAD = {
    "a path": ("robot sub/rover", "a name has letters, digits, _ and -"),
    "a robot that comes with proxytune": ("robot duckiebot", "a robot of this name comes with proxytune"),
    "a family that is no module": ("family my-family", "a family is a Python module; write _ for -"),
    **{
        name: (f"family {name}", f"'{name}': a family is a Python module that is imported by its name")
        for name in ("class", "None", "_carts")
    },
    "a family that would hide a module": ("family numpy", "a Python module of this name is installed"),
    "an unknown robot": ("study mine --robot rover", "robot 'rover' is unknown"),
    "a robot without a camera": ("study mine --robot husky", "robot 'husky' has no camera"),
    "figures of a study": ("study mine --figures mass=1", "--figures: is for `new robot`; leave it out"),
    "figures that are no numbers": ("robot rover --figures mass=heavy", "write NAME=VALUE,NAME=VALUE with numbers"),
    "no such URDF": ("robot rover --urdf no.urdf", "no.urdf: cannot be read"),
}


@pytest.mark.parametrize(("line", "expected"), BAD.values(), ids=BAD)
def test_bad_input_is_one_line_and_leaves_nothing(tmp_path, monkeypatch, refused, line, expected):
    monkeypatch.chdir(tmp_path)
    assert expected in refused("new", *shlex.split(line))
    assert not list(tmp_path.iterdir())


def test_figures_are_read_from_pairs_and_a_long_command_is_broken_so_that_it_can_be_pasted():
    assert read_figures("wheel_radius=0.03, mass=2") == {"wheel_radius": 0.03, "mass": 2.0}
    assert read_figures(None) == {}
    assert "write NAME=VALUE" in complaint_of(read_figures, "mass")
    command = "python -m proxytune measure rover_study --model rover_study/truth.toml --output rover_study/target.csv"
    lines = pasteable(command).split("\n")
    assert max(map(len, lines)) <= 80
    assert shlex.split("".join(line.removesuffix("\\") for line in lines)) == shlex.split(command)
