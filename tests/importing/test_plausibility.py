"""A unit that cannot be is told by import, before anything is written or fitted."""

from dataclasses import replace

import numpy as np
import pytest
from imported_drives import drive, turning

from proxytune.errors import LogError
from proxytune.importing.plausibility import check_units

TIMES = np.arange(0.0, 20.0, 0.05)


def scaled(given, *, time=1.0, place=1.0, command=1.0):
    poses, commands = given.poses, given.commands
    return replace(
        given,
        poses=replace(poses, times=poses.times * time, places=poses.places * place),
        commands=replace(commands, times=commands.times * time, values=commands.values * command),
    )


def slow():
    """Drives at 0.3 m/s and is told so."""
    one = drive(TIMES, TIMES)
    return replace(one, commands=replace(one.commands, values=np.full((len(TIMES), 2), 0.3)))


def test_a_plausible_drive_is_left_alone():
    check_units(slow(), "table")
    check_units(turning(0.1), "table")
    check_units(replace(slow(), commands=None), "table")


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"time": 1e-3}, "takes 0.02 s with 400 poses; state the unit of time"),
        ({"place": 1000.0}, "drives at 300 m/s; state the units of x, y and time"),
        ({"command": 1000.0}, "asks for 300 m/s; state the unit of its commands"),
        ({"place": 100.0}, "the poses say that it drove 594 m where its commands say 5.99 m"),
        ({"place": 0.01}, "the poses say that it drove 0.0594 m where its commands say 5.99 m"),
    ],
)
def test_a_unit_that_cannot_be_is_refused_in_one_line(change, says):
    with pytest.raises(LogError) as caught:
        check_units(scaled(slow(), **change), "table")
    assert says in str(caught.value)
    assert "\n" not in str(caught.value)


def test_wheels_that_turn_too_fast_are_refused():
    one = slow()
    fast = replace(one, commands=replace(one.commands, kind="wheel_speed", values=np.full((len(TIMES), 2), 9000.0)))
    with pytest.raises(LogError, match="asks a wheel for 9e\\+03 rad/s"):
        check_units(fast, "table")


def test_a_robot_that_stands_still_whatever_it_is_told_is_no_matter_of_units():
    one = slow()
    stuck = replace(one, poses=replace(one.poses, places=np.zeros_like(one.poses.places)))
    check_units(stuck, "table")


def test_one_wild_stamp_is_told_before_anything_of_its_size_is_made():
    wild = slow()
    times = np.append(wild.poses.times[:-1], 1.7e9)
    with pytest.raises(LogError, match=r"takes 1.7e\+09 s with 400 poses usually 0.05 s apart"):
        check_units(replace(wild, poses=replace(wild.poses, times=times)), "table")
