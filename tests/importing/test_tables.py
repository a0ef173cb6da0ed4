"""CSV files of others, MRCLAM and TUM are read, and every complaint says where and what to do."""

import numpy as np
import pytest
from drives import HEADINGS, PLACES, SPEEDS, TIMES, write_csv, write_mrclam, write_tum
from one_line import complaint_of

from proxytune.importing import Wanted
from proxytune.importing.tables import is_csv_tables, is_mrclam, is_tum, read_csv_tables, read_mrclam, read_tum

POSES = "time,x,y,heading\n0,0,0,0\n0.1,0.1,0,0.1\n0.2,0.2,0,0.2\n"
BOTH = "time,x,y,heading,v,omega\n0,0,0,0,0.5,0\n0.1,0.1,0,0.1,,\n0.2,,,,0.6,0.1\n0.3,0.3,0,0.2,0.6,0.1\n"
COMMANDS = "time,v,omega\n0.01,0.5,0\n0.15,0.6,0.1\n"


@pytest.fixture
def file(write_file):
    return lambda content, name="run1.csv": write_file(content, name)


def read(path, **wanted):
    return read_csv_tables(path, Wanted(**wanted))


def complaint(path, reader=read_csv_tables, **wanted):
    return complaint_of(reader, path, Wanted(**wanted))


def test_columns_are_read_by_their_names_and_what_was_taken_for_what_is_told(tmp_path):
    (drive,) = read(write_csv(tmp_path)).drives
    assert (drive.name, drive.commands.kind) == ("run1", "twist")
    np.testing.assert_allclose(drive.poses.times, TIMES, atol=1e-6)
    np.testing.assert_allclose(drive.poses.places[:, :2], PLACES, atol=1e-9)
    np.testing.assert_allclose(drive.poses.headings, HEADINGS, atol=1e-9)
    np.testing.assert_allclose(drive.commands.values, SPEEDS, atol=1e-9)
    source = read(write_csv(tmp_path))
    assert source.form == "CSV table"
    assert "time from 'stamp_ns' (ns, by its name), x from 'pos_x_mm' (mm, by its name)" in source.notes[0]
    assert "v from 'cmd_lin' (m/s, assumed)" in source.notes[0]
    assert [channel.role for channel in source.channels] == ["time", "x", "y", "heading", "v", "omega"]
    assert {channel.count for channel in source.channels} == {60}


TWICE = (
    "run_no,lap,time,x,y,heading,v,omega,battery\n"
    "7,1,0,0,0,0,0.5,0,9\n7,1,1,0.1,0,0.1,0.5,0,8\n7,1,2,0.2,0,0.1,0.5,0,8\n"
    "8,1,0,0,0,0,0.5,0,8\n8,1,1,0.1,0,0.1,0.5,0,7\n"
)


def test_drives_are_told_apart_by_a_column_or_by_stamps_that_go_back(file):
    source = read(file(TWICE))
    assert [drive.name for drive in source.drives] == ["7", "8"]
    assert "episode from 'run_no'" in source.notes[0]
    told = complaint(file(TWICE.replace("8,1,0,0,0,0", "7,1,0,0,0,0").replace("8,1,1", "7,1,1")))
    assert "line 5, column 'time': stamps go back, as where another drive begins; add a column" in told
    told = complaint(file(TWICE.replace("8,1,0,0", "8,2,0,0").replace("8,1,1", "8,2,1")))
    assert "take run_no or lap, as in --columns episode=run_no" in told
    text = "run,time,x,y,yaw,v,omega\na,0,0,0,0,1,0\na,1,1,0,0,1,0\nb,0,0,0,0,2,0\nb,1,2,0,0,2,0\n"
    first, second = read(file(text)).drives
    assert (first.name, second.name) == ("a", "b")
    np.testing.assert_array_equal(second.commands.values[:, 0], [2.0, 2.0])


def test_commands_may_have_a_second_clock_in_the_same_table_alone(file):
    text = "stamp,cmd_stamp,x,y,heading,v,omega\n"
    text += "0,5.01,0,0,0,0.5,0\n0.1,5.01,0.1,0,0.1,0.5,0\n0.2,5.15,0.2,0,0.1,0.6,0.1\n0.3,5.15,0.3,0,0.1,0.6,0.1\n"
    (drive,) = read(file(text), columns={"command_time": "cmd_stamp:s"}).drives
    np.testing.assert_array_equal(drive.poses.times, [0.0, 0.1, 0.2, 0.3])
    np.testing.assert_array_equal(drive.commands.times, [5.01, 5.15])
    np.testing.assert_array_equal(drive.commands.values, [[0.5, 0.0], [0.6, 0.1]])
    file(COMMANDS, "run1_commands.csv")
    told = complaint(file(POSES), columns={"command_time": "time"})
    assert "command_time is the clock of commands in the same table" in told


