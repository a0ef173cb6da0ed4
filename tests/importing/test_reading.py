"""Every form of one recording is the same log, written whole or not at all, and a drive is told in numbers."""

import math
import os
from dataclasses import replace
from pathlib import Path

import foreign_robot
import numpy as np
import pandas as pd
import pytest
from imported_drives import drive, poses, turning
from one_line import complaint_of

from proxytune.errors import InputError, LogError
from proxytune.importing import Facts, Source, Wanted, open_log, read_geometry, read_source, reading, write_log
from proxytune.importing.reading import FORMS, clock_notes, rows_notes, survey
from proxytune.importing.source import Pictures
from proxytune.logs import read_log

FACTS = Facts(robot="nobodys", figures=foreign_robot.FIGURES)


@pytest.fixture(scope="module")
def recordings():
    return [foreign_robot.drive(number, seconds=12.0, offset_s=0.1) for number in range(2)]


@pytest.fixture(scope="module")
def forms(tmp_path_factory, recordings):
    """The same two drives in every form that there is."""
    home = tmp_path_factory.mktemp("forms")
    return {form: foreign_robot.write_form(home, form, recordings) for form in foreign_robot.FORMS}


def opened(path):
    with open_log(path, facts=FACTS) as (log, notes):
        return log, notes


@pytest.mark.parametrize("form", foreign_robot.FORMS)
def test_every_form_gives_the_same_drives(forms, recordings, form):
    if form in foreign_robot.BAGS:
        pytest.importorskip("rosbags")
    log, notes = opened(forms[form])
    assert len(log.episodes) == len(recordings)
    for episode, recording in zip(log.episodes, recordings, strict=True):
        np.testing.assert_allclose(episode.measured.times, recording.measured, rtol=0, atol=1.1e-6)
        np.testing.assert_allclose(episode.issued, recording.issued, rtol=0, atol=1.1e-6)
        np.testing.assert_allclose(episode.commands, recording.twists, atol=1e-9)
        np.testing.assert_allclose(episode.measured.poses[:, :2], recording.poses[:, :2], atol=1e-6)
        turns = (episode.measured.poses[:, 2] - recording.poses[:, 2]) / (2.0 * np.pi)
        np.testing.assert_allclose(turns, np.round(turns[0]), atol=1e-6)
    assert any("after its commands" in note for note in notes)


def test_a_log_s_folder_or_a_place_within_a_source_is_opened_and_nothing_left(tmp_path, recordings, forms, monkeypatch):
    log, notes = opened(foreign_robot.write_own_times(tmp_path, recordings))
    assert (len(log.episodes), notes) == (2, ())
    with open_log(forms["csv"], facts=FACTS):
        assert list(forms["csv"].parent.glob("**/log.toml")) == []
    (forms["csv"] / "inside").mkdir(exist_ok=True)
    monkeypatch.chdir(forms["csv"] / "inside")
    log, _ = opened(Path(".."))
    assert (len(log.episodes), log.name) == (2, "csv")


@pytest.mark.parametrize(
    ("name", "content", "says"),
    [
        ("empty.bag", b"", "cannot be read"),
        ("noise.bin", bytes(range(256)), "is no recording that is known; give a ROS bag"),
        ("missing", None, "no such folder"),
    ],
)
def test_what_is_no_recording_is_refused_in_one_line(tmp_path, name, content, says):
    path = tmp_path / name
    if content is not None:
        path.write_bytes(content)
    assert says in complaint_of(opened, path)


@pytest.mark.parametrize(
    ("form", "wanted", "says"),
    [
        ("csv", {"vesc": Path("/nonexistent")}, "--vesc is for bags; leave it out"),
        ("csv", {"stamps": "receive"}, "--stamps is for bags"),
        ("tum", {"frames": "camera"}, "--pictures is for bags and .npz"),
        ("tum", {"poses": "/pose"}, "--poses is for bags and MRCLAM"),
    ],
)
def test_what_says_nothing_of_a_form_is_refused_with_what_it_is_for(forms, form, wanted, says):
    assert says in complaint_of(read_source, forms[form], Wanted(**wanted))
    read_source(forms["csv"], Wanted(frames="none", poses="none"))


