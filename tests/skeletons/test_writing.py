"""A robot to start from agrees with itself, and drives alike on both plants, whatever its six figures."""

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from one_line import complaint_of

from proxytune.driving import UNITS, BulletPlant, drivetrain, read_robot
from proxytune.driving.plants import PlanarPlant, check_body
from proxytune.effects import FilterContext, effects_from
from proxytune.errors import InputError
from proxytune.skeletons import robot_skeleton
from proxytune.skeletons.writing import GUESSES, SIX

TICK_S = 1.0 / 60.0
SMALL = {"wheel_radius": 0.02, "wheel_distance": 0.09, "full_speed": 0.3, "mass": 0.3}
LARGE = {"wheel_radius": 0.1, "wheel_distance": 0.45, "full_speed": 1.2, "motor_time_constant": 0.25, "mass": 20.0}


def write(folder, figures, *drive):
    home = folder / "rover"
    home.mkdir()
    for name, text in robot_skeleton("rover", figures, *drive).files.items():
        (home / name).write_text(text, encoding="utf-8")
    return read_robot("rover", folder)


def drive(plant, robot, duties):
    train = drivetrain(robot, effects_from(robot.theta, robot.figures, robot.catalogue))
    twists, _ = train.apply(duties, train.begin(FilterContext(60.0, np.zeros(2), robot.figures)))
    with plant:
        return plant.move(twists)


@pytest.mark.parametrize("figures", [{}, SMALL, LARGE], ids=["guessed", "small", "large"])
def test_both_plants_drive_it_alike_without_touching_the_floor(tmp_path, figures):
    robot = write(tmp_path, figures)
    duties = np.repeat([[0.6, 0.6], [0.5, 0.2], [-0.3, 0.3]], 60, axis=0)
    start = np.zeros(3)
    poses, crashed = drive(BulletPlant(robot, start, TICK_S), robot, duties)
    planar, _ = drive(PlanarPlant(start, TICK_S), robot, duties)
    driven = np.abs(np.diff(planar[:, :2], axis=0)).sum()
    assert not crashed
    assert np.abs(poses[:, :2] - planar[:, :2]).max() < 0.03 * driven
    assert abs(poses[-1, 2] - planar[-1, 2]) < 0.1


@settings(max_examples=15)
@given(values=st.tuples(*[st.floats(0.01, 1.0) for _ in SIX]))
def test_what_is_given_is_written_and_the_urdf_has_it_too(tmp_path_factory, values):
    figures = dict(zip(SIX, values, strict=True))
    robot = write(tmp_path_factory.mktemp("robots"), figures)
    assert {name: robot.figures[name] for name in SIX} == pytest.approx(figures, rel=1e-5)
    check_body(robot)


def test_guesses_alone_are_marked_to_be_edited_and_the_six_figures_stand_first():
    text = robot_skeleton("rover", {"wheel_radius": 0.04}).files["robot.toml"].partition("[effects")[0]
    lines = {line.split(" = ")[0]: line for line in text.splitlines() if line.split(" = ")[0] in UNITS}
    assert (set(lines), tuple(lines)[:6]) == (set(GUESSES["differential"]), SIX)
    hints = {name: f"# EDIT: {how}" for name, (_, how) in GUESSES["differential"].items()}
    assert [name for name, line in lines.items() if hints[name] not in line] == ["wheel_radius"]


def test_a_figure_that_it_does_not_have_is_refused():
    assert "no figure 'wheel'; did you mean" in complaint_of(robot_skeleton, "rover", {"wheel": 1.0})
    with pytest.raises(InputError, match="camera_pitch must be at most 45 deg, got 50"):
        robot_skeleton("rover", {"camera_pitch": 50.0})
    assert "mass must be above 0 and finite, got 0" in complaint_of(robot_skeleton, "rover", {"mass": 0.0})


SMALL_CAR = {"wheelbase": 0.17, "wheel_distance": 0.12}
ROAD_CAR = {"wheelbase": 2.6, "wheel_radius": 0.3, "wheel_distance": 1.5, "full_speed": 12.0, "mass": 1200.0}


@pytest.mark.parametrize("figures", [SMALL_CAR, ROAD_CAR], ids=["small", "road"])
def test_both_plants_drive_a_car_of_one_s_own_alike_without_touching_the_floor(tmp_path, figures):
    robot = write(tmp_path, figures, "ackermann")
    check_body(robot)
    commands = np.tile((0.15, 0.5), (180, 1))
    start = np.zeros(3)
    with BulletPlant(robot, start, TICK_S) as bullet, PlanarPlant(start, TICK_S) as planar:
        (poses, hit), (expected, _) = (drive(plant, robot, commands) for plant in (bullet, planar))
    assert not hit
    assert poses[-1, 2] == pytest.approx(expected[-1, 2], rel=0.05)
    assert np.hypot(*(poses[-1] - expected[-1])[:2]) < 0.05 * np.hypot(*expected[-1, :2]) + 0.02