def test_rows_may_hold_commands_or_poses_alone_and_stamps_go_backward_and_part_of_a_pose_is_told(file):
    (drive,) = read(file(BOTH)).drives
    np.testing.assert_array_equal(drive.poses.times, [0.0, 0.1, 0.3])
    np.testing.assert_array_equal(drive.commands.times, [0.0, 0.2, 0.3])
    np.testing.assert_array_equal(drive.commands.values, [[0.5, 0.0], [0.6, 0.1], [0.6, 0.1]])
    text = POSES + "0.2,0.2,0,0.2\n0.15,0.3,0,0.3\n"
    np.testing.assert_array_equal(read(file(text), commands="none").drives[0].poses.times, [0, 0.1, 0.2, 0.2, 0.15])
    source = read(file(BOTH.replace("0.1,0.1,0,0.1,,", "0.1,,0,0.1,0.4,0")))
    (drive,) = source.drives
    np.testing.assert_array_equal(drive.poses.times, [0.0, 0.3])
    np.testing.assert_array_equal(drive.commands.times, [0.0, 0.1, 0.2, 0.3])
    said = "run1.csv: 1 row lacks part of a pose (first: line 3, column 'x'); it is left out there, commands are kept."
    assert source.notes[-1] == said


@pytest.mark.parametrize("separator", [";", "\t", " ", ", "])
def test_separators_are_seen(file, separator):
    text = POSES.replace(",", separator) if separator != " " else POSES.replace(",", "   ")
    (drive,) = read(file(text), commands="none").drives
    np.testing.assert_array_equal(drive.poses.places[:, 0], [0.0, 0.1, 0.2])


def test_decimal_commas_comments_and_a_byte_order_mark_are_read_and_a_column_map_goes_before_names(file):
    text = "\ufeff# recorded on Monday\ntime;x;y;heading\n0,0;0;0;0\n# half way\n0,1;0,25;0;0,5\n;;;\n"
    (drive,) = read(file(text), commands="none").drives
    np.testing.assert_array_equal(drive.poses.places[:, 0], [0.0, 0.25])
    np.testing.assert_array_equal(drive.poses.headings, [0.0, 0.5])
    text = "# by numpy\n# time,x,y,heading\n0,0,0,0\n1,1,0,0\n"
    np.testing.assert_array_equal(read(file(text), commands="none").drives[0].poses.times, [0.0, 1.0])
    columns = {"time": "clock:ms", "x": "a:cm", "y": "b:cm", "heading": "c:deg", "v": "d:km/h", "omega": "e:deg/s"}
    text = "clock,a,b,c,d,e,left,right\n0,0,0,90,3.6,90,0,0\n100,10,0,90,3.6,90,0,0\n"
    (drive,) = read(file(text), columns=columns).drives
    np.testing.assert_allclose(drive.poses.times, [0.0, 0.1])
    np.testing.assert_allclose(drive.poses.places[1], [0.1, 0.0, 0.0])
    np.testing.assert_allclose(drive.poses.headings, np.pi / 2)
    np.testing.assert_allclose(drive.commands.values, [[1.0, np.pi / 2]] * 2)
    assert read(file(BOTH), columns={"left": "v", "right": "omega"}).drives[0].commands.kind == "duty"


def test_quaternions_give_headings_and_tilts_and_stamps_since_1970_are_taken_by_their_size(file):
    text = "t,x,y,z,qx,qy,qz,qw\n0,0,0,1,0,0,0,1\n1,1,0,1,0,0,1,1\n2,1,0,1,1,0,0,1\n"
    poses = read(file(text), commands="none").drives[0].poses
    np.testing.assert_allclose(poses.headings, [0.0, np.pi / 2, 0.0])
    np.testing.assert_allclose(poses.tilts, [0.0, 0.0, np.pi / 2], atol=1e-7)
    np.testing.assert_array_equal(poses.places[:, 2], 1.0)
    text = "stamp,x,y,yaw\n1700000000000000000,0,0,0\n1700000000100000000,1,0,0\n"
    source = read(file(text), commands="none")
    np.testing.assert_allclose(source.drives[0].poses.times, [1.7e9, 1.7e9 + 0.1], atol=1e-6)
    assert "(ns, by its size)" in source.notes[0]