def test_a_clock_offset_given_with_it_is_declared_as_the_complaint_of_clocks_an_hour_apart_asks_for(forms, tmp_path):
    facts = Facts(robot="nobodys", figures=foreign_robot.FIGURES, clock_offset="0.1")
    with open_log(forms["csv"], Wanted(), facts) as (log, _):
        assert log.clock_offset_s == 0.1
    one = foreign_robot.drive(1, seconds=12.0, offset_s=3000.0)
    table = foreign_robot.write_form(tmp_path, "csv", [one]) / "run0.csv"
    with pytest.raises(LogError, match="two clocks; .*--clock-offset"):
        opened(table)
    with open_log(table, facts=Facts("nobodys", foreign_robot.FIGURES, clock_offset="3000")) as (log, _):
        np.testing.assert_allclose(log.episodes[0].issued, one.issued + 3000.0, rtol=0, atol=1e-5)


TIMES = np.arange(0.0, 20.0, 0.05)


@pytest.mark.parametrize("form", foreign_robot.FORMS)
def test_a_folder_and_its_one_file_are_recognised_as_the_same_form(forms, form):
    if form in foreign_robot.BAGS:
        pytest.importorskip("rosbags")
    folder = forms[form]
    inside = next(path for path in sorted(folder.glob("run*")) if "cmd" not in path.name)
    first = [next(read for recognise, read in FORMS.items() if recognise(path)) for path in (folder, inside)]
    assert first[0] is first[1]


def read_as(monkeypatch, tmp_path, *drives):
    source = Source("made by hand", drives, (), ("taken as it is",))
    monkeypatch.setattr(reading, "FORMS", {lambda path: True: lambda path, wanted: source})
    return read_source(tmp_path, Wanted())


def test_commands_in_the_rows_of_poses_are_said_to_be_late():
    """A command that was issued between two rows stands in the later one; with times of their own there is no such."""
    turns = turning(0.1)
    times = turns.poses.times[: len(turns.commands.times)]
    drive = replace(turns, commands=replace(turns.commands, times=times, in_rows=True))
    (note,) = rows_notes([drive])
    step = float(np.median(np.diff(drive.poses.times)))
    assert f"{step:.3g} s apart" in note
    assert f"{step / 2.0:.2g} s late" in note
    assert rows_notes([replace(drive, commands=replace(drive.commands, times=drive.commands.times + 0.001))]) == []
    assert rows_notes([replace(drive, commands=None)]) == []


def test_commands_of_a_file_or_a_clock_of_their_own_are_not_said_to_stand_in_the_rows_of_poses(tmp_path):
    rows = [(k / 10, k / 50, 0, 0, 0.2, math.sin(k / 5)) for k in range(100)]
    table = pd.DataFrame(rows, columns=["time", "x", "y", "heading", "v", "omega"])
    table.to_csv(tmp_path / "together.csv", index=False)
    (tmp_path / "apart").mkdir()
    table.drop(columns=["v", "omega"]).to_csv(tmp_path / "apart" / "poses.csv", index=False)
    table[["time", "v", "omega"]].to_csv(tmp_path / "apart" / "commands.csv", index=False)
    table.assign(command_time=table["time"]).to_csv(tmp_path / "clocks.csv", index=False)
    said = {name: " ".join(read_source(tmp_path / name, Wanted()).notes) for name in ("together.csv", "apart")}
    said["clocks"] = " ".join(
        read_source(tmp_path / "clocks.csv", Wanted(columns={"command_time": "command_time"})).notes
    )
    assert ["stand in the rows of poses" in notes for notes in said.values()] == [True, False, False]
    # None of them turns: it is commanded to, and does not
    assert all("no drive turns as commanded" in notes for notes in said.values())


