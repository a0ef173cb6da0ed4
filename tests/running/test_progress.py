"""How far a command is: on a terminal of any width a bar whose figures are whole, elsewhere plain lines."""

import io

import pytest
from rich.console import Console

from proxytune.running import Bars

STUDY = ("fresh episodes 2 of 3", "episodes", 3.25)
TEACHING = ("demonstrations", "points of learning curves", None)


def written(monkeypatch, terminal=False, width=120, colours=None):
    """What is written from now on."""
    text = io.StringIO()
    console = Console(file=text, force_terminal=terminal, width=width, color_system=colours)
    monkeypatch.setattr("proxytune.running.progress.Console", lambda stderr: console)
    return text


def shown(terminal, monkeypatch, width=120, colours=None, what=("trial 2 of 2", "episodes", 4.0)):
    text = written(monkeypatch, terminal, width, colours)
    step, unit, best = what
    with Bars(1636, unit) as bars:
        bars.begin(step, 36)
        bars.finished("known before")
        for _ in range(1250):
            bars.episode()
        if best is not None:
            bars.best(best)
        bars.finished(f"{step}: PRPV 4")
    return text.getvalue()


def test_a_terminal_sees_trial_episodes_to_run_and_best_without_colours_where_asked(monkeypatch):
    text = shown(True, monkeypatch)
    assert "trial 2 of 2" in text
    assert "1250/1600 episodes" in text, "episodes known already are not counted: they need no time"
    assert "best 4" in text
    assert "PRPV" not in text, "the bar says it"
    assert "\x1b[3" in shown(True, monkeypatch, colours="standard")
    monkeypatch.setenv("NO_COLOR", "1")
    assert "\x1b[3" not in shown(True, monkeypatch, colours="standard")
    text = written(monkeypatch)
    with Bars(432) as bars:
        bars.begin("pre-flight 1 of 2", 0)
        bars.begin("pre-flight 2 of 2", 0)
    assert text.getvalue() == "0 s: pre-flight 1 of 2 begins; at most 432 episodes\n"


@pytest.mark.parametrize("what", [STUDY, TEACHING], ids=["study", "teach"])
@pytest.mark.parametrize("width", [44, 60, 79, 80, 100])
def test_no_figure_is_cut_however_narrow_the_terminal(monkeypatch, width, what):
    text = shown(True, monkeypatch, width, what=what)
    assert "1250/1600" in text
    assert "left 0:0" in text
    assert what[2] is None or "best 3.25" in text
    assert "…" not in text
    assert all(word in text for word in what[0].split())


@pytest.mark.parametrize(("width", "bar", "unit"), [(44, False, False), (60, True, False), (80, True, True)])
def test_on_a_narrow_terminal_the_bar_goes_first(monkeypatch, width, bar, unit):
    text = shown(True, monkeypatch, width)
    assert ("━" in text) == bar
    assert ("1250/1600 episodes" in text) == unit


def test_lines_are_plain_unbroken_and_of_what_is_finished(monkeypatch):
    lines = shown(False, monkeypatch).splitlines()
    assert [line.partition(" s: ")[2] for line in lines] == ["trial 2 of 2: PRPV 4; 1250 of at most 1600 episodes"]
    what = (f"trial 1 of 2 [red]{'x' * 100}", "episodes", None)
    assert f"[red]{'x' * 100}: PRPV 4; 1250" in shown(False, monkeypatch, 44, what=what)


@pytest.mark.parametrize("terminal", [True, False])
def test_an_episode_that_waits_is_told_of_ever_more_rarely_on_a_terminal_too(monkeypatch, terminal):
    text = written(monkeypatch, terminal, 60)
    with Bars(5) as bars:
        for seconds in (60.0, 66.0, 119.0, 121.0, 130.0, 245.0, 300.0):
            bars.waiting("agent 'one' from start 3", seconds)
        bars.waiting("agent 'two' from start 4", 70.0)
    lines = [line for line in text.getvalue().splitlines() if "under way" in line]
    told = [f"agent 'one' from start 3 has been under way for {minutes} min" for minutes in (1, 2, 4)]
    assert [line.partition(" s: ")[2].partition(";")[0] for line in lines] == told
    assert all(line.endswith("; episode_timeout_s in study.toml would end it") for line in lines)