BOTH_TURNS = "t,x,y,yaw,qx,qy,qz,qw\n0,0,0,2,0,0,0,1\n1,1,0,2,0,0,0,1\n"


@pytest.mark.parametrize(
    ("columns", "heading", "roles"),
    [({}, 0.0, ["left out", "qx", "qy", "qz", "qw"]), ({"heading": "yaw"}, 2.0, ["heading", *["left out"] * 4])],
)
def test_a_quaternion_goes_before_a_heading_but_not_before_one_that_is_mapped(file, columns, heading, roles):
    source = read(file(BOTH_TURNS), commands="none", columns=columns)
    np.testing.assert_array_equal(source.drives[0].poses.headings, heading)
    assert [channel.role for channel in source.channels][3:] == roles


def test_each_file_of_a_folder_is_a_drive(tmp_path, file):
    file(BOTH, "one.csv"), file(BOTH, "two.csv")
    source = read(tmp_path)
    assert [drive.name for drive in source.drives] == ["one", "two"]
    assert source.form == "folder of CSV files"
    assert len(source.notes) == 1


def test_what_is_alike_in_every_file_of_commands_is_told_once(tmp_path, file):
    for name, commands in (("a", COMMANDS), ("b", COMMANDS), ("c", COMMANDS)):
        file(POSES, f"{name}.csv"), file(commands, f"{name}_commands.csv")
    assert [note.split(":")[0] for note in read(tmp_path).notes] == ["Columns", "Commands of all 3 files"]
    file(COMMANDS.replace("v,omega", "left,right"), "c_commands.csv")
    notes = [note.split(":")[0] for note in read(tmp_path).notes]
    assert notes == ["Columns", "Commands of a_commands.csv, b_commands.csv", "Commands of c_commands.csv"]
    for name in "ab":
        file(LINES, f"{name}.tum")
    assert "Commands of all 2 files" in read_tum(tmp_path, Wanted()).notes[-1]
    for path in tmp_path.glob("*_commands.csv"):
        path.rename(tmp_path / "commands.csv")
    assert "Commands of commands.csv" in read_tum(tmp_path, Wanted()).notes[-1]


@pytest.mark.parametrize("name", ["commands.csv", "cmd_vel.csv", "run1_cmd_vel.csv", "run1_commands.txt"])
def test_commands_beside_the_poses_are_joined(file, name):
    file(COMMANDS, name)
    source = read(file(POSES))
    np.testing.assert_array_equal(source.drives[0].commands.times, [0.01, 0.15])
    assert source.channels[-1].name == f"{name}: omega"
    assert any(note.startswith(f"Commands of {name}: ") for note in source.notes)


def test_files_of_commands_are_named_with_columns_of_their_own(file):
    file(COMMANDS, "joystick.txt")
    (drive,) = read(file(BOTH), commands="joystick.txt").drives
    np.testing.assert_array_equal(drive.commands.times, [0.01, 0.15])
    file("at;lin;ang\n10;0.5;0\n150;0.6;0.1\n", "commands.csv")
    path = file(POSES.replace("time", "clock"))
    columns = {"time": "clock", "v": "lin", "omega": "ang"}
    assert "no column found for time" in complaint(path, columns=columns)
    file("t_ms;lin;ang\n10;0.5;0\n150;0.6;0.1\n", "commands.csv")
    np.testing.assert_allclose(read(path, columns=columns).drives[0].commands.times, [0.01, 0.15])


