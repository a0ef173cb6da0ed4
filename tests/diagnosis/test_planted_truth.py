"""Six robots with a secret: the effect is named, what has no name is flagged, and nothing is found where nothing is."""

import sys
from pathlib import Path

import pytest

sys.path.append(str(Path(__file__).parent))

import hidden
import rates

CASES = {case.name: case for case in (*hidden.IN_FORM, *hidden.OUTSIDE, *hidden.CLEAN)}


def said_of(name, kind):
    row = rates.diagnosed(rates.Job(kind, CASES[name]), episodes=6, seconds=30.0)
    assert not row.problem, row.text
    return row


@pytest.mark.slow
@pytest.mark.parametrize(
    "name",
    [
        "dead_band width 0.12",
        "turn_slip gain 0.15",
        "yaw_scrub baseline 0.13",
        "dropped_commands probability 0.4",
    ],
)
def test_a_hidden_effect_is_named_and_nothing_else(name):
    row = said_of(name, "in form")
    assert row.right, row.text
    assert not row.wrong, row.text
    assert row.evidence > rates.CLEAR
    assert row.verdict in ("explained", "cannot be told"), "drives so short may not tell how loud their noise is"
    if row.true == row.true:
        assert row.after < 1.15 * row.true < 0.9 * row.before


LATER = [
    "command_quantisation step 0.137",
    "slew_rate rise 0.8",
    "thermal_fade loss 0.6",
    "cross_coupling forward 0.02",
    "cross_coupling turn 0.8",
    "understeer gain 0.5",
    "yaw_lag time_constant 0.1",
    "wheel_ripple left 0.25",
    "slippery_patch loss 0.6",
    "fading_with_time rate 0.4",
    "sliding_slope x -0.04",
    "stiction breakaway 0.2",
]


@pytest.mark.slow
@pytest.mark.parametrize("name", LATER)
def test_an_effect_that_joined_the_catalogue_later_is_named(name):
    row = said_of(name, "in form")
    assert row.right, row.text
    assert row.evidence > rates.CLEAR


@pytest.mark.slow
def test_what_no_catalogue_has_is_flagged():
    row = said_of("carpet", "outside")
    assert row.flagged, row.text
    assert "position" in row.depends_on


def test_nothing_is_found_in_a_clean_log():
    row = said_of("clean 0 normal", "clean")
    assert (row.verdict, row.adopted, row.depends_on) == ("nothing missing", (), ())
    assert row.after == row.before
