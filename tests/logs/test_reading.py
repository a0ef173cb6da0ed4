"""Logs are read strictly, laid on their grid of times, and every complaint says where and what to do."""

import io
import time
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings, strategies as st
from log_folders import complaint, write_files

from proxytune.errors import LogError
from proxytune.logs import COMMANDS, read_log
from proxytune.logs.reading import read_description
from proxytune.settings import read_settings

TOML = 'format = 1\nname = "yard"\nrobot = "tractor"\ncommand = "twist"\nrate_hz = 10\n'
SAMPLES = "episode,time,x,y,heading\na,5.0,1,2,0\na,5.1,1,2,0\na,5.3,1,2,0\nb,0,0,0,0\nb,0.1,0,0,0\n"
HEADER = "episode,time,v,omega\n"
GOOD = HEADER + "b,0,0.1,0.2\na,5.013,0.5,0.1\na,5.127,0.6,0.2\na,9.5,0.7,0.3\n"


@pytest.fixture
def folder(tmp_path):
    """Writes a log whose commands have times of their own."""

    def write(commands=GOOD, samples=SAMPLES, description=TOML):
        files = {"log.toml": description, "samples.csv": samples, "commands.csv": commands}
        return write_files(tmp_path / "log", files)

    return write


@pytest.fixture
def written(tmp_path):
    """Writes a log whose commands stand beside its poses."""

    def write(samples=ROWS, description=TOML):
        return write_files(tmp_path / "log", {"log.toml": description, "samples.csv": samples})

    return write


def test_the_command_in_force_is_the_newest_at_times_of_its_own(folder):
    first, second = read_log(folder()).episodes
    np.testing.assert_array_equal(first.issued, [5.013, 5.127, 9.5])
    np.testing.assert_array_equal(first.commands, [[0.5, 0.1], [0.6, 0.2], [0.7, 0.3]])
    np.testing.assert_allclose(first.times, [5.0, 5.1, 5.2, 5.3])
    assert np.isnan(first.poses[:, 0]).tolist() == [False, False, True, False]
    np.testing.assert_array_equal(second.issued, [0.0])
    np.testing.assert_array_equal(first.held, [[0, 0], [0.5, 0.1], [0.6, 0.2], [0.6, 0.2]])
    np.testing.assert_array_equal(second.held, [[0.1, 0.2]] * 2)


@pytest.mark.parametrize(
    ("commands", "says"),
    [
        ("", "/commands.csv: is empty"),
        (HEADER, "/commands.csv: has no rows"),
        (b"\xff\xfe\x00", "/commands.csv: is not a CSV file"),
        (GOOD.replace("omega", "yaw"), "/commands.csv: line 1: unknown column 'yaw'"),
        (GOOD.replace(",omega", ""), "/commands.csv: line 1: no column 'omega'; commands of kind 'twist' need "),
        (GOOD.replace("0.6,0.2", "0.6"), "/commands.csv: line 4: has 3 cells"),
        (GOOD.replace("0.6,0.2", "0.6,"), "/commands.csv: line 4, column 'omega': must be a finite number, got ''"),
        (GOOD.replace("5.127", "5.013"), "/commands.csv: line 4, column 'time': 5.013 s does not come after"),
        (GOOD.replace("a,", "c,"), "/commands.csv: line 3, column 'episode': 'c' is not in samples.csv"),
        (GOOD.replace("b,0,0.1,0.2\n", ""), "/samples.csv: line 5, column 'episode': 'b' is not in commands.csv"),
        (GOOD.replace("b,0,", "b,17,"), "/commands.csv: line 2, column 'time': the commands of 'b' lie between 17"),
        (GOOD + "b,0,0,0\n", "/commands.csv: line 6, column 'episode': 'b' comes back after another episode"),
    ],
)
def test_a_mistake_in_commands_is_one_line_with_file_line_and_column(folder, commands, says):
    assert complaint(folder(commands)).startswith(says)


