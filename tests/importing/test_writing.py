"""A log is written whole or not at all, and reads back as what was imported."""

from dataclasses import replace

import numpy as np
import pytest
from imported_drives import commands, drive, poses

from proxytune.errors import InputError, LogError
from proxytune.importing.facts import Facts, read_geometry
from proxytune.importing.source import Drive, Pictures, Source
from proxytune.importing.writing import write_log
from proxytune.logs import read_log

TIMES = 1.7e9 + np.arange(0.0, 5.0, 0.05) + 1e-4 * np.sin(np.arange(100.0))
FIGURES = Facts(robot="nobodys", figures={"wheel_radius_m": 0.03, "baseline_m": 0.16}, clock_offset="-0.25")


def source(*drives):
    return Source("CSV file", drives, (), ())


def test_what_is_written_reads_back_to_the_last_bit(tmp_path):
    write_log(source(drive(TIMES, TIMES[::7])), tmp_path / "log", FIGURES, "run.csv")
    log = read_log(tmp_path / "log")
    (episode,) = log.episodes
    np.testing.assert_array_equal(episode.measured.times, TIMES)
    np.testing.assert_array_equal(episode.issued, TIMES[::7] - 0.25)
    assert (log.robot, log.command, log.clock_offset_s) == ("nobodys", "twist", -0.25)
    assert log.geometry == {"wheel_radius": 0.03, "effective_baseline": 0.16}


def test_pictures_are_written_with_their_times(tmp_path):
    shown = np.random.default_rng(1).integers(0, 255, (3, 12, 16, 3), dtype=np.uint8)
    pictures = Pictures(TIMES[[10, 20, 30]], lambda: iter(shown))
    facts = replace(FIGURES, road="small_loop", clock_offset="")
    write_log(source(replace(drive(TIMES, TIMES), pictures=pictures)), tmp_path / "log", facts, "bag")
    frames = read_log(tmp_path / "log").frames
    np.testing.assert_array_equal(frames.times, TIMES[[10, 20, 30]])
    assert frames.road == "small_loop"
    assert all(path.is_file() for path in frames.paths)


def test_an_offset_may_be_asked_to_be_fitted(tmp_path):
    write_log(source(drive(TIMES, TIMES)), tmp_path / "log", replace(FIGURES, clock_offset="fit"), "bag")
    assert read_log(tmp_path / "log").fit_clock_offset


def test_a_log_that_is_there_is_not_written_over(tmp_path):
    write_log(source(drive(TIMES, TIMES)), tmp_path / "log", FIGURES, "bag")
    before = (tmp_path / "log" / "samples.csv").read_bytes()
    with pytest.raises(InputError, match="log: is there already"):
        write_log(source(drive(TIMES + 1, TIMES + 1)), tmp_path / "log", FIGURES, "bag")
    assert (tmp_path / "log" / "samples.csv").read_bytes() == before


def test_what_makes_no_log_leaves_nothing_behind(tmp_path):
    wild = Drive("run", replace(commands(TIMES), kind="duty", values=np.full((len(TIMES), 2), 7.0)), poses(TIMES))
    with pytest.raises(LogError, match="log/commands.csv: line 2, column 'left': a duty must be between -1 and 1"):
        write_log(source(wild), tmp_path / "log", FIGURES, "bag")
    assert list(tmp_path.iterdir()) == []


def test_pictures_that_break_off_leave_nothing_behind(tmp_path):
    def broken():
        yield np.zeros((4, 4, 3), dtype=np.uint8)
        raise LogError("bag: message 2 of /camera cannot be decoded")

    pictures = Pictures(TIMES[[10, 20]], broken)
    with pytest.raises(LogError, match="message 2"):
        write_log(source(replace(drive(TIMES, TIMES), pictures=pictures)), tmp_path / "log", FIGURES, "bag")
    assert list(tmp_path.iterdir()) == []


def test_figures_are_read_by_the_names_of_log_toml():
    assert read_geometry(["baseline_m=0.16", "wheel_radius_m = 0.03"]) == {"baseline_m": 0.16, "wheel_radius_m": 0.03}


@pytest.mark.parametrize("text", ["baseline=0.16", "baseline_m", "baseline_m=wide"])
def test_a_figure_that_is_none_is_refused(text):
    with pytest.raises(InputError, match="--figure"):
        read_geometry([text])
