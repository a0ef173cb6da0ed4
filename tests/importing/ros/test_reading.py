"""A bag becomes drives: the same numbers from every storage, several bags as several drives."""

import sqlite3
import tempfile
from pathlib import Path

import bags
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from proxytune.errors import LogError
from proxytune.importing.ros import read_bag
from proxytune.importing.wanted import Wanted

ISSUED = 1.7e9 + np.arange(20) * 0.1
TIMES = 1.7e9 + np.arange(100) * 0.02
TWISTS = np.random.default_rng(1).normal(size=(20, 2))
POSES = np.random.default_rng(2).normal(size=(100, 3))
DRIVE = ((ISSUED, TWISTS), (TIMES, POSES))


@settings(max_examples=5, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(1, 30), st.integers(1, 30))
def test_every_storage_gives_the_same_numbers(seed, commands, poses):
    rng = np.random.default_rng(seed)
    issued, times = (1.7e9 + np.sort(rng.uniform(0.0, 3.0, size)) for size in (commands, poses))
    twists, turns = rng.normal(size=(commands, 2)), rng.normal(size=(poses, 7))
    drives = []
    with tempfile.TemporaryDirectory() as folder:
        for storage in bags.STORAGES:
            bag = Path(folder) / f"{storage}.bag"
            bags.write_bag(bag, storage, (issued, twists), (times, turns), pose_clock_s=0.01)
            drives += read_bag(bag, Wanted()).drives
    for drive in drives:
        assert np.array_equal(drive.commands.values, drives[0].commands.values)
        assert np.array_equal(drive.commands.times, drives[0].commands.times)
        for name in ("times", "places", "headings", "tilts"):
            assert np.array_equal(getattr(drive.poses, name), getattr(drives[0].poses, name))
    assert drives[0].commands.times == pytest.approx(issued, abs=1e-6)
    assert drives[0].poses.times == pytest.approx(times + 0.01, abs=1e-6)
    assert np.array_equal(drives[0].poses.places, turns[:, :3])


@pytest.mark.parametrize("storage", bags.STORAGES)
def test_a_drive_has_commands_as_received_and_poses_as_stamped(tmp_path, storage):
    clocks = {"command_delay_s": 0.03, "pose_clock_s": -0.2, "pose_delay_s": np.linspace(0.0, 0.01, 100)}
    pictures = (ISSUED[:2], np.zeros((2, 4, 5, 3), dtype=np.uint8))
    source = read_bag(bags.write_bag(tmp_path / "run.bag", storage, *DRIVE, pictures, **clocks), Wanted())
    (drive,) = source.drives
    assert drive.name == ("run" if storage == "ros1" else "run.bag")
    assert drive.commands.kind == "twist"
    assert np.array_equal(drive.commands.values, TWISTS)
    assert drive.commands.times == pytest.approx(ISSUED + 0.03, abs=1e-6)
    assert drive.poses.times == pytest.approx(TIMES - 0.2, abs=1e-6)
    assert drive.poses.headings == pytest.approx(POSES[:, 2])
    assert [picture.shape for picture in drive.pictures.read()] == [(4, 5, 3)] * 2
    assert "/cmd_vel has no header: its times are when the bag received each message." in source.notes
    assert any("/pose were received 0.205 s after their stamps" in note for note in source.notes)
    assert [channel.role for channel in source.channels] == ["pictures", "commands", "poses"]


def test_the_bags_times_are_taken_where_asked(tmp_path):
    bag = bags.write_bag(tmp_path / "run", "mcap", *DRIVE, pose_clock_s=-0.2, pose_delay_s=0.01)
    assert read_bag(bag, Wanted(stamps="receive")).drives[0].poses.times == pytest.approx(TIMES + 0.01, abs=1e-6)


def test_bags_of_a_folder_are_drives_and_notes_say_of_which(tmp_path):
    bags.write_bag(tmp_path / "b.bag", "ros1", *DRIVE)
    bags.write_bag(tmp_path / "a", "mcap", *DRIVE, pose_clock_s=0.3)
    source = read_bag(tmp_path, Wanted())
    assert [drive.name for drive in source.drives] == ["a", "b"]
    assert source.form == "2 bags: ROS 1 bag, ROS 2 bag (mcap)"
    assert [channel.count for channel in source.channels] == [40, 200]
    assert [note[:8] for note in source.notes if "clocks differ" in note] == ["a: Messa"]