def test_commands_of_another_clock_or_in_both_files_are_refused(folder):
    says = complaint(folder(GOOD.replace("a,5.013", "a,1.013").replace("a,5.127", "a,1.2").replace("a,9.5", "a,1.3")))
    assert "lie between 1.013 and 1.3 s, its poses between 5 and 5.3 s; write both in seconds of one clock" in says
    samples = "episode,time,v,omega,x,y,heading\na,5.0,0,0,1,2,0\na,5.1,0,0,1,2,0\n"
    assert complaint(folder(samples=samples)).startswith("/samples.csv: line 1: unknown column 'v'")
    duty = TOML.replace("twist", "duty")
    says = complaint(folder(GOOD.replace("v,omega", "left,right").replace("0.7,0.3", "0.7,1.3"), description=duty))
    assert says.startswith("/commands.csv: line 5, column 'right': a duty must be between -1 and 1, got 1.3")
    assert "there are no commands" in complaint(folder(description=TOML.replace("twist", "none")))


WRONG = """
command = "cmd_vel"
rate_hz = "fast"
baseline_m = -1
speed = 3

[camera]
frames = "no number.png"
"""


@pytest.fixture
def described(tmp_path):
    def read(text):
        path = tmp_path / "log.toml"
        path.write_text(text, encoding="utf-8")
        return read_description(read_settings(path))[0]

    return read


def test_every_complaint_comes_at_once(described, tmp_path):
    with pytest.raises(LogError) as caught:
        described(WRONG)
    text = str(caught.value)
    assert "\n" not in text
    assert text.startswith(f"{tmp_path / 'log.toml'}: (1) ")
    wanted = ("command: unknown", "rate_hz: must be", "baseline_m: must be", "speed: unknown key", "robot: is missing")
    assert all(part in text for part in wanted), text
    assert "(6) camera.frames: must have the picture's number" in text


def test_a_clock_offset_is_declared_or_fitted_and_nothing_else(described):
    text = 'robot = "r"\ncommand = "twist"\n'
    assert described(text).clock_offset_s is None
    assert described(text + "clock_offset_s = -0.25\n").clock_offset_s == -0.25
    fitted = described(text + 'clock_offset_s = "fit"\n')
    assert (fitted.clock_offset_s, fitted.fit_clock_offset) == (None, True)
    for value in ('"later"', "true", "1e9", "[1]"):
        with pytest.raises(LogError, match="clock_offset_s: must be"):
            described(f"{text}clock_offset_s = {value}\n")


DATA = Path(__file__).resolve().parents[2] / "../shared/data/logs"
BESIDE = "episode,time,v,omega,x,y,heading\n"
WHEELS = BESIDE.strip() + ",wheel_left,wheel_right\n"
ROWS = BESIDE + "a,0.0,0.5,0.1,1,2,0.5\na,0.1,0.6,0.2,1.05,2,0.51\nb,3.0,0,0,0,0,0\nb,3.1,0.1,0,0,0,0\n"


def driven(*, degrees=False, wrapped=False, seconds=60.0, turn=0.5, backwards=False, start=0.0):
    """A log of a drive with a measured pose, 10 rows a second."""
    times = np.arange(0.0, seconds, 0.1)
    heading = start + turn * times * np.sin(times / 7.0)
    speed = -0.3 if backwards else 0.3
    x, y = np.cumsum(0.1 * speed * np.cos(heading)), np.cumsum(0.1 * speed * np.sin(heading))
    heading = np.degrees(heading) if degrees else heading
    half = 180.0 if degrees else np.pi
    heading = (heading + half) % (2 * half) - half if wrapped else heading
    rows = {"episode": "a", "time": times.round(3), "v": speed, "omega": 0.0, "x": x, "y": y, "heading": heading}
    return pd.DataFrame(rows).to_csv(index=False)