def test_what_was_found_joins_the_notes_and_without_commands_nothing_is_said_of_clocks(monkeypatch, tmp_path):
    found = read_as(monkeypatch, tmp_path, drive(np.append(TIMES, TIMES[-1]), TIMES))
    assert found.notes[0] == "taken as it is"
    assert "repeat a stamp" in found.notes[1]
    assert found.notes[2].startswith("no drive turns as commanded")
    assert len(found.drives[0].poses.times) == len(TIMES)
    found = read_as(monkeypatch, tmp_path, replace(drive(TIMES, TIMES), commands=None))
    assert found.notes == ("taken as it is",)


def test_drives_with_several_kinds_of_commands_and_a_pipe_or_a_device_are_refused(monkeypatch, tmp_path):
    one = drive(TIMES, TIMES)
    other = replace(one, name="other", commands=replace(one.commands, kind="duty"))
    with pytest.raises(LogError, match=r"commands of several kinds \(duty, twist\); import them apart"):
        read_as(monkeypatch, tmp_path, one, other)
    os.mkfifo(tmp_path / "run.csv")
    for path in (tmp_path / "run.csv", Path("/dev/zero")):
        assert "is a device or a pipe; copy" in complaint_of(read_source, path, Wanted())


def test_drop_outs_are_counted_apart_from_gaps_and_turning_before_or_after_the_command_is_told():
    one = survey(drive(np.arange(200) * 0.05, np.arange(100) * 0.1))
    assert (one.poses, one.commands, one.frames, one.gaps) == (200, 100, 0, 0)
    assert (one.seconds, one.poses_hz) == pytest.approx((9.95, 20.0))
    assert (one.lost, one.jitter_s) == pytest.approx((0.0, 0.0), abs=1e-9)

    times = np.delete(np.arange(400) * 0.05, [*range(50, 60), *range(200, 300)])
    one = survey(drive(times, np.arange(200) * 0.1))
    assert (one.gaps, one.longest_gap_s) == (2, pytest.approx(5.05))
    times = np.delete(np.arange(400) * 0.05, [50, 51, 90, 200])
    one = survey(drive(times, np.arange(200) * 0.1))
    assert one.gaps == 0
    assert one.lost == pytest.approx(4 / 400, abs=1e-4)

    times = np.arange(2000) * 0.05 + np.random.default_rng(1).normal(0.0, 0.002, 2000)
    one = survey(drive(times, np.arange(200) * 0.1))
    assert one.jitter_s == pytest.approx(0.002 * np.sqrt(2.0), rel=0.1)
    (note,) = clock_notes([survey(turning(-0.25)), survey(turning(0.1))])
    assert note.startswith("1 of 2 drives turn before they are told to (up to 0.25 s, run): two clocks")
    (note,) = clock_notes([survey(turning(0.1))])
    assert note.startswith("it turns 0.10 s after its commands: delay, lag and an offset")
    straight = replace(turning(0.1), poses=poses(np.arange(0.0, 40.0, 0.02)))
    assert survey(straight).lag_s is None
    untold = "no drive turns as commanded, long and clearly enough to tell whether commands and poses share a clock"
    assert clock_notes([survey(straight)]) == [untold]
    # One that turns the other way turns enough
    against = turning(0.1)
    against = replace(against, poses=replace(against.poses, headings=-against.poses.headings))
    assert clock_notes([survey(against)]) == [untold]


STAMPS = 1.7e9 + np.arange(0.0, 5.0, 0.05) + 1e-4 * np.sin(np.arange(100.0))
RUN = drive(STAMPS, STAMPS)
OWN = Facts(robot="nobodys", figures={"wheel_radius_m": 0.03, "baseline_m": 0.16}, clock_offset="-0.25")


def source(*drives):
    return Source("CSV file", drives, (), ())