def test_bags_of_a_folder_share_their_topics(tmp_path):
    """The second bag has no /mocap, so both are read from /pose."""
    both = list(bags.pose_messages(*DRIVE[1])) + list(bags.pose_messages(TIMES, -POSES, topic="/mocap"))
    bags.write_messages(tmp_path / "one.bag", "ros1", [*both, *bags.twist_messages(*DRIVE[0])])
    bags.write_bag(tmp_path / "two.bag", "ros1", *DRIVE)
    for drive in read_bag(tmp_path, Wanted()).drives:
        assert np.array_equal(drive.poses.places[:, 0], POSES[:, 0])


def test_transforms_of_the_first_bag_are_those_of_all(tmp_path):
    for name, child in (("one.bag", "base_link"), ("two.bag", "robot")):
        bags.write_messages(tmp_path / name, "ros1", bags.transform_messages("map", child, POSES, TIMES))
    with pytest.raises(LogError, match="two.bag: /tf: no transforms lead from 'map' to 'base_link'"):
        read_bag(tmp_path, Wanted(commands="none"))


@pytest.mark.parametrize("storage", bags.STORAGES)
def test_a_bag_without_messages_is_told(tmp_path, storage):
    bag = bags.write_messages(tmp_path / "run.bag", storage, [("/cmd_vel", bags.TWIST, 0.0, None)])
    with pytest.raises(LogError, match="run.bag: holds no messages; record it again, or leave it out"):
        read_bag(bag, Wanted())


def test_a_bag_without_definitions_is_read_by_those_of_humble(tmp_path):
    wheels = ("/wheels", "wheel_msgs/msg/WheelsCmdStamped", ISSUED[0], {"vel_left": 1.0})
    messages = [*bags.pose_messages(*DRIVE[1]), *bags.twist_messages(*DRIVE[0]), wheels]
    bag = bags.write_messages(tmp_path / "run", "sqlite3", messages)
    with sqlite3.connect(bag / "run.db3") as table:
        table.execute("UPDATE schema SET schema_version = 3")
    source = read_bag(bag, Wanted())
    assert np.array_equal(source.drives[0].commands.values, TWISTS)
    assert "run does not define its types of message: those of ROS 2 Humble were taken." in source.notes
    assert "does not define wheel_msgs/msg/WheelsCmdStamped" in source.channels[2].role


def test_messages_that_only_the_metadata_know_are_missing(tmp_path):
    bag = bags.write_bag(tmp_path / "run", "sqlite3", *DRIVE)
    with sqlite3.connect(bag / "run.db3") as table:
        table.execute("DELETE FROM messages WHERE topic_id = (SELECT id FROM topics WHERE name = '/pose')")
    with pytest.raises(LogError, match="run: /pose: no messages; take another topic, or leave the bag out"):
        read_bag(bag, Wanted())


def test_several_publishers_of_a_topic_are_one_topic(tmp_path):
    """ROS 1 keeps a connection for each publisher."""
    store, path = bags.typestore("ros1"), tmp_path / "run.bag"
    messages = [*bags.pose_messages(*DRIVE[1]), *bags.twist_messages(*DRIVE[0])]
    with bags.rosbag1.Writer(path) as writer:
        for publisher in ("one", "two"):
            half = messages[publisher == "two" :: 2]
            kinds = dict.fromkeys((topic, kind) for topic, kind, _, _ in half)
            to = {
                topic: writer.add_connection(topic, kind, typestore=store, callerid=publisher) for topic, kind in kinds
            }
            for topic, kind, time, fields in half:
                raw = store.serialize_ros1(bags.make(store, kind, fields), kind)
                writer.write(to[topic], bags.nanoseconds(time), raw)
    (drive,) = read_bag(path, Wanted()).drives
    assert np.array_equal(drive.commands.values, TWISTS)
    assert np.array_equal(drive.poses.places[:, 0], POSES[:, 0])