def test_what_is_written_is_read_with_its_geometry_missing_rows_hold_the_last_command_and_headings_go_on(written):
    log = read_log(written())
    assert (log.name, log.robot, log.command, log.rate_hz, log.geometry) == ("yard", "tractor", "twist", 10.0, {})
    first, second = log.episodes
    assert (first.name, second.name) == ("a", "b")
    np.testing.assert_array_equal(first.commands, [[0.5, 0.1], [0.6, 0.2]])
    np.testing.assert_array_equal(first.poses, [[1, 2, 0.5], [1.05, 2, 0.51]])
    np.testing.assert_allclose(second.times, [3.0, 3.1])
    assert first.wheels is None
    text = TOML + "wheel_radius_m = 0.05\nbaseline_m = 0.3\nfull_speed_m_s = 1.5\n"
    figures = {"wheel_radius": 0.05, "effective_baseline": 0.3, "full_speed": 1.5}
    assert read_log(written(description=text)).geometry == figures
    rows = "a,5.0,0.5,0.1,1,2,0\na,5.3,0.6,0.2,1,2,0\na,5.4,0.7,0.3,1,2,0\nb,0,1,1,9,9,0\nb,0.2,2,2,9,9,0\n"
    first, second = read_log(written(BESIDE + rows)).episodes
    np.testing.assert_allclose(first.times, [5.0, 5.1, 5.2, 5.3, 5.4])
    np.testing.assert_array_equal(first.commands[:, 0], [0.5, 0.5, 0.5, 0.6, 0.7])
    assert np.isnan(first.poses[:, 0]).tolist() == [False, True, True, False, False]
    np.testing.assert_array_equal(second.commands[:, 0], [1, 1, 2])
    assert np.isnan(second.poses).all(axis=1).tolist() == [False, True, False]
    pieces = ["a,0,0,0,0,0,3.0", "a,0.1,0,0,,,", "a,0.2,0,0,0,0,-3.0", "a,0.5,0,0,0,0,-2.5", "a,0.6,0,0,0,0,2.5"]
    pieces += ["b,0,0,0,0,0,-3", "b,0.1,0,0,0,0,3"]
    first, second = read_log(written(BESIDE + "\n".join(pieces) + "\n")).episodes
    nan, turn = np.nan, 2 * np.pi
    np.testing.assert_allclose(first.poses[:, 2], [3.0, nan, turn - 3.0, nan, nan, turn - 2.5, 2.5])
    np.testing.assert_allclose(second.poses[:, 2], [-3.0, 3.0 - turn])


@pytest.mark.parametrize("command", [kind for kind in COMMANDS if kind != "none"])
def test_each_kind_of_command_has_columns_of_its_own(written, command):
    log = read_log(written(ROWS.replace("v,omega", ",".join(COMMANDS[command])), TOML.replace("twist", command)))
    assert log.command == command
    np.testing.assert_array_equal(log.episodes[0].commands, [[0.5, 0.1], [0.6, 0.2]])


def test_still_frames_need_no_rate_and_no_commands_and_headings_no_course(written):
    description = 'format = 1\nrobot = "duckiebot"\ncommand = "none"\nframes = "frames/%04d.png"\nmap = "small_loop"\n'
    log = read_log(written("episode,time,x,y,heading\n0,0,0.8,1.5,3.2\n0,1.7,1.5,0.5,-1.3\n", description))
    assert (log.name, log.command, log.rate_hz) == ("log", "none", 0.0)
    (episode,) = log.episodes
    assert episode.commands.shape == (2, 0)
    np.testing.assert_array_equal(episode.times, [0, 1.7])
    np.testing.assert_allclose(np.cos(episode.poses[:, 2]), np.cos([3.2, -1.3]))
    rows = pd.read_csv(io.StringIO(driven(degrees=True))).drop(columns=["v", "omega"])
    log = read_log(written(rows.to_csv(index=False), TOML.replace("twist", "none")))
    assert len(log.episodes[0].poses) == len(rows)


@settings(max_examples=30)
@given(kept=st.sets(st.integers(1, 40), min_size=5), jitter=st.floats(-0.02, 0.02))
def test_rows_left_out_change_nothing_of_the_others(tmp_path_factory, kept, jitter):
    steps = [0, *sorted(kept)]
    rows = [f"a,{7 + k / 10 + (jitter if k else 0)},{k},{-k},{k / 50},0,0" for k in steps]
    files = {"log.toml": TOML, "samples.csv": BESIDE + "\n".join(rows) + "\n"}
    (episode,) = read_log(write_files(tmp_path_factory.mktemp("log"), files)).episodes
    np.testing.assert_allclose(episode.times, 7 + np.arange(steps[-1] + 1) / 10)
    np.testing.assert_array_equal(episode.commands[steps, 0], steps)
    assert np.flatnonzero(np.isfinite(episode.poses[:, 0])).tolist() == steps


def test_spreadsheets_marks_are_understood(written):
    spaced = ROWS.replace("a,0.1,0.6", "a , 0.1, 0.6 ").replace("a,0.0,0.5,0.1,1,2,0.5", "a,0.0,0.5,0.1, , , ")
    spaced = spaced.replace("\n", "\r\n").replace("\r\nb,3.0", "\r\n\r\nb,3.0")
    plain = read_log(written(ROWS.replace("a,0.0,0.5,0.1,1,2,0.5", "a,0.0,0.5,0.1,,,")))
    marked = read_log(written(b"\xef\xbb\xbf" + spaced.encode()))
    assert np.isnan(plain.episodes[0].poses[0]).all()
    for one, other in zip(plain.episodes, marked.episodes, strict=True):
        assert one.name == other.name
        np.testing.assert_array_equal(one.poses, other.poses)
        np.testing.assert_array_equal(one.commands, other.commands)


