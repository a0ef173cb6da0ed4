"""The MRCLAM data set's own files are read, one robot at a time."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from drives import HEADINGS, PLACES, SPEEDS, TIMES, write_csv, write_mrclam
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from one_line import complaint_of

from proxytune.errors import LogError
from proxytune.importing.tables.csv_tables import read_csv_tables
from proxytune.importing.tables.mrclam import is_mrclam, read_mrclam
from proxytune.importing.wanted import Wanted

LOG = Path(__file__).resolve().parents[3] / "../shared/data/logs/mrclam6_robot1"


def complaint(path, **wanted):
    return complaint_of(read_mrclam, path, Wanted(**wanted))


def test_a_robot_s_two_files_are_a_drive(tmp_path):
    source = read_mrclam(write_mrclam(tmp_path), Wanted())
    (drive,) = source.drives
    assert (source.form, drive.name, drive.commands.kind) == ("MRCLAM data set", "Robot1", "twist")
    np.testing.assert_array_equal(drive.poses.times, TIMES)
    np.testing.assert_array_equal(drive.poses.places[:, :2], PLACES)
    np.testing.assert_array_equal(drive.poses.headings, HEADINGS)
    np.testing.assert_array_equal(drive.commands.values, SPEEDS)
    assert source.channels[0].name == "Robot1_Groundtruth.dat: time"


def test_the_same_drive_as_csv_gives_the_same_arrays(tmp_path):
    (theirs,) = read_mrclam(write_mrclam(tmp_path), Wanted()).drives
    (ours,) = read_csv_tables(write_csv(tmp_path), Wanted()).drives
    np.testing.assert_allclose(theirs.poses.places, ours.poses.places, atol=1e-9)
    np.testing.assert_allclose(theirs.poses.headings, ours.poses.headings, atol=1e-9)
    np.testing.assert_allclose(theirs.commands.times, ours.commands.times, atol=1e-6)
    np.testing.assert_allclose(theirs.commands.values, ours.commands.values, atol=1e-9)


def test_either_file_or_a_folder_of_one_robot_will_do(tmp_path):
    write_mrclam(tmp_path, "Robot3")
    for path in (tmp_path, tmp_path / "Robot3_Odometry.dat", tmp_path / "Robot3_Groundtruth.dat"):
        assert is_mrclam(path)
        assert read_mrclam(path, Wanted()).drives[0].name == "Robot3"


def test_of_several_robots_one_must_be_chosen(tmp_path):
    write_mrclam(tmp_path, "Robot1"), write_mrclam(tmp_path, "Robot3")
    assert "several robots: Robot1, Robot3; choose one, as in --poses Robot1" in complaint(tmp_path)
    assert "has no robot 'Robot4'; did you mean" in complaint(tmp_path, poses="Robot4")
    assert read_mrclam(tmp_path, Wanted(poses="Robot3")).drives[0].name == "Robot3"


def test_commands_may_be_left_out(tmp_path):
    path = write_mrclam(tmp_path)
    (tmp_path / "Robot1_Odometry.dat").unlink()
    assert "Robot1_Odometry.dat: no such file" in complaint(path)
    assert read_mrclam(path, Wanted(commands="none")).drives[0].commands is None


@pytest.mark.parametrize(
    ("text", "where"),
    [
        ("", "is empty"),
        ("# Time x y heading\n", "is empty"),
        ("0 1 2\n", "line 1: has 3 cells, but there are 4 columns: time, x, y, heading"),
        ("0 1 2 north\n", "line 1, column 'heading': must be a finite number"),
        ("0 1 2 0\n0 1 3 0\n", "all 2 stamps are 0 s"),
    ],
)
def test_bad_files_are_refused(tmp_path, text, where):
    path = write_mrclam(tmp_path)
    path.write_text(text)
    said = complaint(tmp_path)
    assert said.startswith(str(path))
    assert where in said


def test_a_folder_without_such_files_is_refused(tmp_path):
    assert not is_mrclam(tmp_path)
    assert not is_mrclam(tmp_path / "Robot1_Odometry.dat")
    assert "has no file such as Robot1_Groundtruth.dat" in complaint(tmp_path)


@settings(max_examples=50, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(place=st.integers(0, 400), value=st.integers(0, 255), end=st.integers(0, 2000))
def test_whatever_happens_to_the_bytes_nothing_but_a_log_error_comes_out(tmp_path, place, value, end):
    path = write_mrclam(tmp_path)
    content = bytearray(path.read_bytes())
    content[place] = value
    path.write_bytes(bytes(content[:end]))
    drives, said = (), ""
    try:
        drives = read_mrclam(tmp_path, Wanted()).drives
    except LogError as problem:
        said = str(problem)
    assert "\n" not in said
    assert all(np.isfinite(drive.poses.places).all() for drive in drives)


@pytest.mark.skipif(not LOG.is_dir(), reason=f"needs measured data in {LOG.parent.name}/{LOG.name}")
def test_a_measured_drive_comes_back_as_it_was(tmp_path):
    rows = pd.read_csv(LOG / "samples.csv").query("episode == 0")
    poses, commands = rows[["time", "x", "y", "heading"]].dropna(), rows[["time", "v", "omega"]]
    poses.to_csv(tmp_path / "Robot1_Groundtruth.dat", sep="\t", header=False, index=False)
    commands.to_csv(tmp_path / "Robot1_Odometry.dat", sep="\t", header=False, index=False)
    (drive,) = read_mrclam(tmp_path, Wanted()).drives
    assert len(drive.poses.times) > 10_000
    np.testing.assert_array_equal(np.column_stack((drive.poses.times, drive.poses.places[:, :2])), poses.iloc[:, :3])
    np.testing.assert_array_equal(drive.poses.headings, poses["heading"])
    np.testing.assert_array_equal(drive.commands.values, commands[["v", "omega"]])
