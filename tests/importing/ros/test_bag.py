"""A bag is known by its files, lists its topics, and a damaged one is told in one line."""

import sys

import bags
import numpy as np
import pytest

from proxytune.errors import LogError
from proxytune.importing.ros.bag import bags_in, form_of, is_bag, open_bag
from proxytune.importing.ros.reading import read_bag
from proxytune.importing.wanted import Wanted

TIMES = 1.7e9 + np.arange(30) * 0.1
DRIVE = ((TIMES, np.ones((30, 2))), (TIMES, np.ones((30, 3))))


def stored(folder):
    """The file that holds the messages of a ROS 2 folder."""
    (file,) = (*folder.glob("*.db3"), *folder.glob("*.mcap"))
    return file


@pytest.mark.parametrize("storage", bags.STORAGES)
def test_a_bag_is_known_by_its_file_or_folder(tmp_path, storage):
    bag = bags.write_bag(tmp_path / "run.bag", storage, *DRIVE)
    assert is_bag(bag)
    assert is_bag(bag if bag.is_file() else stored(bag))
    assert is_bag(tmp_path)
    assert bags_in(bag) == {"run" if storage == "ros1" else "run.bag": bag}
    with open_bag(bag) as opened:
        assert len(opened.topics) == 2
    assert form_of(bag) == {"ros1": "ROS 1 bag"}.get(storage, f"ROS 2 bag ({storage})")


def test_other_files_and_folders_are_no_bags(tmp_path):
    (tmp_path / "log.csv").write_text("time,x\n")
    assert not is_bag(tmp_path)
    assert not is_bag(tmp_path / "log.csv")
    assert not is_bag(tmp_path / "missing.bag")


def test_drives_of_a_folder_are_named_by_their_bags(tmp_path):
    for name in ("one", "two"):
        stored(bags.write_bag(tmp_path / name, "mcap", *DRIVE)).parent.joinpath("metadata.yaml").unlink()
    bags.write_bag(tmp_path / "one.bag", "ros1", *DRIVE)
    bags.write_bag(tmp_path / "three", "sqlite3", *DRIVE)
    assert sorted(bags_in(tmp_path)) == ["one", "one.bag", "three", "two"]


@pytest.mark.parametrize("storage", bags.STORAGES)
def test_topics_have_types_and_counts(tmp_path, storage):
    with open_bag(bags.write_bag(tmp_path / "run.bag", storage, *DRIVE)) as bag:
        listed = [(topic.name, topic.kind, topic.count, topic.known) for topic in bag.topics]
    assert listed == [("/cmd_vel", bags.TWIST, 30, True), ("/pose", bags.POSE, 30, True)]


def test_a_missing_bag_is_told(tmp_path):
    with pytest.raises(LogError, match=r"missing.bag: no such file; check the path"):
        bags_in(tmp_path / "missing.bag")
    with pytest.raises(LogError, match="holds no bag"):
        bags_in(tmp_path)


@pytest.mark.parametrize("name", ["run.bag", "run.db3", "run.mcap"])
@pytest.mark.parametrize("content", [b"", b"time,x,y\n" * 99])
def test_a_file_that_is_no_bag_is_told_in_one_line(tmp_path, name, content):
    (tmp_path / name).write_bytes(content)
    with pytest.raises(LogError, match=f"{name}: cannot be read as a bag .*; copy it again, or repair it") as caught:
        read_bag(tmp_path / name, Wanted())
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("text", ["", "rosbag2_bagfile_information: [", "rosbag2_bagfile_information: {version: 99}"])
def test_broken_metadata_are_told_in_one_line(tmp_path, text):
    bag = bags.write_bag(tmp_path / "run", "sqlite3", *DRIVE)
    (bag / "metadata.yaml").write_text(text)
    with pytest.raises(LogError, match="run: cannot be read as a bag .*ros2 bag reindex") as caught:
        read_bag(bag, Wanted())
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("storage", bags.STORAGES)
def test_a_bag_cut_short_anywhere_is_told_in_one_line(tmp_path, storage):
    bag = bags.write_bag(tmp_path / f"run{'.bag' if storage == 'ros1' else ''}", storage, *DRIVE)
    file = bag if bag.is_file() else stored(bag)
    whole = file.read_bytes()
    for length in np.linspace(0, 0.95 * len(whole), 25).astype(int):
        file.write_bytes(whole[:length])
        with pytest.raises(LogError, match="cannot be read") as caught:
            read_bag(bag, Wanted())
        assert "\n" not in str(caught.value), length


@pytest.mark.parametrize("storage", bags.STORAGES)
def test_flipped_bytes_never_raise_anything_else(tmp_path, storage):
    bag = bags.write_bag(tmp_path / f"run{'.bag' if storage == 'ros1' else ''}", storage, *DRIVE)
    file = bag if bag.is_file() else stored(bag)
    whole = np.frombuffer(file.read_bytes(), dtype=np.uint8)
    complaints = []
    for seed in range(25):
        rng = np.random.default_rng(seed)
        damaged = whole.copy()
        damaged[rng.integers(0, len(whole), 20)] = rng.integers(0, 256, 20)
        file.write_bytes(damaged.tobytes())
        try:
            read_bag(bag, Wanted())
        except LogError as problem:
            complaints.append(str(problem))
    assert len(complaints) > 5
    assert all(map(str.isprintable, complaints))


def test_a_message_that_is_not_its_type_is_told_by_number(tmp_path, monkeypatch):
    with open_bag(bags.write_bag(tmp_path / "run", "mcap", *DRIVE)) as bag:
        whole = bag.reader.messages

        def shortened(connections):
            for number, (connection, time, raw) in enumerate(whole(connections=connections)):
                yield connection, time, raw[:-9] if number == 6 else raw

        monkeypatch.setattr(bag.reader, "messages", shortened)
        with pytest.raises(LogError, match=r"run: /pose, message 7: cannot be read \(.*PoseStamped.*\)"):
            list(bag.messages("/pose"))


def test_a_complaint_of_the_library_is_one_line_without_control_characters(tmp_path, monkeypatch):
    def open_badly(self):
        raise OSError("first line\n\x1b[31msecond line")

    bag = bags.write_bag(tmp_path / "run.bag", "ros1", *DRIVE)
    monkeypatch.setattr("rosbags.highlevel.AnyReader.open", open_badly)
    with pytest.raises(LogError, match=r"cannot be read as a bag \(first line \[31msecond line\); copy it again"):
        read_bag(bag, Wanted())


def test_without_the_library_one_line_says_what_to_install(tmp_path, monkeypatch):
    bag = bags.write_bag(tmp_path / "run.bag", "ros1", *DRIVE)
    monkeypatch.setitem(sys.modules, "rosbags.highlevel", None)
    with pytest.raises(LogError, match=r'reading bags needs rosbags; pip install "proxytune\[ros\]"'):
        read_bag(bag, Wanted())