@pytest.mark.parametrize(
    ("change", "says"),
    [
        (("format = 1", "format = 2"), "format: must be between 1 and 1"),
        (('robot = "tractor"\n', ""), "robot: is missing"),
        (('command = "twist"\n', ""), "command: is missing"),
        (('"twist"', '"twists"'), "command: unknown value 'twists'; did you mean 'twist'?"),
        (("rate_hz = 10", "rate_hz = 0"), "rate_hz: must be between 0.01 and 10000"),
        (("rate_hz = 10", 'rate_hz = "10"'), "rate_hz: must be a number"),
        (("rate_hz", "rate_hertz"), "rate_hertz: unknown key; did you mean 'rate_hz'?"),
        (('name = "yard"', "name = 3"), "name: must be text in quotes"),
        (('name = "yard"', "source = 3"), "source: must be text in quotes"),
        (("rate_hz = 10", "rate_hz = 10\nbaseline_m = -0.3"), "baseline_m: must be between"),
        (("rate_hz = 10", 'rate_hz = 10\nmeasured = "yes"'), "measured: must be true or false"),
        (("rate_hz = 10", "rate_hz = "), "is not valid TOML"),
    ],
)
def test_a_mistake_in_log_toml_is_one_line_with_file_and_key(written, change, says):
    assert complaint(written(description=TOML.replace(*change))).startswith(f"/log.toml: {says}")


def test_a_folder_that_is_no_log_is_told_what_is_missing(written, tmp_path):
    home = written()
    assert complaint(tmp_path / "none") == ": no such folder; check the path"
    assert complaint(home / "samples.csv") == ": is a file; give the folder that it lies in"
    (home / "samples.csv").unlink()
    assert complaint(home).startswith("/samples.csv: no such file")
    (home / "samples.csv").mkdir()
    assert complaint(home).startswith("/samples.csv: cannot be read")
    (home / "log.toml").unlink()
    assert complaint(home).startswith("/log.toml: no such file")


@pytest.mark.parametrize(
    ("samples", "says"),
    [
        ("", ": is empty"),
        (BESIDE, ": has no rows"),
        (b"\x89PNG\r\n\x1a\n\xff", ": is not a CSV file"),
        (ROWS.replace("a,0.1,", "a,0.1,7,"), ": line 3: has 8 cells, but the first line names 7"),
        (ROWS.replace(",1.05,2,0.51", ""), ": line 3: has 4 cells, but the first line names 7"),
        (ROWS.replace("a,0.1", '"a,0.1'), ": is not a CSV file"),
        (ROWS.replace(",", ";"), ": line 1: unknown column 'episode;time;v;omega;x;y;heading'; separate columns"),
        (ROWS.replace("omega", "omeg"), ": line 1: unknown column 'omeg'; did you mean 'omega'?"),
        (ROWS.replace("omega", "v"), ": line 1: names the column 'v' twice"),
        (ROWS.replace("heading", "wheel_left"), ": line 1: no column 'heading'"),
        (ROWS.replace("v,omega", "wheel_left,wheel_right"), ": line 1: no column 'v'; commands of kind 'twist' need "),
        (WHEELS.replace(",wheel_right", "") + "a,0,0,0,0,0,0,1\n", ": line 1: no column 'wheel_right'"),
        (ROWS.replace("0.51", "north"), ": line 3, column 'heading': must be a finite number, or empty"),
        (ROWS.replace("0.51", "nan"), ": line 3, column 'heading': must be a finite number, or empty"),
        (ROWS.replace("0.2,1.05", ",1.05"), ": line 3, column 'omega': must be a finite number, got ''"),
        (ROWS.replace("0.2,1.05", "nan,1.05"), ": line 3, column 'omega': must be a finite number, got 'nan'"),
        (ROWS.replace("0.2,1.05", "fast,1.05"), ": line 3, column 'omega': must be a finite number, got 'fast'"),
        (ROWS.replace("\na,0.1", "\n\n\na,noon"), ": line 5, column 'time': must be a finite number, got 'noon'"),
        (ROWS.replace("a,0.1", ",0.1"), ": line 3, column 'episode': is empty"),
        (ROWS.replace("a,0.1", "a,0.0"), ": line 3, column 'time': 0 s does not come after 0 s of the row before; ta"),
        (ROWS.replace("a,0.1", "a,0.13"), ": line 3, column 'time': 0.13 s lies off the grid of 10 Hz"),
        (ROWS + "b,3.11,0,0,,,\n", ": line 6, column 'time': 3.11 s lies off the grid of 10 Hz"),
        (ROWS.replace("b,3.1", "b,3100"), ": line 5, column 'time': the rows cover 30971 samples of 10 Hz with 4 rows"),
        (ROWS + "a,9.0,0,0,0,0,0\n", ": line 6, column 'episode': 'a' comes back after another episode"),
        (ROWS + "c,9.0,0,0,0,0,0\n", ": line 6, column 'episode': 'c' has a single row"),
        (ROWS.replace("1.05,2,0.51", "1.05,,0.51"), ": line 3, column 'y': is empty, but not all of x, y, heading"),
        (WHEELS + "a,0,0,0,0,0,0,3,4\na,0.1,0,0,0,0,0,3,\n", ": line 3, column 'wheel_right': is empty"),
    ],
)
def test_a_mistake_in_samples_is_one_line_with_file_line_and_column(written, samples, says):
    assert complaint(written(samples)).startswith(f"/samples.csv{says}")


