"""A drive is told in numbers that are counted, and two clocks show in them."""

from dataclasses import replace

import numpy as np
import pytest
from imported_drives import drive, poses, turning

from proxytune.importing.survey import clock_notes, survey


def test_a_regular_drive_loses_nothing():
    one = survey(drive(np.arange(200) * 0.05, np.arange(100) * 0.1))
    assert (one.poses, one.commands, one.frames, one.gaps) == (200, 100, 0, 0)
    assert (one.seconds, one.poses_hz) == pytest.approx((9.95, 20.0))
    assert (one.lost, one.jitter_s) == pytest.approx((0.0, 0.0), abs=1e-9)


def test_drop_outs_are_counted_apart_from_gaps():
    times = np.delete(np.arange(400) * 0.05, [*range(50, 60), *range(200, 300)])
    one = survey(drive(times, np.arange(200) * 0.1))
    assert (one.gaps, one.longest_gap_s) == (2, pytest.approx(5.05))
    times = np.delete(np.arange(400) * 0.05, [50, 51, 90, 200])
    one = survey(drive(times, np.arange(200) * 0.1))
    assert one.gaps == 0
    assert one.lost == pytest.approx(4 / 400, abs=1e-4)


def test_jitter_is_the_scatter_of_intervals():
    random = np.random.default_rng(1)
    times = np.arange(2000) * 0.05 + random.normal(0.0, 0.002, 2000)
    one = survey(drive(times, np.arange(200) * 0.1))
    assert one.jitter_s == pytest.approx(0.002 * np.sqrt(2.0), rel=0.1)


def test_turning_before_the_command_is_told_as_two_clocks():
    (note,) = clock_notes([survey(turning(-0.25)), survey(turning(0.1))])
    assert note.startswith("1 of 2 drives turn before they are told to (up to 0.25 s, run): two clocks")


def test_turning_after_the_command_is_told_as_a_sum_that_cannot_be_split():
    (note,) = clock_notes([survey(turning(0.1))])
    assert note.startswith("it turns 0.10 s after its commands: delay, lag and an offset")


def test_a_drive_that_does_not_turn_says_nothing_of_clocks():
    straight = replace(turning(0.1), poses=poses(np.arange(0.0, 40.0, 0.02)))
    assert survey(straight).lag_s is None
    assert clock_notes([survey(straight)]) == ["no drive turns enough to tell whether commands and poses share a clock"]
