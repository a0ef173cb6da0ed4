"""Logs are read strictly, laid on their grid of times, and every complaint says where and what to do."""

import io
import time
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from log_folders import complaint, write_files

from proxytune.logs import COMMANDS, read_log

DATA = Path(__file__).resolve().parents[2] / "../shared/data/logs"
TWIST = 'format = 1\nname = "yard"\nrobot = "tractor"\ncommand = "twist"\nrate_hz = 10\n'
HEADER = "episode,time,v,omega,x,y,heading\n"
GOOD = HEADER + "a,0.0,0.5,0.1,1,2,0.5\na,0.1,0.6,0.2,1.05,2,0.51\nb,3.0,0,0,0,0,0\nb,3.1,0.1,0,0,0,0\n"


@pytest.fixture
def folder(tmp_path):
    def write(samples=GOOD, description=TWIST):
        return write_files(tmp_path / "log", {"log.toml": description, "samples.csv": samples})

    return write


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


def test_commands_poses_and_times_are_read_as_written(folder):
    log = read_log(folder())
    assert (log.name, log.robot, log.command, log.rate_hz, log.geometry) == ("yard", "tractor", "twist", 10.0, {})
    first, second = log.episodes
    assert (first.name, second.name) == ("a", "b")
    np.testing.assert_array_equal(first.commands, [[0.5, 0.1], [0.6, 0.2]])
    np.testing.assert_array_equal(first.poses, [[1, 2, 0.5], [1.05, 2, 0.51]])
    np.testing.assert_allclose(second.times, [3.0, 3.1])
    assert first.wheels is None


def test_geometry_of_the_log_is_in_the_figures_of_a_robot(folder):
    text = TWIST + "wheel_radius_m = 0.05\nbaseline_m = 0.3\nfull_speed_m_s = 1.5\n"
    figures = {"wheel_radius": 0.05, "effective_baseline": 0.3, "full_speed": 1.5}
    assert read_log(folder(description=text)).geometry == figures


@pytest.mark.parametrize("command", [kind for kind in COMMANDS if kind != "none"])
def test_each_kind_of_command_has_columns_of_its_own(folder, command):
    samples = GOOD.replace("v,omega", ",".join(COMMANDS[command]))
    log = read_log(folder(samples, TWIST.replace("twist", command)))
    assert log.command == command
    np.testing.assert_array_equal(log.episodes[0].commands, [[0.5, 0.1], [0.6, 0.2]])


def test_measured_wheel_speeds_are_read_and_may_be_empty(folder):
    samples = HEADER.strip() + ",wheel_left,wheel_right\na,0,0,0,0,0,0,3,4\na,0.1,0,0,0,0,0,,\n"
    (episode,) = read_log(folder(samples)).episodes
    np.testing.assert_array_equal(episode.wheels, [[3, 4], [np.nan, np.nan]])


def test_still_frames_need_no_rate_and_no_commands(folder):
    description = 'format = 1\nrobot = "duckiebot"\ncommand = "none"\nframes = "frames/%04d.png"\nmap = "small_loop"\n'
    samples = "episode,time,x,y,heading\n0,0,0.8,1.5,3.2\n0,1.7,1.5,0.5,-1.3\n"
    log = read_log(folder(samples, description))
    assert (log.name, log.command, log.rate_hz) == ("log", "none", 0.0)
    (episode,) = log.episodes
    assert episode.commands.shape == (2, 0)
    np.testing.assert_array_equal(episode.times, [0, 1.7])
    np.testing.assert_allclose(np.cos(episode.poses[:, 2]), np.cos([3.2, -1.3]))


def test_headings_of_still_frames_are_not_compared_with_a_course(folder):
    rows = pd.read_csv(io.StringIO(driven(degrees=True))).drop(columns=["v", "omega"])
    log = read_log(folder(rows.to_csv(index=False), TWIST.replace("twist", "none")))
    assert len(log.episodes[0].poses) == len(rows)


