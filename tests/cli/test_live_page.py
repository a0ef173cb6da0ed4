"""A study's page while the study runs."""

from contextlib import nullcontext
from pathlib import Path
from unittest.mock import Mock, call

import pytest

from proxytune.cli import study as live_page
from proxytune.cli.main import main
from proxytune.cli.study import LivePage, renewed_page
from proxytune.errors import RunError
from proxytune.running import Silent
from proxytune.study import open_study


@pytest.fixture
def settings(finished):
    return open_study(finished).settings


class Clock:
    """A time that passes when it is told to."""

    def __init__(self, monkeypatch):
        self.now = 100.0
        monkeypatch.setattr(live_page.time, "monotonic", lambda: self.now)


def test_the_page_is_there_after_the_first_episode_and_its_path_is_said_once(settings, capsys, monkeypatch):
    clock, path = Clock(monkeypatch), settings.folder / "report.html"
    with renewed_page(settings, "prpv", nullcontext(Silent())) as watcher:
        watcher.begin("trial 8 of 9", 0)
        assert not path.exists()
        watcher.episode()
        assert "Under way: trial 8 of 9. Best of 7 trials so far" in path.read_text()
        clock.now += 60.0
        watcher.episode()
    assert capsys.readouterr().err == f"proxytune study: page: {path} (renews itself while the study runs)\n"


def test_it_is_written_at_most_every_few_seconds_and_what_else_watches_hears_all(settings, monkeypatch):
    clock, written = Clock(monkeypatch), []
    monkeypatch.setattr(live_page.report, "write_live_page", lambda path, *known: written.append(path))
    page = LivePage(settings, "prpv", Silent())
    for _ in range(100):
        clock.now += 0.1
        page.episode()
    assert len(written) == 2

    heard = Mock()
    page = LivePage(settings, "prpv", heard)
    page.begin("a", 2)
    page.episode()
    page.best(3.0)
    assert heard.mock_calls == [call.begin("a", 2), call.episode(), call.best(3.0)]


def test_a_run_that_is_stopped_leaves_a_page_that_says_so_and_no_longer_renews(settings):
    with pytest.raises(KeyboardInterrupt), renewed_page(settings, "prpv", nullcontext(Silent())) as watcher:
        watcher.begin("trial 8 of 9", 0)
        watcher.episode()
        raise KeyboardInterrupt
    text = (settings.folder / "report.html").read_text()
    assert "Stopped before its end." in text
    assert "refresh" not in text


def test_a_page_that_cannot_be_written_does_not_stop_the_run(settings, monkeypatch, capsys):
    def refuse(path, *known):
        raise RunError("no room")

    monkeypatch.setattr(live_page.report, "write_live_page", refuse)
    with renewed_page(settings, "prpv", nullcontext(Silent())) as watcher:
        watcher.episode()
    assert capsys.readouterr().err == ""


def test_a_finished_study_has_its_own_page_in_the_end_and_nothing_is_said_on_the_way(finished, capsys):
    (finished / "report.html").unlink(missing_ok=True)
    assert main(["study", str(finished)]) == 0
    assert capsys.readouterr().err == ""
    assert "refresh" not in Path(finished / "report.html").read_text()
