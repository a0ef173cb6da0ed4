"""Every step is told as it begins: a bar with the time left on a terminal, else a line."""

from rich.progress import Progress

from proxytune.cli.terminal import steps
from proxytune.running import progress

SHOWN = []


def told(capsys, *lines):
    with steps({"first": 0.1, "second": 0.6}) as step:
        for line in lines:
            step(line)
    return capsys.readouterr().err, SHOWN[-1]


def test_a_terminal_has_a_bar_that_never_goes_back_and_else_every_step_is_a_line_with_its_seconds(capsys, monkeypatch):
    update = Progress.update
    monkeypatch.setattr(Progress, "update", lambda *own, **to: SHOWN.append(to["completed"]) or update(*own, **to))
    text, _ = told(capsys, "first", "second, round 2")
    assert text == "0 s: first\n0 s: second, round 2\n"
    assert told(capsys, "second", "first")[1] == 0.6
    assert told(capsys, "something else")[1] == 0.0
    real = progress.Console
    monkeypatch.setattr(progress, "Console", lambda **known: real(**known, force_terminal=True, width=80))
    text, _ = told(capsys, "first")
    assert "left" in text
    assert "0 s: first" not in text