def test_duties_and_wheel_speeds_are_read_within_what_they_can_be_and_rows_within_a_quarter_sample(written):
    duty = TOML.replace("twist", "duty")
    samples = ROWS.replace("v,omega", "left,right")
    read_log(written(samples.replace("0.6,0.2", "-1,1.0000001"), duty))
    says = complaint(written(samples.replace("0.6,0.2", "0.6,-1.01"), duty))
    assert says.startswith("/samples.csv: line 3, column 'right': a duty must be between -1 and 1, got -1.01")
    (episode,) = read_log(written(WHEELS + "a,0,0,0,0,0,0,3,4\na,0.1,0,0,0,0,0,,\n")).episodes
    np.testing.assert_array_equal(episode.wheels, [[3, 4], [np.nan, np.nan]])
    (first, _) = read_log(written(ROWS.replace("a,0.1", "a,0.125"))).episodes
    np.testing.assert_allclose(first.times, [0.0, 0.1])
    assert "off the grid" in complaint(written(ROWS.replace("a,0.1", "a,0.126")))


@pytest.mark.parametrize("wrapped", [False, True])
@pytest.mark.parametrize("backwards", [False, True])
@pytest.mark.parametrize("turn", [0.02, 0.1, 0.5])
def test_headings_in_degrees_are_found_out_and_radians_are_not(written, turn, backwards, wrapped):
    drive = {"turn": turn, "backwards": backwards, "wrapped": wrapped, "seconds": 120.0}
    read_log(written(driven(**drive)))
    says = complaint(written(driven(**drive, degrees=True)))
    assert "column 'heading'" in says
    assert "look like degrees; write headings in radians" in says


@pytest.mark.parametrize(("turn", "start"), [(0.0, 0.3), (0.0, 1.5708), (0.0, 3.0), (0.0015, 0.0)])
def test_degrees_of_a_drive_that_hardly_turns_are_found_out(written, turn, start):
    read_log(written(driven(turn=turn, start=start)))
    assert "look like degrees" in complaint(written(driven(turn=turn, start=start, degrees=True)))


@pytest.mark.parametrize("off", [30.0, 1e4])
def test_a_place_that_is_far_off_makes_no_degrees_of_radians(written, off):
    table = pd.read_csv(io.StringIO(driven(turn=1.0, start=0.2)))
    for row in range(60, 600, 60):
        read_log(written(table.assign(x=table["x"].where(table.index != row, off)).to_csv(index=False)))
    far = pd.read_csv(io.StringIO(driven(turn=1.0, start=0.2, degrees=True)))
    far.loc[300, "x"] = off
    assert "look like degrees" in complaint(written(far.to_csv(index=False)))


