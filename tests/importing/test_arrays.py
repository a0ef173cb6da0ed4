"""Arrays of gym-duckietown are known by their names, others by a column map; pickles are refused."""

import numpy as np
import pytest
from drives import HEADINGS, PLACES, ROWS, SPEEDS, TIMES, write_arrays
from one_line import complaint_of

from proxytune.importing import Wanted
from proxytune.importing.arrays import is_arrays, read_arrays

FRAMES = np.arange(ROWS * 2 * 3 * 3, dtype=np.uint64).astype(np.uint8).reshape(ROWS, 2, 3, 3)
OWN = {"positions": None, "angles": None, "actions": None, "state": np.column_stack((PLACES, HEADINGS))}


def read(path, **wanted):
    return read_arrays(path, Wanted(**wanted))


def complaint(path, **wanted):
    complaint = complaint_of(read_arrays, path, Wanted(**wanted))
    assert complaint.startswith(str(path))
    return complaint


def test_arrays_of_gym_duckietown_and_its_simulator_are_duties_and_poses_in_a_map_s_frame(tmp_path):
    source = read(write_arrays(tmp_path))
    (drive,) = source.drives
    assert (source.form, drive.name, drive.commands.kind) == ("numpy arrays", "run1", "duty")
    np.testing.assert_array_equal(drive.poses.times, TIMES)
    np.testing.assert_array_equal(drive.poses.places[:, :2], PLACES)
    np.testing.assert_array_equal(drive.poses.headings, HEADINGS)
    np.testing.assert_array_equal(drive.commands.values, SPEEDS)
    assert "y is -positions[2]" in source.notes[1]
    assert "top left corner" in source.notes[1]
    source = read(write_arrays(tmp_path, map_height=np.array(3.0)))
    np.testing.assert_allclose(source.drives[0].poses.places[:, 1], PLACES[:, 1] + 3.0)
    assert "bottom left corner" in source.notes[1]
    positions = np.column_stack((PLACES[:, 0], np.zeros(ROWS), -PLACES[:, 1]))
    changes = {"positions": None, "angles": None, "cur_pos": positions, "cur_angle": HEADINGS[:, None]}
    np.testing.assert_array_equal(read(write_arrays(tmp_path, **changes)).drives[0].poses.headings, HEADINGS)


def test_frames_are_read_with_their_times_left_out_without_and_in_another_form_refused_when_asked_for(tmp_path):
    source = read(write_arrays(tmp_path, observations=FRAMES))
    pictures = source.drives[0].pictures
    np.testing.assert_array_equal(pictures.times, TIMES)
    np.testing.assert_array_equal(np.stack(list(pictures.read())), FRAMES)
    np.testing.assert_array_equal(np.stack(list(pictures.read())), FRAMES)
    assert source.channels[-1].role == "frames"
    assert read(tmp_path / "run1.npz", frames="none").drives[0].pictures is None

    unknown = np.arange(ROWS) == 2
    arrays = {"timestamps": np.where(unknown, np.nan, TIMES), "observations": FRAMES}
    arrays |= {"positions": np.where(unknown[:, None], np.nan, 1.0) * np.ones(3), "actions": None}
    path = write_arrays(tmp_path, **arrays, angles=np.where(unknown, np.nan, HEADINGS))
    pictures = read(path, commands="none").drives[0].pictures
    np.testing.assert_array_equal(np.stack(list(pictures.read())), FRAMES[~unknown])
    path = write_arrays(tmp_path, observations=FRAMES / 255.0)
    source = read(path)
    assert source.drives[0].pictures is None
    assert source.channels[-1].role.startswith("left out")
    assert "of float64; frames must be (N, rows, columns, 3) of uint8" in complaint(path, frames="observations")
    assert "has no array 'pictures'" in complaint(path, frames="pictures")


