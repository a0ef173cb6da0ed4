"""A table is read some rows at a time, and that never shows."""

import numpy as np
import pytest
from log_folders import complaint, write_files

from proxytune.logs import read_log, rows as cells

TWIST = 'format = 1\nname = "yard"\nrobot = "tractor"\ncommand = "twist"\nrate_hz = 10\n'
HEADER = "episode,time,v,omega,x,y,heading"
ROWS = [f"{name},0.{tenth},0.5,{1 + tenth},{tenth}.25,2,0.5" for name in "abc" for tenth in range(5)]


@pytest.fixture(params=[(1, 1), (2, 40), (4, 100), (100, 10_000)])
def folder(request, tmp_path, monkeypatch):
    """A log that is read by so many rows and characters at a time."""
    monkeypatch.setattr(cells, "AT_ONCE", request.param[0])
    monkeypatch.setattr(cells, "CHARACTERS", request.param[1])

    def write(lines, end="\n"):
        return write_files(tmp_path / "log", {"log.toml": TWIST, "samples.csv": end.join((HEADER, *lines, ""))})

    return write


def changed(changes):
    return [line.replace(*changes.get(row, ("", ""))) for row, line in enumerate(ROWS)]


@pytest.mark.parametrize("end", ["\n", "\r\n", "\r", "\n\n,,\n"])
def test_rows_are_the_same_however_many_are_read_at_a_time(folder, end):
    log = read_log(folder(changed({3: ("3.25,2,0.5", ",,"), 7: (",2,0.5", ',"2", 0.5 ')}), end))
    assert [episode.name for episode in log.episodes] == ["a", "b", "c"]
    for episode in log.episodes:
        expected = np.array([(tenth + 0.25, 2.0, 0.5) for tenth in range(5)])
        expected[3] = np.nan if episode.name == "a" else expected[3]
        np.testing.assert_array_equal(episode.poses, expected)
        np.testing.assert_array_equal(episode.commands, [(0.5, 1.0 + tenth) for tenth in range(5)])
        np.testing.assert_allclose(episode.times, [0.0, 0.1, 0.2, 0.3, 0.4])


def test_mistakes_far_down_are_told_as_those_at_the_top(folder):
    wrong = {1: (",2,0.5", ",far,0.5"), 9: ("0.5,5", "fast,5"), 12: ("0.5,3", "slow,3")}
    assert "line 11, column 'v': must be a finite number, got 'fast'" in complaint(folder(changed(wrong)))
    assert "line 9: has 8 cells, but the first line names 7" in complaint(folder(changed({7: (",2,", ",2,1,")})))
    again = [*ROWS, "a,0.9,0,0,0,0,0", "a,1.0,0,0,0,0,0"]
    assert "line 17, column 'episode': 'a' comes back" in complaint(folder(again))
    assert "is not a CSV file" in complaint(folder([*ROWS, 'c,0.5,0,0,0,0,"0']))