def test_drives_share_a_file_of_commands_by_time_where_they_do_not_overlap_and_each_must_have_some(tmp_path, file):
    file(POSES, "a.csv")
    file(POSES.replace("\n0", "\n10"), "b.csv")
    file("time,v,omega\n-1,0.1,0\n0.1,0.2,0\n0.5,0.3,0\n10.1,0.4,0\n", "commands.csv")
    first, second = read(tmp_path).drives
    np.testing.assert_array_equal(first.commands.values[:, 0], [0.1, 0.2])
    np.testing.assert_array_equal(second.commands.values[:, 0], [0.3, 0.4])
    file(POSES, "b.csv"), file(COMMANDS, "commands.csv")
    assert "add a column 'episode'" in complaint(tmp_path)
    file("episode,time,v,omega\nb,0,1,0\nb,0.1,1,0\na,0.1,2,0\n", "commands.csv")
    assert [drive.commands.values[0, 0] for drive in read(tmp_path).drives] == [2.0, 1.0]
    file("episode,time,v,omega\nb,0,1,0\nc,0.1,1,0\n", "commands.csv")
    assert "drive 'c' has no poses" in complaint(tmp_path)
    file(POSES.replace("\n0", "\n10"), "b.csv")
    commands = file("episode,time,v,omega\nb,0,1,0\nb,0.1,1,0\n", "commands.csv")
    assert complaint(tmp_path) == (f"{commands}: has no commands for drive 'a'; add them, or leave its poses out")
    file("time,v,omega\n5,1,0\n10.1,1,0\n", "commands.csv")
    assert "has no command while 'a' was driven, 0 to 0.2 s; check that" in complaint(tmp_path)


def test_tables_and_trajectories_go_without_commands_only_if_asked_for(file):
    assert "leave them out (--commands none)" in complaint(file(POSES))
    assert read(file(POSES), commands="none").drives[0].commands is None
    assert read(file(BOTH), kind="none").drives[0].commands is None
    path = file(LINES)
    said = complaint(path, read_tum)
    assert "lay run1_commands.csv (time, v, omega) beside it" in said
    assert "--commands none" in said
    assert read_tum(path, Wanted(commands="none")).drives[0].commands is None


@pytest.mark.parametrize(
    ("text", "where", "remedy"),
    [
        ("", "is empty", "a row for each sample"),
        ("time,x,y,heading\n", "no rows", "add one for each sample"),
        (b"\x89PNG\r\n\x1a\n\0\0", "not text", "save it as a text table"),
        ("a\0b,c\n1,2\n", "binary", "save it as a text table"),
        (POSES + "0.3,1,2\n", "line 5: has 3 cells, but there are 4 columns", "correct that line"),
        (POSES.replace("0.2,0,0.2", "0.2,oops,0.2"), "line 4, column 'y': must be a finite number", "'oops'"),
        (POSES.replace(",0,0.", ",,0."), "line 3, column 'y': is empty beside time, x, heading", "fill it"),
        ("0,0,0,0\n1,1,1,1\n", "line 1: holds numbers", "add a line of names"),
        ("time,x,x\n1,2,3\n", "names the column 'x' twice", "rename"),
        ("time,x,y\n0,1,2\n1,1,2\n", "no column found for heading (or qx, qy, qz, qw); its columns are: time", "="),
        ("run,time,x,y,yaw\na,0,0,0,0\n,1,1,0,0\n", "line 3, column 'run': is empty", "name the drive"),
        ("time,stamp,x,y,yaw\n0,0,1,2,0\n", "time may be 'time' or 'stamp'", "--columns time=time"),
        ("time,x,y,heading\n0,0,0,0\n0,1,0,0\n0,2,0,0\n", "all 3 stamps are 0 s", "a clock that runs"),
        ("time,x,y,heading\n0,0,0,0\n", "a single pose", "two or more"),
        ("time,x,y,heading\n0,,,\n1,,,\n", "no row with a pose", "give the file"),
        ("time,x,y,qx,qy,qz,qw\n0,0,0,0,0,0,1\n1,0,0,0,0,0,0\n", "orientation 2 is the quaternion (0, 0, 0, 0)", "set"),
        ("time,x,y,yaw_deg\n0,0,0,1.2\n1,1,0,-3\n", "look like radians", "--columns heading=yaw_deg:rad"),
        ("time,x_mm,y_mm,yaw\n0,0,0,0\n1,2.5,0,0\n", "moved 2.5 mm in all", "--columns x=x_mm:m"),
        ("t_ns,x,y,yaw\n0,0,0,0\n0.1,2.5,0,0\n", "rows would be 1e-10 s apart", "--columns time=t_ns:s"),
        ("t,x,y,yaw\n0,0,0,0\n50,1,0,0\n", "rows would be 50 s apart", "--columns time=t:ms"),
        ("t,x,y,yaw\n0,0,0,0\n1,1240,0,0\n", "1240 m from end to end is much", "--columns x=x:mm"),
        ('time,x,y,"yaw\n0,0,0,0\n', "line 1: is not a row of a CSV table", "correct"),
    ],
)
def test_bad_poses_are_refused_with_where_and_what_to_do(file, text, where, remedy):
    path = file(text)
    said = complaint(path, commands="none")
    assert said.startswith(str(path))
    assert where in said
    assert remedy in said


