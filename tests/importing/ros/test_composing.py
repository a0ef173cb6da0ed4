"""Poses out of transforms: chains are composed, what moves at other times is interpolated."""

import numpy as np
import pytest
from moving_frames import TIMES, circle, moving, read
from scipy.spatial.transform import Rotation

from proxytune.errors import LogError
from proxytune.importing.wanted import Wanted


@pytest.mark.parametrize("storage", ["mcap", "sqlite3"])
def test_a_single_transform_is_the_pose(tmp_path, storage):
    source = read(tmp_path, moving("odom", "base_link", circle()), storage=storage)
    assert source.drives[0].poses.places[:, :2] == pytest.approx(circle()[:, :2])
    assert source.drives[0].poses.times == pytest.approx(TIMES, abs=1e-6)
    assert "Poses of base_link in odom are composed of odom>base_link." in source.notes


def test_static_transforms_on_both_sides_are_composed(tmp_path):
    """The world is turned by a quarter and shifted; the base stands 0.1 m behind the tracked point."""
    world = moving("map", "/odom", [(10.0, 0.0, np.pi / 2)], TIMES[:1], "/tf_static")
    base = moving("tracked", "base_link", [(-0.1, 0.0, 0.0)], TIMES[:1], "/tf_static")
    poses = read(tmp_path, world, base, moving("odom", "tracked", circle())).drives[0].poses
    x, y, heading = circle().T
    x, y = x - 0.1 * np.cos(heading), y - 0.1 * np.sin(heading)
    assert poses.places[:, 0] == pytest.approx(10.0 - y)
    assert poses.places[:, 1] == pytest.approx(x)
    assert np.unwrap(poses.headings) == pytest.approx(heading + np.pi / 2)


def test_a_slower_transform_is_interpolated_within_what_it_covers(tmp_path):
    slow = TIMES[[5, 20, 40]] + 0.03
    drifting = [(0.1 * (time - TIMES[0]), 0.0, 0.0) for time in slow]
    source = read(tmp_path, moving("map", "odom", drifting, slow), moving("odom", "base_link", circle()))
    poses = source.drives[0].poses
    assert poses.times == pytest.approx(TIMES[6:41], abs=1e-6)
    assert any(
        note.endswith("map>odom, odom>base_link; 15 outside of what all of them cover are left out.")
        for note in source.notes
    )
    assert poses.places[:, 0] == pytest.approx(circle()[6:41, 0] + 0.1 * (TIMES[6:41] - TIMES[0]), abs=1e-6)


def test_a_turning_transform_is_interpolated_by_the_shortest_turn(tmp_path):
    slow = TIMES[[0, -1]]
    turning = [(0.0, 0.0, np.pi - 0.1), (0.0, 0.0, -np.pi + 0.1)]
    poses = (
        read(tmp_path, moving("map", "odom", turning, slow), moving("odom", "base_link", circle() * [1, 1, 0]))
        .drives[0]
        .poses
    )
    turned = np.pi - 0.1 + 0.2 * (TIMES - TIMES[0]) / (TIMES[-1] - TIMES[0])
    assert np.unwrap(poses.headings) == pytest.approx(turned, abs=1e-5)


def test_a_tilted_camera_frame_has_a_tilt(tmp_path):
    tilted = Rotation.from_euler("x", 0.3).as_quat()
    mount = moving("base_link", "mast", [(0.0, 0.0, 1.0, *tilted)], TIMES[:1], "/tf_static")
    wanted = Wanted(commands="none", poses="odom>mast")
    poses = read(tmp_path, mount, moving("odom", "base_link", circle()), wanted=wanted).drives[0].poses
    assert poses.tilts == pytest.approx(np.full(50, 0.3))
    assert poses.places[:, 2] == pytest.approx(np.ones(50))
    assert np.unwrap(poses.headings) == pytest.approx(circle()[:, 2])


def test_transforms_at_no_common_time_are_told(tmp_path):
    late = moving("map", "odom", circle()[:9], TIMES[:9] + 100)
    with pytest.raises(LogError, match="the transforms of map>base_link share no time"):
        read(tmp_path, late, moving("odom", "base_link", circle()))


@pytest.mark.parametrize(
    ("row", "words"),
    [((np.nan, 0.0, 0.0), "number 3 is not finite"), ((0.0,) * 7, "orientation 3 is the quaternion")],
)
def test_a_bad_transform_is_told_by_name_and_number(tmp_path, row, words):
    rows = [*circle()[:2], row]
    with pytest.raises(LogError, match=f"transform odom>base_link: {words}"):
        read(tmp_path, moving("odom", "base_link", rows, TIMES[:3]))


def test_a_bad_transform_elsewhere_does_no_harm(tmp_path):
    wheel = moving("base_link", "wheel", [(np.nan, 0.0, 0.0)] * 3, TIMES[:3])
    poses = read(tmp_path, wheel, moving("odom", "base_link", circle())).drives[0].poses
    assert poses.places[:, :2] == pytest.approx(circle()[:, :2])
