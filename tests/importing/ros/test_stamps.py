"""Header stamps count where they are dates; clocks that differ or drift are told."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from proxytune.errors import LogError
from proxytune.importing.ros.stamps import Stamps, choose_times, seconds

START_NS = 1_700_000_000 * 10**9
RECEIVE = START_NS + np.arange(100) * 10**7


def both(header_s, receive=RECEIVE):
    return Stamps(receive + np.round(np.asarray(header_s) * 1e9).astype(np.int64), receive)


@given(st.integers(0, 4 * 10**9), st.integers(0, 10**9 - 1))
def test_seconds_keep_the_microsecond(whole, rest):
    assert abs(seconds(np.array([whole * 10**9 + rest]))[0] - whole - rest * 1e-9) < 5e-7


def test_headers_count_unless_the_bags_times_are_asked_for():
    stamps = both(-0.01)
    header, notes = choose_times(stamps, "header", "/pose")
    received, said = choose_times(stamps, "receive", "/pose")
    assert received - header == pytest.approx(0.01, abs=1e-6)
    assert notes == ()
    assert "as asked" in said[0]


@pytest.mark.parametrize("header", [np.zeros(100, dtype=np.int64), np.arange(100) * 10**7], ids=["zero", "1970"])
def test_headers_without_a_date_give_way_to_the_bags_times(header):
    times, notes = choose_times(Stamps(header, RECEIVE), "header", "/pose")
    assert np.array_equal(times, seconds(RECEIVE))
    assert notes == ("Headers of /pose hold no date: its times are when the bag received each message.",)


def test_simulated_time_stays_where_the_bag_counts_it_too():
    header = np.arange(1, 101) * 10**7
    times, notes = choose_times(Stamps(header, header + 10**6), "header", "/pose")
    assert np.array_equal(times, seconds(header))
    assert notes == ()


def test_a_header_without_a_stamp_among_others_is_told_by_number():
    header = RECEIVE.copy()
    header[6] = 0
    with pytest.raises(LogError, match="/pose: the header of message 7 has no time stamp; take --stamps receive"):
        choose_times(Stamps(header, RECEIVE), "header", "/pose")


@pytest.mark.parametrize(
    ("header_s", "words"),
    [(-0.06, "0.060 s after their stamps"), (0.25, "0.250 s before their stamps, in the median: the clocks differ")],
)
def test_clocks_that_differ_are_told(header_s, words):
    (note,) = choose_times(both(header_s), "header", "/pose")[1]
    assert words in note


@pytest.mark.parametrize("drift", [0.04, -0.04])
def test_clocks_that_drift_are_told(drift):
    (note,) = choose_times(both(np.linspace(0, drift, 100)), "header", "/pose")[1]
    assert f"drifts by {0.9e3 * drift:+.0f} ms" in note


def test_unknown_stamps_are_refused():
    with pytest.raises(LogError, match="/pose: unknown stamps 'headers'; did you mean 'header'"):
        choose_times(both(0), "headers", "/pose")
