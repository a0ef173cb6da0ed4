"""What drives from the same commands do not repeat is noise; what they do, a model could predict."""

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

sys.path.append(str(Path(__file__).parent))

from manoeuvres import make_drives
from planted import ROBOT, TRUTH, driven_log

from proxytune.diagnosis.horizon.repeats import compare_repeats
from proxytune.diagnosis.measured.drives import gather


def drives_of(log):
    return gather(log, ROBOT, log.episodes)


def again(times, *, theta=TRUTH, seconds=30.0):
    """Drives of which each manoeuvre is driven so many times."""
    duties, starts = make_drives(3, 2, round(20 * seconds))
    return drives_of(driven_log(theta, np.repeat(duties, times, axis=0), np.repeat(starts, times, axis=0)))


@pytest.mark.parametrize("times", [2, 5])
@pytest.mark.parametrize("horizon_s", [1.0, 2.0])
def test_a_model_that_is_right_misses_only_what_is_not_repeated(times, horizon_s):
    found, apart, part = compare_repeats(again(times), TRUTH, horizon_s)
    assert part == 1.0
    assert 0.003 < apart < 0.03
    assert found.value == pytest.approx(1.0, abs=0.15)
    assert found.interval[0] < 1.0 < found.interval[1] + 0.1


def test_a_model_that_lacks_something_misses_more_than_is_not_repeated():
    found = compare_repeats(again(3, theta={**TRUTH, "yaw_scrub": 0.12}), TRUTH, 2.0).share
    assert found.value < 0.7
    assert found.interval[1] < 0.9


def test_drives_that_end_earlier_are_repeats_as_far_as_they_go():
    duties, starts = make_drives(3, 1, 600)
    log = driven_log(TRUTH, np.repeat(duties, 2, axis=0), np.repeat(starts, 2, axis=0))
    one, other = log.episodes
    short = replace(other, times=other.times[:500], commands=other.commands[:500], poses=other.poses[:500])
    assert compare_repeats(drives_of(replace(log, episodes=(one, short))), TRUTH, 1.0) is not None
    stub = replace(other, times=other.times[:150], commands=other.commands[:150], poses=other.poses[:150])
    assert compare_repeats(drives_of(replace(log, episodes=(one, stub))), TRUTH, 1.0) is None


def test_standing_before_the_first_command_is_no_repeat():
    duties, starts = make_drives(4, 6, 400)
    duties[:, :200] = 0.0
    assert compare_repeats(drives_of(driven_log(TRUTH, duties[:5], starts[:5])), TRUTH, 2.0) is None


@pytest.mark.parametrize(("times", "seconds"), [(1, 30.0), (2, 6.0)])
def test_of_drives_that_are_hardly_repeated_nothing_is_said(times, seconds):
    assert compare_repeats(again(times, seconds=seconds), TRUTH, 2.0) is None


def test_of_a_horizon_without_windows_nothing_is_said():
    assert compare_repeats(again(2, seconds=3.0), TRUTH, 5.0) is None


def test_drives_without_repeats_leave_windows_without_repeats():
    duties, starts = make_drives(3, 2, 600)
    duties, starts = np.concatenate((duties, duties[:1])), np.concatenate((starts, starts[:1]))
    assert 0.3 < compare_repeats(drives_of(driven_log(TRUTH, duties, starts)), TRUTH, 1.0).part < 0.9
