"""Long rests are cut out of drives; what is driven stays as it was."""

from dataclasses import replace

import numpy as np
import pytest

from proxytune.diagnosis.measured.rests import cut_out_long_rests
from proxytune.logs import Log, LogEpisode, Measured


def log(*told, rows=4000, **more):
    """One drive of 200 s at 20 rows a second, told to move between these times [s]."""
    times = 5.0 + np.arange(rows) / 20.0
    commands = np.zeros((rows, 2))
    for begin, end in told:
        commands[round(begin * 20) : round(end * 20)] = (0.3, 0.2)
    poses = np.stack((times, times, times), axis=1)
    return Log("yard", "duckiebot", "duty", 20.0, {}, (LogEpisode("a", times, commands, poses, commands, **more),))


def test_each_stretch_between_long_rests_is_a_drive_of_its_own():
    whole = log((30.0, 50.0), (60.0, 70.0), (120.0, 150.0))
    first, second = cut_out_long_rests(whole).episodes
    assert (first.name, second.name) == ("a from 34 s", "a from 124 s")
    assert (first.times[0], first.times[-1]) == pytest.approx((34.0, 77.95))
    assert (second.times[0], second.times[-1]) == pytest.approx((124.0, 157.95))
    np.testing.assert_array_equal(first.poses[:, 0], first.times)
    np.testing.assert_array_equal(second.commands, second.wheels)
    np.testing.assert_array_equal(second.commands, whole.episodes[0].commands[2380:3060])


def test_short_rests_are_kept():
    whole = log((10.0, 80.0), (95.0, 190.0))
    assert cut_out_long_rests(whole) is whole


def test_drives_without_commands_to_move_or_without_any_are_left_to_others():
    still, frames = log(), replace(log(), command="none")
    assert cut_out_long_rests(still) is still
    assert cut_out_long_rests(frames) is frames


def test_commands_at_times_of_their_own_go_with_their_stretch():
    whole = log()
    issued = np.array([0.0, 50.0, 60.0, 150.0, 170.0])
    commands = np.array([[0, 0], [0.5, 0.5], [0, 0], [0.2, 0.2], [0, 0]])
    own = replace(whole.episodes[0], issued=issued, commands=commands)
    first, second = cut_out_long_rests(replace(whole, episodes=(own,))).episodes
    np.testing.assert_array_equal(first.issued, [0.0, 50.0, 60.0])
    np.testing.assert_array_equal(second.issued, [60.0, 150.0, 170.0])
    np.testing.assert_array_equal(second.held[[0, -1]], [[0, 0], [0, 0]])
    np.testing.assert_array_equal(second.commands, commands[2:])


def test_poses_at_times_of_their_own_go_with_their_stretch():
    whole = log((30.0, 50.0), (60.0, 70.0), (120.0, 150.0))
    (episode,) = whole.episodes
    rows = np.arange(0, 4000, 3)
    measured = Measured(episode.times[rows] + 0.01, episode.poses[rows], rows)
    own = replace(whole, episodes=(replace(episode, measured=measured),))
    for piece in cut_out_long_rests(own).episodes:
        np.testing.assert_allclose(piece.times[piece.measured.rows] + 0.01, piece.measured.times)
        assert len(piece.measured.times) == pytest.approx(len(piece.times) / 3, abs=1)
