"""Which pair of frames is the robot's pose, and the chain of transforms between two."""

import pytest
from moving_frames import TIMES, circle, moving, read

from proxytune.errors import LogError
from proxytune.importing.wanted import Wanted


def test_map_goes_before_odom_and_namespaces_do_not_matter(tmp_path):
    both = moving("map", "r1/odom", [(5.0, 0.0, 0.0)], TIMES[:1], "/tf_static")
    source = read(tmp_path, both, moving("r1/odom", "r1/base_link", circle()))
    assert any(note.startswith("Poses of r1/base_link in map are") for note in source.notes)


def test_a_transform_of_the_only_thing_that_moves_is_taken(tmp_path):
    source = read(tmp_path, moving("stage", "robot7", circle()))
    assert any(note.startswith("Poses of robot7 in stage are") for note in source.notes)


@pytest.mark.parametrize(
    ("poses", "words"),
    [
        ("", r"run: /tf: no transform is plainly .*; the bag has stage>a, stage>b, b>c \(static\)"),
        ("stage>d", "no transforms lead from 'stage' to 'd'; name a parent and a child by --poses"),
        ("a>stage", "no transforms lead from 'a' to 'stage'"),
        ("b>c", "b>c never moves"),
    ],
)
def test_no_plain_pose_is_told_with_what_there_is(tmp_path, poses, words):
    others = moving("b", "c", [(0.0, 0.0, 0.0)], TIMES[:1] + 1, "/tf_static")
    with pytest.raises(LogError, match=words):
        read(
            tmp_path,
            moving("stage", "a", circle()),
            moving("stage", "b", circle(), TIMES + 0.01),
            others,
            wanted=Wanted(commands="none", poses=poses),
        )


def test_transforms_in_a_circle_end(tmp_path):
    with pytest.raises(LogError, match="no transforms lead from 'c' to 'a'"):
        read(
            tmp_path,
            moving("b", "a", circle()),
            moving("a", "b", circle()),
            wanted=Wanted(commands="none", poses="c>a"),
        )


def test_a_static_transform_published_again_replaces_the_first(tmp_path):
    world = moving("map", "odom", [(7.0, 0.0, 0.0), (10.0, 0.0, 0.0)], TIMES[[0, 30]], "/tf_static")
    poses = read(tmp_path, world, moving("odom", "base_link", circle())).drives[0].poses
    assert poses.places[:, 0] == pytest.approx(10.0 + circle()[:, 0])


def test_a_pair_that_never_moves_is_not_taken(tmp_path):
    dock = moving("map", "dock/base_link", [(1.0, 0.0, 0.0)], TIMES[:1], "/tf_static")
    source = read(tmp_path, dock, moving("odom", "base_link", circle()))
    assert any(note.startswith("Poses of base_link in odom are") for note in source.notes)
