"""report.html: a study on one page that needs nothing else."""

import base64
import html
from collections.abc import Sequence
from pathlib import Path
from string import Template

from proxytune.report.study.finding import finding_of
from proxytune.report.study.information_table import INFORMATION_COLUMNS, information_rows
from proxytune.report.study.search_rows import search_rows
from proxytune.report.study.table import INFORMATION, SEARCH, THETA, USEFULNESS
from proxytune.report.study.theta_table import theta_columns, theta_notes, theta_rows
from proxytune.report.study.usefulness_table import USEFULNESS_COLUMNS, usefulness_notes, usefulness_rows
from proxytune.report.study.verdict import sentence
from proxytune.storage.records import TrialRecord
from proxytune.study.result import StudyResult

PAGE = Template("""<!doctype html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width">
<title>$title</title>
<style>
body { font: 16px/1.5 system-ui, sans-serif; max-width: 46rem; margin: 2rem auto; padding: 0 1rem; color: #222; }
table { border-collapse: collapse; font-variant-numeric: tabular-nums; }
th, td { text-align: left; padding: .15rem 1rem .15rem 0; border-bottom: 1px solid #ddd; }
img { max-width: 100%; }
.verdict { font-size: 1.2em; }
.scroll { overflow-x: auto; }
</style>
</head>
<body>
<h1>$title</h1>
<p class="verdict">$sentence</p>
$groups
$figures
<p>$meaning</p>
<h2>Trials</h2>
<div class="scroll">$trials</div>
<h2>Settings</h2>
<div class="scroll">$settings</div>
</body>
</html>
""")


def page(result: StudyResult, figures: Sequence[Path]) -> str:
    """The page, with these PNG figures in it.

    Raises:
        OSError: If a figure cannot be read.
    """
    settings = result.study.settings
    return PAGE.substitute(
        title=html.escape(settings.name),
        sentence=html.escape(sentence(finding_of(result))),
        groups=_groups(result),
        meaning=html.escape(_meaning(result)),
        figures="".join(_image(path) for path in figures),
        trials=_table(("trial", *settings.space.names, "PRPV", "PPV", "failed episodes"), _trials(result)),
        settings=_table(("key", "value"), _settings(result)),
    )


def _groups(result: StudyResult) -> str:
    """What the terminal shows below the sentence, under the same heads."""
    informed = information_rows(result)
    usefulness = _table(USEFULNESS_COLUMNS, usefulness_rows(result))
    return "".join((
        _group(THETA, _table(theta_columns(result), theta_rows(result)), theta_notes(result)),
        _group(USEFULNESS, usefulness, usefulness_notes(result)),
        _group(INFORMATION, _table(INFORMATION_COLUMNS, informed)) if informed else "",
        _group(SEARCH, _table((), search_rows(result))),
    ))  # fmt: skip


def _group(title: str, table: str, notes: Sequence[str] = ()) -> str:
    items = "".join(f"<li>{html.escape(note)}</li>" for note in notes)
    return f'<h2>{html.escape(title)}</h2><div class="scroll">{table}</div>' + (f"<ul>{items}</ul>" if items else "")


def _meaning(result: StudyResult) -> str:
    agents = len(result.study.settings.agents)
    return (
        "PRPV, the proxy relative predictivity value, counts on how many ordered pairs of the "
        f"{agents} agents proxy and target disagree which is the better. The best θ is the visited one of lowest "
        "expected PRPV, given all trials and fresh episodes. The 95 % interval holds the values that agree with every "
        "agent's every metric on the target; “by PRPV alone” those whose PRPV is as low as the best, within noise."
    )


def _trials(result: StudyResult) -> list[tuple[str, ...]]:
    return [_trial_row(trial, result.study.settings.space.names) for trial in result.trials]


def _trial_row(trial: TrialRecord, names: tuple[str, ...]) -> tuple[str, ...]:
    theta = (f"{trial.theta[name]:.4g}" for name in names)
    prpv = "failed" if trial.prpv is None else f"{trial.prpv:g}"
    if trial.bound is not None:
        prpv = f"stopped early, at least {trial.bound:g}"
    ppv = "" if trial.ppv is None else f"{trial.ppv:.3g}"
    return (str(trial.number), *theta, prpv, ppv, str(trial.failed_episodes))


def _settings(result: StudyResult) -> list[tuple[str, str]]:
    settings = result.study.settings
    return [
        ("domain family", settings.family),
        ("proxy", settings.proxy.name if settings.proxy else "the family's nominal model"),
        ("target", ", ".join(path.name for path in settings.targets)),
        ("metrics", ", ".join(str(metric) for metric in settings.metrics)),
        ("agents", ", ".join(settings.agents)),
        ("starts", str(settings.starts)),
        ("engine", settings.engine),
        ("seed", str(settings.seed)),
    ]


def _image(path: Path) -> str:
    data = base64.b64encode(path.read_bytes()).decode("ascii")
    return f'<p><img alt="{html.escape(path.stem)}" src="data:image/png;base64,{data}"></p>'


def _table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    cells = "".join(f"<th>{html.escape(name)}</th>" for name in head)
    top = f"<tr>{cells}</tr>" if cells else ""
    body = "".join("<tr>" + "".join(f"<td>{html.escape(cell)}</td>" for cell in row) + "</tr>" for row in rows)
    return f"<table>{top}{body}</table>"
