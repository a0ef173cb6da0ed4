"""A log is opened whatever form it comes in, and every form of one recording is the same log."""

from pathlib import Path

import foreign_robot
import numpy as np
import pytest

from proxytune.errors import LogError
from proxytune.importing.facts import Facts
from proxytune.importing.opening import open_log
from proxytune.importing.wanted import Wanted

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


def test_a_logs_own_folder_is_opened_as_it_is(tmp_path, recordings):
    log, notes = opened(foreign_robot.write_own_times(tmp_path, recordings))
    assert (len(log.episodes), notes) == (2, ())


def test_what_is_imported_is_there_only_while_the_log_is_open(forms):
    with open_log(forms["csv"], facts=FACTS):
        assert list(forms["csv"].parent.glob("**/log.toml")) == []


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
    with pytest.raises(LogError) as caught:
        opened(path)
    assert says in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_clock_offset_given_with_it_is_declared(forms):
    facts = Facts(robot="nobodys", figures=foreign_robot.FIGURES, clock_offset="0.1")
    with open_log(forms["csv"], Wanted(), facts) as (log, _):
        assert log.clock_offset_s == 0.1


def test_clocks_an_hour_apart_are_opened_with_the_offset_that_the_complaint_asks_for(tmp_path):
    one = foreign_robot.drive(1, seconds=12.0, offset_s=3000.0)
    table = foreign_robot.write_form(tmp_path, "csv", [one]) / "run0.csv"
    with pytest.raises(LogError, match="two clocks; .*--clock-offset"):
        opened(table)
    with open_log(table, facts=Facts("nobodys", foreign_robot.FIGURES, clock_offset="3000")) as (log, _):
        np.testing.assert_allclose(log.episodes[0].issued, one.issued + 3000.0, rtol=0, atol=1e-5)


def test_a_source_may_be_where_one_is(forms, monkeypatch):
    (forms["csv"] / "inside").mkdir(exist_ok=True)
    monkeypatch.chdir(forms["csv"] / "inside")
    log, _ = opened(Path(".."))
    assert (len(log.episodes), log.name) == (2, "csv")