def test_missing_rows_hold_the_last_command_and_have_no_pose(folder):
    samples = HEADER + "a,5.0,0.5,0.1,1,2,0\na,5.3,0.6,0.2,1,2,0\na,5.4,0.7,0.3,1,2,0\nb,0,1,1,9,9,0\nb,0.2,2,2,9,9,0\n"
    first, second = read_log(folder(samples)).episodes
    np.testing.assert_allclose(first.times, [5.0, 5.1, 5.2, 5.3, 5.4])
    np.testing.assert_array_equal(first.commands[:, 0], [0.5, 0.5, 0.5, 0.6, 0.7])
    assert np.isnan(first.poses[:, 0]).tolist() == [False, True, True, False, False]
    np.testing.assert_array_equal(second.commands[:, 0], [1, 1, 2])
    assert np.isnan(second.poses).all(axis=1).tolist() == [False, True, False]


@settings(derandomize=True, deadline=None, max_examples=30)
@given(kept=st.sets(st.integers(1, 40), min_size=5), jitter=st.floats(-0.02, 0.02))
def test_rows_left_out_change_nothing_of_the_others(tmp_path_factory, kept, jitter):
    steps = [0, *sorted(kept)]
    rows = [f"a,{7 + k / 10 + (jitter if k else 0)},{k},{-k},{k / 50},0,0" for k in steps]
    home = tmp_path_factory.mktemp("log")
    (home / "log.toml").write_text(TWIST, encoding="utf-8")
    (home / "samples.csv").write_text(HEADER + "\n".join(rows) + "\n", encoding="utf-8")
    (episode,) = read_log(home).episodes
    np.testing.assert_allclose(episode.times, 7 + np.arange(steps[-1] + 1) / 10)
    np.testing.assert_array_equal(episode.commands[steps, 0], steps)
    assert np.flatnonzero(np.isfinite(episode.poses[:, 0])).tolist() == steps


def test_wrapped_headings_are_unwrapped_across_gaps_and_episodes_stay_apart(folder):
    pieces = ["a,0,0,0,0,0,3.0", "a,0.1,0,0,,,", "a,0.2,0,0,0,0,-3.0", "a,0.5,0,0,0,0,-2.5", "a,0.6,0,0,0,0,2.5"]
    first, second = read_log(folder(HEADER + "\n".join([*pieces, "b,0,0,0,0,0,-3", "b,0.1,0,0,0,0,3"]) + "\n")).episodes
    nan, turn = np.nan, 2 * np.pi
    np.testing.assert_allclose(first.poses[:, 2], [3.0, nan, turn - 3.0, nan, nan, turn - 2.5, 2.5])
    np.testing.assert_allclose(second.poses[:, 2], [-3.0, 3.0 - turn])


def test_a_wrapped_heading_reads_as_the_unwrapped_one(folder):
    smooth = read_log(folder(driven(turn=1.5))).episodes[0].poses
    assert np.ptp(smooth[:, 2]) > 10
    np.testing.assert_allclose(read_log(folder(driven(turn=1.5, wrapped=True))).episodes[0].poses, smooth, atol=1e-9)


def test_spreadsheets_marks_are_understood(folder):
    spaced = (
        GOOD.replace("a,0.1,0.6", "a , 0.1, 0.6 ")
        .replace("a,0.0,0.5,0.1,1,2,0.5", "a,0.0,0.5,0.1, , , ")
        .replace("\n", "\r\n")
        .replace("\r\nb,3.0", "\r\n\r\nb,3.0")
    )
    plain = read_log(folder(GOOD.replace("a,0.0,0.5,0.1,1,2,0.5", "a,0.0,0.5,0.1,,,")))
    marked = read_log(folder(b"\xef\xbb\xbf" + spaced.encode()))
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
def test_a_mistake_in_log_toml_is_one_line_with_file_and_key(folder, change, says):
    assert complaint(folder(description=TWIST.replace(*change))).startswith(f"/log.toml: {says}")