def test_degrees_are_told_from_counted_turns_and_headings_askew(written):
    samples = BESIDE + "a,0,0,1,1,1,365\na,0.1,0,1,1,1,365.1\nb,0,0,1,1,1,5\nb,0.1,0,1,1,1,5.1\n"
    np.testing.assert_allclose(read_log(written(samples)).episodes[1].poses[:, 2], [5, 5.1])
    rows = [f"a,{k / 10},0,1,1,1,{(k * 15 + 180) % 360 - 180}" for k in range(60)]
    assert "look like degrees" in complaint(written(BESIDE + "\n".join(rows) + "\n"))
    table = pd.read_csv(io.StringIO(driven(turn=1.0)))
    for askew in (0.5, np.pi / 2, -2.0):
        read_log(written(table.assign(heading=table["heading"] + askew).to_csv(index=False)))


@pytest.mark.skipif(not DATA.is_dir(), reason="needs measured data in shared/data/logs")
@pytest.mark.parametrize(
    ("name", "command", "episodes", "rows", "without_pose"),
    [
        ("drive_husky", "wheel_speed", 603, 24120, 0),
        ("gym_duckietown", "duty", 12, 7200, 0),
        ("gym_duckietown_frames", "none", 1, 120, 0),
        ("mrclam6_robot1", "twist", 1, 18996, 15),
        ("mrclam6_robot2", "twist", 1, 22154, 35),
        ("mrclam6_robot4", "twist", 1, 22102, 98),
    ],
)
def test_measured_logs_are_read_whole_and_quickly(name, command, episodes, rows, without_pose):
    began = time.process_time()
    log = read_log(DATA / name)
    assert time.process_time() - began < 1.0
    assert (log.name, log.command, len(log.episodes)) == (name, command, episodes)
    assert sum(len(episode.times) for episode in log.episodes) == rows
    assert sum(int(np.isnan(episode.poses[:, 0]).sum()) for episode in log.episodes) == without_pose
    table = pd.read_csv(DATA / name / "samples.csv")
    np.testing.assert_allclose(np.concatenate([e.times for e in log.episodes]), table["time"], atol=1e-6)
    np.testing.assert_array_equal(np.concatenate([e.commands for e in log.episodes]), table[list(COMMANDS[command])])
    poses = np.concatenate([e.poses for e in log.episodes])
    np.testing.assert_array_equal(poses[:, :2], table[["x", "y"]])
    np.testing.assert_allclose(np.cos(poses[:, 2]), np.cos(table["heading"]), atol=1e-12)


@pytest.mark.skipif(not DATA.is_dir(), reason="needs measured data in shared/data/logs")
@pytest.mark.parametrize("name", ["gym_duckietown", "mrclam6_robot1"])
def test_measured_logs_in_degrees_are_found_out(written, name):
    table = pd.read_csv(DATA / name / "samples.csv")
    turned = table.assign(heading=np.degrees(table["heading"])).to_csv(index=False)
    assert "look like degrees" in complaint(written(turned, (DATA / name / "log.toml").read_text()))


CAR = "episode,time,x,y,heading,throttle,steering,enabled\na,0,0,0,0,0.3,0.5,0\na,0.1,0,0,0,0.4,-1,1\n"


@pytest.mark.parametrize(("kind", "first"), [("ackermann", [0.0, 0.5]), ("duty", [0.0, 0.0])])
def test_the_switch_cuts_both_wheels_or_a_car_s_motor_and_leaves_its_steering(written, kind, first):
    samples = CAR.replace("throttle,steering", ",".join(COMMANDS[kind]))
    (episode,) = read_log(written(samples, TOML.replace("twist", kind))).episodes
    np.testing.assert_array_equal(episode.commands, [first, [0.4, -1.0]])


@pytest.mark.parametrize(
    ("before", "after", "kind", "said"),
    [
        ("0.5,0", "28,0", "ackermann", "column 'steering': steering must be between -1 and 1, got 28; divide degrees"),
        ("0.3,", "30,", "ackermann", "column 'throttle': throttle must be between -1 and 1, got 30; divide a percent"),
        ("0.5,0", "0.5,7", "ackermann", "column 'enabled': must be 1 (motors on) or 0 (cut), got 7"),
        ("0.5,0", "28,0", "speed_steering", "turn degrees into"),
    ],
)
def test_what_no_car_can_be_told_is_refused_with_its_cell(written, before, after, kind, said):
    rows = CAR.replace("throttle,steering", ",".join(COMMANDS[kind])).replace(before, after)
    told = complaint(written(rows, TOML.replace("twist", kind)))
    assert told.startswith("/samples.csv: line 2")
    assert said in told