def test_what_is_written_reads_back_to_the_last_bit_or_with_an_offset_to_be_fitted(tmp_path):
    write_log(source(drive(STAMPS, STAMPS[::7])), tmp_path / "log", OWN, "run.csv")
    log = read_log(tmp_path / "log")
    (episode,) = log.episodes
    np.testing.assert_array_equal(episode.measured.times, STAMPS)
    np.testing.assert_array_equal(episode.issued, STAMPS[::7] - 0.25)
    assert (log.robot, log.command, log.clock_offset_s) == ("nobodys", "twist", -0.25)
    assert log.geometry == {"wheel_radius": 0.03, "effective_baseline": 0.16}
    write_log(source(RUN), tmp_path / "again" / "log", replace(OWN, clock_offset="fit"), "bag")
    assert read_log(tmp_path / "again" / "log").fit_clock_offset


def test_pictures_are_written_with_their_times(tmp_path):
    shown = np.random.default_rng(1).integers(0, 255, (3, 12, 16, 3), dtype=np.uint8)
    pictures = Pictures(STAMPS[[10, 20, 30]], lambda: iter(shown))
    facts = replace(OWN, road="small_loop", clock_offset="")
    write_log(source(replace(RUN, pictures=pictures)), tmp_path / "log", facts, "bag")
    frames = read_log(tmp_path / "log").frames
    np.testing.assert_array_equal(frames.times, STAMPS[[10, 20, 30]])
    assert frames.road == "small_loop"
    assert all(path.is_file() for path in frames.paths)


def test_a_log_that_is_there_is_not_written_over(tmp_path):
    write_log(source(RUN), tmp_path / "log", OWN, "bag")
    before = (tmp_path / "log" / "samples.csv").read_bytes()
    with pytest.raises(InputError, match="log: is there already"):
        write_log(source(drive(STAMPS + 1, STAMPS + 1)), tmp_path / "log", OWN, "bag")
    assert (tmp_path / "log" / "samples.csv").read_bytes() == before


def test_what_makes_no_log_or_breaks_off_leaves_nothing_behind(tmp_path):
    wild = replace(RUN, commands=replace(RUN.commands, kind="duty", values=np.full((len(STAMPS), 2), 7.0)))
    with pytest.raises(LogError, match="log/samples.csv: line 2, column 'left': a duty must be between -1 and 1"):
        write_log(source(wild), tmp_path / "log", OWN, "bag")
    assert list(tmp_path.iterdir()) == []

    def broken():
        yield np.zeros((4, 4, 3), dtype=np.uint8)
        raise LogError("bag: message 2 of /camera cannot be decoded")

    pictures = Pictures(STAMPS[[10, 20]], broken)
    with pytest.raises(LogError, match="message 2"):
        write_log(source(replace(RUN, pictures=pictures)), tmp_path / "log", OWN, "bag")
    assert list(tmp_path.iterdir()) == []


def test_figures_are_read_by_the_names_of_log_toml_and_no_others():
    assert read_geometry(["baseline_m=0.16", "wheel_radius_m = 0.03"]) == {"baseline_m": 0.16, "wheel_radius_m": 0.03}
    for text in ("baseline=0.16", "baseline_m", "baseline_m=wide"):
        assert "--figure" in complaint_of(read_geometry, [text])


@pytest.mark.parametrize(
    ("kind", "robot", "columns"),
    [("ackermann", "car", "throttle,steering,enabled"), ("twist", "duckiebot", "v,omega,enabled")],
)
def test_commands_that_were_written_down_with_poses_and_a_switch_stay_beside_them(
    tmp_path, write_file, kind, robot, columns
):
    rows = "".join(f"{t / 20},{t / 50},0,0,0.3,{t % 3 - 1},1\n" for t in range(40))
    source = read_source(write_file(f"time,x,y,heading,{columns}\n{rows}", "run.csv"), Wanted())
    log = write_log(source, tmp_path / "log", Facts(robot=robot), "run.csv")
    header = (tmp_path / "log" / "samples.csv").read_text().splitlines()[0]
    assert header == f"episode,time,{columns},x,y,heading"
    assert log.command == kind
    assert not (tmp_path / "log" / "commands.csv").exists()
    (episode,) = log.episodes
    np.testing.assert_array_equal(episode.issued, np.arange(40) / 20)
    np.testing.assert_array_equal(episode.commands[:, 1], np.arange(40) % 3 - 1)