def test_a_folder_that_is_no_log_is_told_what_is_missing(folder, tmp_path):
    home = folder()
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
        (HEADER, ": has no rows"),
        (HEADER + "\n\n", ": has no rows"),
        (b"\x89PNG\r\n\x1a\n\xff", ": is not a CSV file"),
        (GOOD.replace("a,0.1,", "a,0.1,7,"), ": line 3: has 8 cells, but the first line names 7"),
        (GOOD.replace("a,0.1,0.6,0.2,1.05,2,0.51", "a,0.1,0.6"), ": line 3: has 3 cells, but the first line names 7"),
        (GOOD.replace(",1.05,2,0.51", ""), ": line 3: has 4 cells, but the first line names 7"),
        (GOOD.replace("a,0.1", '"a,0.1'), ": is not a CSV file"),
        (GOOD.replace(",", ";"), ": line 1: unknown column 'episode;time;v;omega;x;y;heading'"),
        (GOOD.replace("omega", "omeg"), ": line 1: unknown column 'omeg'; did you mean 'omega'?"),
        (GOOD.replace("omega", "v"), ": line 1: names the column 'v' twice"),
        (GOOD.replace("heading", "wheel_left"), ": line 1: no column 'heading'"),
        (GOOD.replace("v,omega", "wheel_left,wheel_right"), ": line 1: no column 'v'; commands of kind 'twist' need "),
        (HEADER.replace("\n", ",wheel_left\n") + "a,0,0,0,0,0,0,1\n", ": line 1: no column 'wheel_right'"),
        (GOOD.replace("0.51", "north"), ": line 3, column 'heading': must be a finite number, or empty where nothing"),
        (GOOD.replace("0.51", "nan"), ": line 3, column 'heading': must be a finite number, or empty where nothing"),
        (GOOD.replace("0.51", "inf"), ": line 3, column 'heading': must be a finite number, or empty where nothing"),
        (GOOD.replace("0.2,1.05", ",1.05"), ": line 3, column 'omega': must be a finite number, got ''"),
        (GOOD.replace("0.2,1.05", "nan,1.05"), ": line 3, column 'omega': must be a finite number, got 'nan'"),
        (GOOD.replace("0.2,1.05", "-inf,1.05"), ": line 3, column 'omega': must be a finite number, got '-inf'"),
        (GOOD.replace("0.2,1.05", "fast,1.05"), ": line 3, column 'omega': must be a finite number, got 'fast'"),
        (GOOD.replace("a,0.1", "a,"), ": line 3, column 'time': must be a finite number, got ''"),
        (GOOD.replace("\na,0.1", "\n\n\na,noon"), ": line 5, column 'time': must be a finite number, got 'noon'"),
        (GOOD.replace("a,0.1", ",0.1"), ": line 3, column 'episode': is empty"),
        (GOOD.replace("a,0.1", "a,0.0"), ": line 3, column 'time': 0 s does not come after 0 s of the row before"),
        (GOOD.replace("a,0.1", "a,-0.1"), ": line 3, column 'time': -0.1 s does not come after 0 s"),
        (GOOD.replace("a,0.1", "a,0.13"), ": line 3, column 'time': 0.13 s lies off the grid of 10 Hz"),
        (GOOD + "b,3.11,0,0,,,\n", ": line 6, column 'time': 3.11 s lies off the grid of 10 Hz"),
        (GOOD.replace("b,3.1", "b,3100"), ": line 5, column 'time': the rows cover 30971 samples of 10 Hz with 4 rows"),
        (GOOD + "a,9.0,0,0,0,0,0\n", ": line 6, column 'episode': 'a' comes back after another episode"),
        (GOOD + "c,9.0,0,0,0,0,0\n", ": line 6, column 'episode': 'c' has a single row"),
        (GOOD.replace("1.05,2,0.51", "1.05,,0.51"), ": line 3, column 'y': is empty, but not all of x, y, heading"),
        (GOOD.replace("1.05,2,0.51", ",,0.51"), ": line 3, column 'x': is empty, but not all of x, y, heading"),
    ],
)
def test_a_mistake_in_samples_is_one_line_with_file_line_and_column(folder, samples, says):
    assert complaint(folder(samples)).startswith(f"/samples.csv{says}")


def test_a_half_measured_pair_of_wheels_is_refused(folder):
    samples = HEADER.strip() + ",wheel_left,wheel_right\na,0,0,0,0,0,0,3,4\na,0.1,0,0,0,0,0,3,\n"
    assert complaint(folder(samples)).startswith("/samples.csv: line 3, column 'wheel_right': is empty")


def test_duties_lie_between_full_backwards_and_full_ahead(folder):
    duty = TWIST.replace("twist", "duty")
    samples = GOOD.replace("v,omega", "left,right")
    read_log(folder(samples.replace("0.6,0.2", "-1,1.0000001"), duty))
    says = complaint(folder(samples.replace("0.6,0.2", "0.6,-1.01"), duty))
    assert says.startswith("/samples.csv: line 3, column 'right': a duty must be between -1 and 1, got -1.01")


