import io

from rich.console import Console

from proxytune.running.progress import Bars


def shown(terminal, monkeypatch):
    text = io.StringIO()
    console = Console(file=text, force_terminal=terminal, width=120)
    monkeypatch.setattr("proxytune.running.progress.Console", lambda stderr: console)
    with Bars(36) as bars:
        bars.begin("trial 2 of 2", 18)
        bars.best(4.0)
        for _ in range(6):
            bars.episode()
    return text.getvalue()


def test_a_terminal_sees_trial_episodes_to_run_and_best(monkeypatch):
    text = shown(True, monkeypatch)
    assert "trial 2 of 2" in text
    assert "6/18" in text, "episodes known already are not counted: they need no time"
    assert "best 4" in text


def test_anything_else_sees_nothing(monkeypatch):
    assert shown(False, monkeypatch) == ""
