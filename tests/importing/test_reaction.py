"""The lag of measured behind commanded turning is found by cross-correlation, of either sign."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from imported_drives import drive, turning

from proxytune.importing.reaction import reaction_of


@settings(max_examples=25, deadline=None)
@given(st.floats(-0.8, 0.8), st.integers(0, 1000))
def test_a_lag_is_found_to_two_hundredths_of_a_second(lag, seed):
    assert reaction_of(turning(lag, seed=seed)).lag_s == pytest.approx(lag, abs=0.02)


def test_a_robot_that_hardly_turns_tells_no_lag():
    still = drive(np.arange(0.0, 30.0, 0.02), np.arange(0.0, 30.0, 0.1))
    assert reaction_of(still) is None


def test_a_drive_without_commands_tells_no_lag():
    assert reaction_of(replace(turning(0.1), commands=None)) is None


def test_turning_that_has_nothing_to_do_with_the_commands_tells_no_lag():
    other = turning(0.0, seed=2)
    assert reaction_of(replace(turning(0.0, seed=1), poses=other.poses)) is None