def test_rows_within_a_quarter_of_a_sample_are_on_the_grid(folder):
    (first, _) = read_log(folder(GOOD.replace("a,0.1", "a,0.125"))).episodes
    np.testing.assert_allclose(first.times, [0.0, 0.1])
    assert "off the grid" in complaint(folder(GOOD.replace("a,0.1", "a,0.126")))


@pytest.mark.parametrize("wrapped", [False, True])
@pytest.mark.parametrize("backwards", [False, True])
@pytest.mark.parametrize("turn", [0.02, 0.1, 0.5])
def test_headings_in_degrees_are_found_out_and_radians_are_not(folder, turn, backwards, wrapped):
    drive = {"turn": turn, "backwards": backwards, "wrapped": wrapped, "seconds": 120.0}
    read_log(folder(driven(**drive)))
    says = complaint(folder(driven(**drive, degrees=True)))
    assert "column 'heading'" in says
    assert "look like degrees; write headings in radians" in says


@pytest.mark.parametrize("start", [0.3, 1.5708, 3.0])
def test_degrees_of_a_straight_drive_are_found_out(folder, start):
    read_log(folder(driven(turn=0.0, start=start)))
    assert "look like degrees" in complaint(folder(driven(turn=0.0, start=start, degrees=True)))


def test_degrees_of_a_drive_that_hardly_turns_are_found_out(folder):
    table = pd.read_csv(io.StringIO(driven(turn=0.0015)))
    assert table["heading"].abs().max() < np.radians(7)
    read_log(folder(table.to_csv(index=False)))
    table["heading"] = np.degrees(table["heading"])
    assert "look like degrees" in complaint(folder(table.to_csv(index=False)))


def test_turns_counted_through_one_episode_but_not_the_next_are_no_degrees(folder):
    samples = HEADER + "a,0,0,1,1,1,365\na,0.1,0,1,1,1,365.1\nb,0,0,1,1,1,5\nb,0.1,0,1,1,1,5.1\n"
    np.testing.assert_allclose(read_log(folder(samples)).episodes[1].poses[:, 2], [5, 5.1])


def test_degrees_of_a_robot_that_turns_on_the_spot_are_found_out_where_they_wrap(folder):
    rows = [f"a,{k / 10},0,1,1,1,{(k * 15 + 180) % 360 - 180}" for k in range(60)]
    assert "look like degrees" in complaint(folder(HEADER + "\n".join(rows) + "\n"))


def test_a_heading_that_is_measured_askew_is_not_taken_for_degrees(folder):
    table = pd.read_csv(io.StringIO(driven(turn=1.0)))
    for askew in (0.5, np.pi / 2, -2.0):
        read_log(folder(table.assign(heading=table["heading"] + askew).to_csv(index=False)))


@pytest.mark.skipif(not DATA.is_dir(), reason="needs measured data in shared/data/logs")
@pytest.mark.parametrize(
    ("name", "command", "episodes", "rows", "without_pose"),
    [
        ("drive_husky", "wheel_speed", 603, 24120, 0),
        ("gym_duckietown", "duty", 12, 7200, 0),
        ("gym_duckietown_frames", "none", 1, 120, 0),
        ("mrclam6_robot1", "twist", 1, 18996, 15),
        ("mrclam6_robot2", "twist", 1, 22154, 35),
        ("mrclam6_robot3", "twist", 1, 22181, 35),
        ("mrclam6_robot4", "twist", 1, 22102, 98),
        ("mrclam6_robot5", "twist", 1, 22145, 37),
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
    columns = list(COMMANDS[command])
    np.testing.assert_array_equal(np.concatenate([e.commands for e in log.episodes]), table[columns])
    poses = np.concatenate([e.poses for e in log.episodes])
    np.testing.assert_array_equal(poses[:, :2], table[["x", "y"]])
    np.testing.assert_allclose(np.cos(poses[:, 2]), np.cos(table["heading"]), atol=1e-12)


@pytest.mark.skipif(not DATA.is_dir(), reason="needs measured data in shared/data/logs")
@pytest.mark.parametrize("name", ["drive_husky", "gym_duckietown", "mrclam6_robot1", "mrclam6_robot4"])
def test_measured_logs_in_degrees_are_found_out(folder, name):
    table = pd.read_csv(DATA / name / "samples.csv")
    turned = table.assign(heading=np.degrees(table["heading"])).to_csv(index=False)
    assert "look like degrees" in complaint(folder(turned, (DATA / name / "log.toml").read_text(encoding="utf-8")))