@pytest.mark.parametrize(
    ("text", "where"),
    [
        (BOTH.replace("0.6,0.1\n0.3", ",0.1\n0.3"), "line 4, column 'v': is empty beside time, omega"),
        ("time,x,winkel\n0,0,0\n", "no column found for y, heading"),
        (BOTH.replace("omega", "other"), "no column found for omega"),
        (BOTH.replace("omega", "right").replace("v", "left").replace("0.6", "90"), "90 is more than full duty"),
        ("time,x,y,yaw,v,omega,left,right\n0,0,0,0,0,0,0,0\n", "may be duty or twist; choose one, as in --kind duty"),
        ("time,x,y,yaw,v,omega\n0,0,0,0,,\n1,1,0,0,,\n", "no row with one"),
        ("run,time,x,y,yaw,v,omega\na,0,0,0,0,1,1\na,1,0,0,0,1,1\nb,1,,,,0,0\n", "drive 'b' has commands but no poses"),
    ],
)
def test_bad_commands_are_refused(file, text, where):
    assert where in complaint(file(text))


@pytest.mark.parametrize(
    ("columns", "where"),
    [
        ({"haeding": "yaw"}, "unknown name 'haeding'; did you mean 'heading'?"),
        ({"x": "xx"}, "column map: x=xx: has no column 'xx'"),
        ({"heading": "headin"}, "did you mean 'heading'?"),
        ({"x": "x:parsec"}, "unknown unit 'parsec'; known are: m, mm, cm, km"),
        ({"v": "lin"}, "has no column 'lin'"),
    ],
)
def test_a_bad_column_map_is_refused(file, columns, where):
    assert where in complaint(file(POSES), columns=columns)


def test_missing_files_and_folders_without_any_are_told(tmp_path, file):
    assert "no such file" in complaint(tmp_path / "none.csv")
    assert "no such file of commands" in complaint(file(POSES), commands="other.csv")
    assert "has no CSV file with poses" in complaint(tmp_path, commands="run1.csv")
    assert not is_mrclam(tmp_path)
    assert not is_mrclam(tmp_path / "Robot1_Odometry.dat")


def test_tables_and_trajectories_are_known_by_content(tmp_path, file):
    assert is_csv_tables(file(POSES, "poses.txt"))
    assert is_csv_tables(file("", "empty.csv"))
    assert is_csv_tables(tmp_path)
    assert not is_csv_tables(file("Dear reader,\nthis is prose, and long\n", "notes.txt"))
    assert not is_csv_tables(file(b"\x89PNG\0\0", "picture"))
    assert not is_csv_tables(tmp_path / "missing")
    assert is_tum(file(LINES, "poses.txt"))
    assert is_tum(file("", "empty.tum"))
    assert not is_tum(file("time,x\n1,2\n", "a.csv"))
    assert not is_tum(file("1 2 3\n", "b.txt"))
    assert is_tum(tmp_path), "a folder with such a file"
    assert not is_tum(tmp_path.parent)


def holds_the_drive(source, form, name):
    (drive,) = source.drives
    assert (source.form, drive.name, drive.commands.kind) == (form, name, "twist")
    np.testing.assert_array_equal(drive.poses.times, TIMES)
    np.testing.assert_array_equal(drive.poses.places[:, :2], PLACES)
    np.testing.assert_allclose(drive.poses.headings, HEADINGS, atol=1e-12)
    np.testing.assert_array_equal(drive.commands.values, SPEEDS)


def test_a_robot_s_two_files_are_a_drive(tmp_path):
    source = read_mrclam(write_mrclam(tmp_path), Wanted())
    holds_the_drive(source, "MRCLAM data set", "Robot1")
    assert source.channels[0].name == "Robot1_Groundtruth.dat: time"


