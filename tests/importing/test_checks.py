"""Stamps are put in order, units and clocks are checked, and what cannot be mended is refused with what to do."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from imported_drives import drive, turning
from one_line import complaint_of

from proxytune.importing.checks import check_units, checked_drive, lag_of

GRID = np.arange(0.0, 10.0, 0.05)


def test_stamps_in_order_are_kept_others_sorted_and_of_repeated_ones_the_first_pose_and_last_command_kept():
    kept, notes = checked_drive(drive(GRID, GRID), "bag")
    assert notes == []
    np.testing.assert_array_equal(kept.poses.times, GRID)
    np.testing.assert_array_equal(kept.commands.times, GRID)
    times = GRID.copy()
    times[[40, 41]] = times[[41, 40]]
    kept, notes = checked_drive(drive(times, GRID), "bag")
    np.testing.assert_array_equal(kept.poses.times, GRID)
    assert notes == ["drive run: 1 poses came after later ones (by up to 0.05 s); sorted"]
    times = np.append(GRID, GRID[-1])
    given = drive(times, times)
    values = np.arange(2.0 * len(times)).reshape(-1, 2)
    places = np.column_stack((np.arange(len(times)), times * 0, times * 0))
    commands, poses = replace(given.commands, values=values), replace(given.poses, places=places)
    kept, notes = checked_drive(replace(given, commands=commands, poses=poses), "bag")
    assert len(kept.poses.times) == len(kept.commands.times) == len(GRID)
    assert kept.poses.places[-1, 0] == len(GRID) - 1
    np.testing.assert_array_equal(kept.commands.values[-1], values[-1])
    assert [note.split(": ")[1] for note in notes] == [
        "1 poses repeat a stamp; the first of each was kept",
        "1 commands repeat a stamp; the last of each was kept",
    ]


def posed(**changes):
    """A drive with other poses."""
    given = drive(GRID, GRID)
    return replace(given, poses=replace(given.poses, **changes))


SILENT = replace(drive(GRID, GRID).commands, times=np.empty(0), values=np.empty((0, 2)))
UPRIGHT = np.column_stack((np.cos(GRID), 0.001 * GRID, np.sin(GRID)))
LOST = np.where(((GRID >= 0.99) & (GRID < 2.99))[:, None], np.nan, drive(GRID, GRID).poses.places)
BEYOND = {
    "a clock set anew": (drive(np.tile(GRID, 2), GRID), "the stamps of its poses go back by 9.95 s at number 201"),
    "stamps all one": (drive(np.full(50, 7.0), GRID), "only 1 of its poses have a time of their own"),
    "other times": (drive(GRID, GRID + 1.7e9), "two clocks; use --stamps receive"),
    "no commands of its own": (replace(drive(GRID, GRID), commands=SILENT), "has no commands"),
    "on its side": (posed(tilts=np.full(len(GRID), np.pi / 2)), "the robot's z axis lies 90° from the world's"),
    "y up": (posed(places=UPRIGHT), "the world is not z-up"),
    "many poses lost": (posed(places=LOST), "40 of its 200 poses, first number 21, are no pose"),
}


@pytest.mark.parametrize(("given", "says"), BEYOND.values(), ids=BEYOND)
def test_what_cannot_be_mended_is_refused(given, says):
    assert says in complaint_of(checked_drive, given, "bag")


def test_what_is_plausible_is_left_alone_and_what_was_never_set_or_has_no_number_is_told():
    flat = posed(places=np.column_stack((GRID, np.zeros(len(GRID)), 0.01 * np.sin(GRID))))
    assert checked_drive(flat, "bag")[1] == []
    check_units(slow(), "table")
    check_units(turning(0.1), "table")
    check_units(replace(slow(), commands=None), "table")
    one = slow()
    check_units(replace(one, poses=replace(one.poses, places=np.zeros_like(one.poses.places))), "table")
    _, notes = checked_drive(drive(GRID + 2e5, GRID + 2e5), "bag")
    assert any("before the year 2000" in note for note in notes)
    headings = np.zeros(len(GRID))
    headings[[3, 50, 51]] = np.nan
    kept, notes = checked_drive(posed(headings=headings), "bag")
    assert len(kept.poses.times) == len(GRID) - 3
    assert notes == ["drive run: 3 poses without a place or an orientation were left out"]


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


RACING = replace(slow().commands, kind="wheel_speed", values=np.full((len(TIMES), 2), 9000.0))
WILD = replace(slow().poses, times=np.append(TIMES[:-1], 1.7e9))


@pytest.mark.parametrize(
    ("given", "says"),
    [
        (scaled(slow(), time=1e-3), "takes 0.02 s with 400 poses; state the unit of time"),
        (scaled(slow(), place=1000.0), "drives at 300 m/s; state the units of x, y and time"),
        (scaled(slow(), command=1000.0), "asks for 300 m/s; state the unit of its commands"),
        (scaled(slow(), place=100.0), "the poses say that it drove 594 m where its commands say 5.99 m"),
        (scaled(slow(), place=0.01), "the poses say that it drove 0.0594 m where its commands say 5.99 m"),
        (replace(slow(), commands=RACING), "asks a wheel for 9e+03 rad/s"),
        (replace(slow(), poses=WILD), "takes 1.7e+09 s with 400 poses usually 0.05 s apart"),
    ],
)
def test_a_unit_that_cannot_be_is_refused_in_one_line(given, says):
    assert says in complaint_of(check_units, given, "table")


@settings(max_examples=25)
@given(st.floats(-0.8, 0.8), st.integers(0, 1000))
def test_a_lag_is_found_to_two_hundredths_of_a_second(lag, seed):
    assert lag_of(turning(lag, seed=seed)) == pytest.approx(lag, abs=0.02)


STILL = drive(np.arange(0.0, 30.0, 0.02), np.arange(0.0, 30.0, 0.1))
OTHERWISE = replace(turning(0.0, seed=1), poses=turning(0.0, seed=2).poses)


@pytest.mark.parametrize("untold", [STILL, replace(turning(0.1), commands=None), OTHERWISE])
def test_a_drive_that_hardly_turns_or_has_no_commands_or_turns_otherwise_tells_no_lag(untold):
    assert lag_of(untold) is None
