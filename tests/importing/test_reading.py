"""The form of a source is told by what is in it, and a log has one kind of commands."""

import os
from dataclasses import replace
from pathlib import Path

import foreign_robot
import numpy as np
import pytest
from imported_drives import drive
from one_line import complaint_of

from proxytune.errors import LogError
from proxytune.importing import reading
from proxytune.importing.reading import FORMS, Form, read_source
from proxytune.importing.source import Source
from proxytune.importing.wanted import Wanted

TIMES = np.arange(0.0, 20.0, 0.05)


@pytest.fixture(scope="module")
def sources(tmp_path_factory):
    home = tmp_path_factory.mktemp("sources")
    recordings = [foreign_robot.drive(1, seconds=6.0)]
    return {form: foreign_robot.write_form(home, form, recordings) for form in foreign_robot.FORMS}


@pytest.mark.parametrize("form", foreign_robot.FORMS)
def test_a_folder_and_its_one_file_are_recognised_as_the_same_form(sources, form):
    if form in foreign_robot.BAGS:
        pytest.importorskip("rosbags")
    folder = sources[form]
    inside = next(path for path in sorted(folder.iterdir()) if "cmd" not in path.name)
    first = [next(one.read for one in FORMS if one.recognise(path)) for path in (folder, inside)]
    assert first[0] is first[1]


def read_as(monkeypatch, tmp_path, *drives):
    source = Source("made by hand", drives, (), ("taken as it is",))
    monkeypatch.setattr(reading, "FORMS", (Form(lambda path: True, lambda path, wanted: source),))
    return read_source(tmp_path, Wanted())


def test_what_was_found_of_stamps_and_clocks_joins_the_notes(monkeypatch, tmp_path):
    times = np.append(TIMES, TIMES[-1])
    found = read_as(monkeypatch, tmp_path, drive(times, TIMES))
    assert found.notes[0] == "taken as it is"
    assert "repeat a stamp" in found.notes[1]
    assert found.notes[2].startswith("no drive turns enough")
    assert len(found.drives[0].poses.times) == len(TIMES)


def test_drives_with_several_kinds_of_commands_are_refused(monkeypatch, tmp_path):
    one = drive(TIMES, TIMES)
    other = replace(one, name="other", commands=replace(one.commands, kind="duty"))
    with pytest.raises(LogError, match=r"commands of several kinds \(duty, twist\); import them apart"):
        read_as(monkeypatch, tmp_path, one, other)


def test_a_log_without_commands_says_nothing_of_clocks(monkeypatch, tmp_path):
    found = read_as(monkeypatch, tmp_path, replace(drive(TIMES, TIMES), commands=None))
    assert found.notes == ("taken as it is",)


def test_a_pipe_or_a_device_is_refused_and_not_waited_for(tmp_path):
    os.mkfifo(tmp_path / "run.csv")
    for path in (tmp_path / "run.csv", Path("/dev/zero")):
        assert "is a device or a pipe; copy" in complaint_of(read_source, path, Wanted())