def test_either_file_or_a_folder_of_one_robot_will_do_and_of_several_one_is_chosen(tmp_path):
    write_mrclam(tmp_path, "Robot3")
    for path in (tmp_path, tmp_path / "Robot3_Odometry.dat", tmp_path / "Robot3_Groundtruth.dat"):
        assert is_mrclam(path)
        assert read_mrclam(path, Wanted()).drives[0].name == "Robot3"
    write_mrclam(tmp_path, "Robot1"), write_mrclam(tmp_path, "Robot3")
    assert "several robots: Robot1, Robot3; choose one, as in --poses Robot1" in complaint(tmp_path, read_mrclam)
    assert "has no robot 'Robot4'; did you mean" in complaint(tmp_path, read_mrclam, poses="Robot4")
    assert read_mrclam(tmp_path, Wanted(poses="Robot3")).drives[0].name == "Robot3"
    path = write_mrclam(tmp_path)
    (tmp_path / "Robot1_Odometry.dat").unlink()
    assert "Robot1_Odometry.dat: no such file" in complaint(path, read_mrclam)
    assert read_mrclam(path, Wanted(commands="none")).drives[0].commands is None


LINES = "# tracked at 20 Hz\n0 1 2 0 0 0 0 1\n0.05 1 2 0 0 0 0.6 0.8\n"


def test_a_trajectory_and_its_commands_are_read_also_by_names_with_columns_and_units(tmp_path, file):
    source = read_tum(write_tum(tmp_path), Wanted())
    holds_the_drive(source, "TUM trajectory", "run1")
    assert [channel.role for channel in source.channels][:4] == ["time", "x", "y", "z"]
    path = file(LINES)
    file("stamp_ms;l;r\n10;50;-50\n", "joystick.txt")
    columns = {"left": "l:percent", "right": "r:percent"}
    (drive,) = read_tum(path, Wanted(commands="joystick.txt", columns=columns)).drives
    assert drive.commands.kind == "duty"
    np.testing.assert_allclose(drive.commands.times, [0.01])
    np.testing.assert_allclose(drive.commands.values, [[0.5, -0.5]])


@pytest.mark.parametrize(
    ("reader", "text", "where"),
    [
        (read_mrclam, "# Time x y heading\n", "is empty"),
        (read_mrclam, "0 1 2\n", "line 1: has 3 cells, but there are 4 columns: time, x, y, heading"),
        (read_mrclam, "0 1 2 north\n", "line 1, column 'heading': must be a finite number"),
        (read_mrclam, "0 1 2 0\n0 1 3 0\n", "all 2 stamps are 0 s"),
        (read_tum, b"\xff\xfe\x00rubbish", "is not text in UTF-8"),
        (read_tum, LINES + "0.1 1 2\n", "line 4: has 3 cells, but there are 8 columns: time, x, y, z, qx, qy, qz, qw"),
        (read_tum, LINES + "0.1 1 2 0 0 0 0 0\n", "orientation 3 is the quaternion (0, 0, 0, 0), which is no rotation"),
        (read_tum, "0 1 2 0 0 0 0 1\n", "has a single pose"),
        (read_tum, "nan 1 2 0 0 0 0 1\n1 1 2 0 0 0 0 1\n", "line 1, column 'time': is empty beside"),
    ],
)
def test_bad_files_of_a_fixed_form_are_refused(tmp_path, file, reader, text, where):
    path = file(text, write_mrclam(tmp_path).name)
    said = complaint(path, reader, commands="none")
    assert said.startswith(str(path))
    assert where in said


CAR = "time,x,y,heading,gas,servo,switch\n0,0,0,0,0.3,0.5,1\n0.1,0.1,0,0.1,0.3,-0.5,0\n0.2,0.2,0,0.2,0.2,0,1\n"
CAR_MAP = {"throttle": "gas", "steering": "servo", "enabled": "switch"}


def test_a_cars_commands_are_throttle_and_steering_or_speed_and_wheel_angle(file):
    (drive,) = read(file(CAR), columns=CAR_MAP).drives
    assert drive.commands.kind == "ackermann"
    np.testing.assert_array_equal(drive.commands.values, [[0.3, 0.5, 1.0], [0.3, -0.5, 0.0], [0.2, 0.0, 1.0]])
    text = CAR.replace("gas,servo,switch", "speed,steering_angle_deg,switch").replace("0.5", "20")
    (drive,) = read(file(text)).drives
    assert drive.commands.kind == "speed_steering"
    np.testing.assert_allclose(drive.commands.values[0], [0.3, np.radians(20.0)])
    said = complaint(file(CAR), columns={"throttle": "gas"})
    assert "no column found for steering" in said
    assert said.endswith("--columns steering=COLUMN")


