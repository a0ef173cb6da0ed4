"""TUM trajectories are read with commands from a second file; without them only where that is asked for."""

import numpy as np
import pytest
from drives import HEADINGS, PLACES, SPEEDS, TIMES, write_csv, write_tum
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from one_line import complaint_of

from proxytune.errors import LogError
from proxytune.importing.tables.csv_tables import read_csv_tables
from proxytune.importing.tables.tum import is_tum, read_tum
from proxytune.importing.wanted import Wanted

LINES = "# tracked at 20 Hz\n0 1 2 0 0 0 0 1\n0.05 1 2 0 0 0 0.6 0.8\n"


@pytest.fixture
def file(write_file):
    return lambda content, name="run1.tum": write_file(content, name)


def complaint(path, **wanted):
    return complaint_of(read_tum, path, Wanted(**wanted))


def test_a_trajectory_and_its_commands_are_read(tmp_path):
    source = read_tum(write_tum(tmp_path), Wanted())
    (drive,) = source.drives
    assert (source.form, drive.name, drive.commands.kind) == ("TUM trajectory", "run1", "twist")
    np.testing.assert_array_equal(drive.poses.times, TIMES)
    np.testing.assert_array_equal(drive.poses.places[:, :2], PLACES)
    np.testing.assert_allclose(drive.poses.headings, HEADINGS, atol=1e-12)
    np.testing.assert_array_equal(drive.commands.values, SPEEDS)
    assert [channel.role for channel in source.channels][:4] == ["time", "x", "y", "z"]


def test_the_same_drive_as_csv_gives_the_same_arrays(tmp_path):
    (theirs,) = read_tum(write_tum(tmp_path), Wanted()).drives
    (tmp_path / "run1_commands.csv").unlink()
    (ours,) = read_csv_tables(write_csv(tmp_path), Wanted()).drives
    np.testing.assert_allclose(theirs.poses.times, ours.poses.times, atol=1e-6)
    np.testing.assert_allclose(theirs.poses.places, ours.poses.places, atol=1e-9)
    np.testing.assert_allclose(theirs.poses.headings, ours.poses.headings, atol=1e-9)
    np.testing.assert_allclose(theirs.commands.values, ours.commands.values, atol=1e-9)


def test_commands_may_be_named_with_columns_and_units(file):
    path = file(LINES)
    file("stamp_ms;l;r\n10;50;-50\n", "joystick.txt")
    columns = {"left": "l:percent", "right": "r:percent"}
    (drive,) = read_tum(path, Wanted(commands="joystick.txt", columns=columns)).drives
    assert drive.commands.kind == "duty"
    np.testing.assert_allclose(drive.commands.times, [0.01])
    np.testing.assert_allclose(drive.commands.values, [[0.5, -0.5]])


def test_without_commands_only_if_asked_for(file):
    path = file(LINES)
    said = complaint(path)
    assert "lay run1_commands.csv (time, v, omega) beside it" in said
    assert "--commands none" in said
    assert read_tum(path, Wanted(commands="none")).drives[0].commands is None


def test_tilts_are_kept(file):
    poses = read_tum(file("0 0 0 0 0 0 0 1\n1 0 0 0 0.1 0 0 1\n"), Wanted(commands="none")).drives[0].poses
    np.testing.assert_allclose(poses.tilts, [0.0, 2 * np.arctan(0.1)])


@pytest.mark.parametrize(
    ("text", "where"),
    [
        ("", "is empty"),
        ("# nothing but this\n", "is empty"),
        (b"\xff\xfe\x00rubbish", "is not text in UTF-8"),
        (LINES + "0.1 1 2\n", "line 4: has 3 cells, but there are 8 columns: time, x, y, z, qx, qy, qz, qw"),
        (LINES + "0.1 1 2 up 0 0 0 1\n", "line 4, column 'z': must be a finite number"),
        (LINES + "0.1 1 2 0 0 0 0 0\n", "orientation 3 is the quaternion (0, 0, 0, 0), which is no rotation"),
        ("0 1 2 0 0 0 0 1\n0 2 2 0 0 0 0 1\n", "all 2 stamps are 0 s"),
        ("0 1 2 0 0 0 0 1\n", "has a single pose"),
        ("nan 1 2 0 0 0 0 1\n1 1 2 0 0 0 0 1\n", "line 1, column 'time': is empty beside"),
    ],
)
def test_bad_trajectories_are_refused(file, text, where):
    path = file(text)
    said = complaint(path, commands="none")
    assert said.startswith(str(path))
    assert where in said


def test_bad_commands_are_refused(file):
    path = file(LINES)
    file("time,lin\n0,1\n", "commands.csv")
    assert "no column found for commands (v and omega, or left and right); its columns are: time, lin" in complaint(
        path
    )
    assert "no such file of commands" in complaint(path, commands="elsewhere.csv")
    assert "unknown name 'speed'" in complaint(path, columns={"speed": "lin"})


def test_trajectories_are_known_by_content(file, tmp_path):
    assert is_tum(file(LINES, "poses.txt"))
    assert is_tum(file("", "empty.tum"))
    assert not is_tum(file("time,x\n1,2\n", "a.csv"))
    assert not is_tum(file("1 2 3\n", "b.txt"))
    assert is_tum(tmp_path), "a folder with such a file"
    assert not is_tum(tmp_path.parent)


@settings(max_examples=100, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.data())
def test_whatever_happens_to_the_bytes_nothing_but_a_log_error_comes_out(file, data):
    content = bytearray(LINES.encode())
    for _ in range(data.draw(st.integers(1, 4))):
        content[data.draw(st.integers(0, len(content) - 1))] = data.draw(st.integers(0, 255))
    path = file(bytes(content))
    is_tum(path)
    drives, said = (), ""
    try:
        drives = read_tum(path, Wanted(commands="none")).drives
    except LogError as problem:
        said = str(problem)
    assert "\n" not in said
    assert all(np.isfinite(drive.poses.headings).all() for drive in drives)