def test_our_own_names_need_no_map_and_places_of_one_are_in_the_user_s_own_frame_with_units(tmp_path):
    arrays = {**OWN, "state": None, "x": PLACES[:, 0], "y": PLACES[:, 1], "yaw": HEADINGS, "v": SPEEDS[:, 0]}
    arrays |= {"omega": SPEEDS[:, 1], "episode": np.repeat(["a", "b"], ROWS // 2), "frames": FRAMES}
    first, second = read(write_arrays(tmp_path, **arrays)).drives
    assert (first.name, second.name) == ("a", "b")
    np.testing.assert_array_equal(second.commands.values, SPEEDS[ROWS // 2 :])
    np.testing.assert_array_equal(np.stack(list(second.pictures.read())), FRAMES[ROWS // 2 :])
    arrays = {**OWN, "timestamps": None, "clock": TIMES * 1e3, "wheels": SPEEDS * 60.0}
    columns = {**{"x": "state[0]", "y": "state[1]", "heading": "state[2]"}, "time": "clock:ms"}
    columns |= {f"wheel_command_{side}": f"wheels[{place}]:rpm" for place, side in enumerate(("left", "right"))}
    (drive,) = read(write_arrays(tmp_path, **arrays), columns=columns).drives
    np.testing.assert_allclose(drive.poses.times, TIMES)
    np.testing.assert_array_equal(drive.poses.places[:, :2], PLACES)
    assert drive.commands.kind == "wheel_speed"
    np.testing.assert_allclose(drive.commands.values, SPEEDS * 2 * np.pi)
    columns = {"x": "positions[0]", "y": "positions[2]", "heading": "angles", "left": "actions[0]"}
    source = read(write_arrays(tmp_path), columns={**columns, "right": "actions[1]"})
    np.testing.assert_array_equal(source.drives[0].poses.places[:, 1], -PLACES[:, 1])
    assert len(source.notes) == 1


def test_commands_are_left_out_only_if_asked_for_and_none_need_follow_the_last_pose(tmp_path):
    path = write_arrays(tmp_path, actions=None)
    assert "no column found for left, right" in complaint(path, kind="duty")
    assert "no column found for commands" in complaint(path)
    assert read(path, commands="none").drives[0].commands is None
    assert read(write_arrays(tmp_path, actions=SPEEDS[:7]), commands="none").drives[0].commands is None
    (drive,) = read(write_arrays(tmp_path, actions=SPEEDS[:-1])).drives
    np.testing.assert_array_equal(drive.commands.times, TIMES[:-1])
    assert len(drive.poses.times) == ROWS


@pytest.mark.parametrize(
    ("changes", "wanted", "where"),
    [
        ({"timestamps": None}, {}, "which array (N,) holds the times is not clear; its arrays are: actions (60, 2)"),
        ({"timestamps": np.zeros(ROWS)}, {}, "all 60 stamps are 0 s"),
        ({"timestamps": np.zeros(0)}, {}, "its arrays are empty"),
        ({"actions": SPEEDS * 100}, {}, "is more than full duty; state its unit"),
        ({"actions": SPEEDS[:7]}, {}, "array 'actions' is (7, 2) of float64, but there are 60 times"),
        ({"angles": HEADINGS[:7]}, {}, "array 'angles' is (7,) of float64, but there are 60 times"),
        ({"angles": None}, {"commands": "none"}, "no column found for x, y, heading (or qx, qy, qz, qw)"),
        ({"positions": np.full((ROWS, 3), np.inf)}, {}, "row 1, column"),
        ({"angles": np.full(ROWS, "north")}, {}, "row 1, column 'angles': must be a finite number"),
        (OWN, {"columns": {"x": "state[5]"}}, "has no column 'state[5]'"),
        (OWN, {"columns": {"time": "clock"}}, "say it, as in --columns time=timestamps:s"),
        ({"short": TIMES[:5]}, {"columns": {"x": "short"}}, "array 'short' is (5,) of float64, but there are 60 times"),
        ({}, {"commands": "actions"}, "--columns left=actions[0],right=actions[1]"),
        ({}, {"columns": {"velocity": "v"}}, "unknown name 'velocity'"),
    ],
)
def test_bad_arrays_are_refused(tmp_path, changes, wanted, where):
    assert where in complaint(write_arrays(tmp_path, **changes), **wanted)


def test_arrays_are_known_by_content_and_pickles_and_what_is_no_npz_are_refused(tmp_path):
    objects = write_arrays(tmp_path, extra=np.array([{"a": 1}], dtype=object))
    assert "holds pickled objects; save plain arrays" in complaint(objects)
    for name, content in (("a.npz", b"\x80\x04K\x01."), ("b.npz", b""), ("c.npz", b"PK\x03\x04 rubbish")):
        (tmp_path / name).write_bytes(content)
        assert "savez" in complaint(tmp_path / name)
    np.save(tmp_path / "one.npy", TIMES)
    assert is_arrays(tmp_path / "one.npy")
    assert "no .npz file; save the arrays again" in complaint(tmp_path / "one.npy")
    path = write_arrays(tmp_path)
    assert is_arrays(path)
    assert is_arrays(path.rename(tmp_path / "log.bin"))
    (tmp_path / "a.csv").write_text("x,y\n1,2\n")
    assert not is_arrays(tmp_path / "a.csv")
    assert not is_arrays(tmp_path)
