"""The study of the real car: its yardsticks, and its fit where the recordings are there."""

import sys
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from proxytune.logs import read_log

ROOT = Path(__file__).resolve().parents[1]
STUDY, RECORDINGS = ROOT / "studies" / "real_car", ROOT.parent / "shared" / "data" / "dart"
sys.path.insert(0, str(STUDY))

from yardsticks import STEP_S, Drive, Physics, constant_velocity, fitted_bicycle  # noqa: E402


def circle(speed=1.0, turn=0.5, seconds=6.0):
    heading = turn * np.arange(0.0, seconds, STEP_S)
    poses = np.stack((speed / turn * np.sin(heading), -speed / turn * np.cos(heading), heading), axis=-1)
    return Drive(poses, np.full(len(poses), 0.3), np.full(len(poses), 0.2))


def test_constant_velocity_and_the_bicycle_go_where_they_should():
    drive, starts = circle(), np.array([100])
    predicted = constant_velocity(drive, starts, 100)
    along = predicted[0, :2] - drive.poses[100, :2]
    assert np.hypot(*along) == pytest.approx(1.0, rel=1e-3)
    assert np.arctan2(along[1], along[0]) == pytest.approx(drive.poses[100, 2], abs=1e-3)
    drive, starts = circle(), np.arange(50, 400, 50)
    predicted = fitted_bicycle([drive])(drive, starts, 100)
    assert np.hypot(*(predicted - drive.poses[starts + 100])[:, :2].T).max() < 0.03
    still = Drive(np.zeros((300, 3)), np.full(300, 0.1), np.zeros(300))
    assert np.abs(Physics()(still, np.array([50]), 200)).max() < 1e-6


@pytest.mark.slow
@pytest.mark.skipif(not RECORDINGS.is_dir(), reason="the recordings of DART are not there: see studies/real_car")
def test_effects_beat_the_fitted_bicycle_on_free_driving_kept_aside():
    from real_car import FITTED, START, error, fit, model_of, read

    drives, kept = [read(RECORDINGS, name) for name in FITTED], [read(RECORDINGS, "free_2")]
    found = {name: value for name, (value, _, _) in fit(drives, START, START).items()}
    for horizon in (1.0, 2.0):
        assert error(model_of(found), kept, horizon) < 0.7 * error(fitted_bicycle(drives), kept, horizon)
        assert error(model_of(found), kept, horizon) < error(Physics(), kept, horizon)


def test_a_log_has_every_command_at_its_own_time_and_every_fifth_pose(tmp_path):
    """Commands of rows that are left out would stand in later rows: late by up to four of them."""
    from named import LOGS, write_log

    rows = np.arange(200)
    table = pd.DataFrame(
        {"vicon time": 100.0 + rows / 100.0, "vicon x": rows / 100.0, "vicon y": 0.0, "vicon yaw": 0.0}
    )
    table = table.assign(throttle=0.2 + 0.1 * (rows // 11 % 2), steering=0.0, safety_value=1.0)
    for drive in LOGS["kept"]:
        table.to_csv(tmp_path / f"{drive}.csv", index=False)
    late = write_log(tmp_path, tmp_path, "kept")
    log = read_log(tmp_path / "kept")
    assert [episode.name for episode in log.episodes] == [*LOGS["kept"]]
    for episode in log.episodes:
        np.testing.assert_allclose(episode.issued - episode.times[0], np.arange(0, 200, 11) / 100.0, atol=1e-9)
        assert len(episode.measured.times) == 40
    np.testing.assert_allclose(np.unique(np.round(late, 6)), np.arange(5) / 100.0)
