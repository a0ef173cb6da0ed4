"""Logs of robots without a secret differ by noise and by what is wrong with their tracker, and in nothing else."""

import false_names
import numpy as np
import pytest


def poses(tracker, noise="white", number=0):
    return np.stack([drive.poses for drive in false_names.make_log(tracker, noise, number).episodes])


@pytest.mark.parametrize("noise", false_names.NOISES)
def test_a_log_is_a_function_of_its_number(noise):
    np.testing.assert_array_equal(poses("nothing else", noise), poses("nothing else", noise))
    assert not np.array_equal(poses("nothing else", noise), poses("nothing else", noise, 1))


@pytest.mark.parametrize("tracker", false_names.TRACKERS)
def test_every_tracker_spoils_what_it_says(tracker):
    random, times = np.random.default_rng(1), np.arange(800) * false_names.ROW_S
    way = np.broadcast_to(times[:, None] * (0.3, 0.1, 0.2), (6, 800, 3))
    seen = false_names.TRACKERS[tracker](random, times, way, np.zeros(way.shape))
    away = np.abs(seen - way)
    share = {
        "nothing else": np.nanmean(away > 0.0) == 0.0,
        "clock drifts": np.nanmax(away[:, -20:, 0]) > 0.3 * 0.035 > 10.0 * np.nanmax(away[:, 1:5, 0]),
        "clock jumps": ((away > 1e-9).any(axis=(1, 2)).sum() == 1) and 0.2 < (away[..., 0] > 1e-9).sum() / 800 < 0.8,
        "bursts missing": 0.03 < np.isnan(seen[..., 0]).mean() < 0.3,
        "outliers": 0.005 < (away[..., 0] > 0.0).mean() < 0.015,
        "lagging": 0.3 * 0.01 < np.median(away[..., 0]) < 0.3 * 0.1,
    }
    assert share[tracker]


@pytest.mark.slow
@pytest.mark.parametrize("tracker", ["nothing else", "clock drifts", "clock jumps", "outliers"])
def test_nothing_is_found_where_nothing_is(tracker):
    row = false_names.diagnosed(tracker, "heavy", 0)
    assert row["names"] == []
    assert row["verdict"] in ("nothing missing", "cannot be told")