@pytest.mark.parametrize(
    ("before", "after", "said"),
    [
        ("0.5,1", "28,1", "28 is more than full duty; if it is the wheels' angle, import a speed"),
        ("0.5,1", "1650,1", "servo pulses are made shares"),
        ("0.3,", "30,", "30 is more than full duty; if it is in percent, --columns throttle=gas:percent"),
    ],
)
def test_throttle_in_percent_and_steering_in_degrees_or_pulses_are_refused(file, before, after, said):
    assert said in complaint(file(CAR.replace(before, after)), columns=CAR_MAP)


RATES = np.array([3.0, -5.0])
COUNTED = {"wheel_left": "l:ticks/64", "wheel_right": "r:ticks/64"}


def counted(first=(0.0, 0.0), around=2.0**60):
    """A table whose wheels turn at RATES and count 64 a turn, from a first count on, in a counter of so many."""
    rows = ["time,x,y,heading,v,omega,l,r"]
    for time in np.arange(0.0, 2.0, 0.1):
        left, right = np.mod(np.round(first + RATES * time * 64.0 / (2.0 * np.pi)), around)
        rows.append(f"{time:.1f},0,0,0,0.5,0,{left:.0f},{right:.0f}")
    return "\n".join(rows) + "\n"


@pytest.mark.parametrize(
    ("first", "around"),
    [((0, 1000), 2.0**60), ((65530, 3), 2.0**16), ((2.0**32 - 5, 40), 2.0**32), ((7e6, 9e6), 2.0**60)],
)
def test_counts_of_wheels_are_speeds_and_a_counter_that_begins_anew_goes_on(file, first, around):
    source = read(file(counted(first, around)), columns=COUNTED)
    (drive,) = source.drives
    np.testing.assert_allclose(drive.wheels.speeds[1:-1].mean(axis=0), RATES, rtol=0.02)
    np.testing.assert_allclose(drive.wheels.speeds, np.tile(RATES, (20, 1)), atol=2.0 * np.pi / 64.0 / 0.1 * 0.51)
    assert "wheel_left from 'l' (ticks/64, stated)" in source.notes[0]


def test_measured_wheel_speeds_have_units_and_may_be_known_in_other_rows_than_poses(file):
    text = "time,x,y,heading,v,omega,l,r\n0,0,0,0,1,0,,\n0.5,,,,,,30,60\n1,1,0,0,1,0,,\n1.5,,,,,,60,60\n2,2,0,0,1,0,,\n"
    (drive,) = read(file(text), columns={"wheel_left": "l:rpm", "wheel_right": "r:rpm"}).drives
    np.testing.assert_allclose(drive.wheels.speeds, [[np.pi, 2.0 * np.pi], [2.0 * np.pi, 2.0 * np.pi]])
    left, right = drive.wheels.at(drive.poses.times)
    np.testing.assert_allclose((left, right), [[np.nan, 1.5 * np.pi, np.nan], [np.nan, 2.0 * np.pi, np.nan]])
    assert read(file(text)).drives[0].wheels is None


@pytest.mark.parametrize(
    ("columns", "said"),
    [
        ({"wheel_left": "l:ticks/64"}, "no column found for wheel_right; its columns are"),
        (
            {"wheel_left": "l", "wheel_right": "r"},
            "whole numbers are more like counts; state its unit, as in --columns",
        ),
        (
            {"wheel_left": "l:ticks/0", "wheel_right": "r"},
            "unknown unit 'ticks/0'; known are: rad/s, deg/s, rpm, ticks",
        ),
        ({"omega": "r:ticks/64"}, "ticks are of a measured wheel, wheel_left or wheel_right"),
        ({"x": "l:ticks/64"}, "'ticks/64' is no unit of length"),
    ],
)
def test_wheels_without_a_partner_or_a_unit_and_ticks_of_something_else_are_refused(file, columns, said):
    assert said in complaint(file(counted()), columns=columns)


def test_a_trajectory_has_no_wheels(tmp_path):
    assert "holds no wheel speeds; write poses" in complaint(write_tum(tmp_path), read_tum, columns=COUNTED)


def test_one_missing_column_is_asked_for_alone(file):
    text = BOTH.replace("v,omega", "cmd_vel_x,cmd_vel_turning")
    assert complaint(file(text)).endswith("say which it is, as in --columns omega=COLUMN")
