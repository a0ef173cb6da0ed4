"""A pose that lies off the way for a sample or two is left out and counted; a drive without such stays what it is."""

from dataclasses import replace

import false_names
import numpy as np
import pytest
from hidden_cases import CLEAN, IN_FORM, make_log

from proxytune.diagnosis import robot_of
from proxytune.diagnosis.motion.drives import gather
from proxytune.logs import LogEpisode, Measured, log_cautions, without_outliers
from proxytune.logs.outliers import outliers

LOG = make_log(CLEAN[0], episodes=2, seconds=30.0)
DRIVE = LOG.episodes[0]


def moved(rows, by):
    poses = DRIVE.poses.copy()
    poses[rows] += by
    return replace(DRIVE, poses=poses)


@pytest.mark.parametrize("rows", [[0], [200], [200, 201], [50, 300, 599]])
@pytest.mark.parametrize("by", [(0.3, -0.2, 0.0), (0.0, 0.0, 2.5)])
def test_poses_that_are_off_for_a_sample_or_two_are_left_out_and_no_others(rows, by):
    off = moved(rows, by)
    assert np.flatnonzero(outliers(off)).tolist() == rows
    left = without_outliers(off).poses
    assert np.isnan(left[rows]).all()
    others = np.delete(np.arange(len(left)), rows)
    np.testing.assert_allclose(left[others], DRIVE.poses[others], atol=1e-12)


@pytest.mark.parametrize("case", [CLEAN[20], *IN_FORM[::9]], ids=lambda case: case.name)
def test_a_drive_without_such_is_itself(case):
    for drive in make_log(case, episodes=2, seconds=30.0).episodes:
        assert without_outliers(drive) is drive


def test_headings_unwrapped_along_a_wrong_one_are_unwrapped_anew_and_own_times_go_with_their_poses():
    wrong = DRIVE.poses.copy()
    wrong[200, 2] += 3.0
    wrong[201:, 2] += 2.0 * np.pi
    left = without_outliers(replace(DRIVE, poses=wrong)).poses
    np.testing.assert_allclose(np.delete(left, 200, 0), np.delete(DRIVE.poses, 200, 0), atol=1e-9)
    rows = np.arange(len(DRIVE.times))
    off = moved([200], (0.4, 0.0, 0.0))
    own = without_outliers(replace(off, measured=Measured(off.times + 0.004, off.poses, rows))).measured
    assert own is not None
    assert own.rows.tolist() == np.delete(rows, 200).tolist()
    np.testing.assert_allclose(own.times, np.delete(off.times, 200) + 0.004)


def test_outliers_are_told_and_nothing_learnt_from_them_but_who_was_carried_is_left_alone():
    log = replace(LOG, episodes=(moved([200, 400], (0.9, 0.0, 0.0)), LOG.episodes[1]))
    robot = robot_of(log)
    (line,) = log_cautions(log, robot.figures)
    assert line.startswith("2 poses lie off the way for a sample or two (most in drive '00', 2)")
    assert np.abs(gather(log, robot, log.episodes).measured[:, :2]).max() < 0.1
    assert not outliers(moved(np.arange(300, 600), (2.0, 0.0, 0.0))).any()
    assert not any(outliers(drive).any() for drive in false_names.make_log("bursts missing", "heavy", 5).episodes)
    few = LogEpisode("few", DRIVE.times[:4], DRIVE.commands[:4], DRIVE.poses[:4], None)
    assert without_outliers(few) is few
