"""A study of learning value for `study`: as JSON, and for people."""

from collections.abc import Mapping
from typing import Any

from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from proxytune.report.teaching.document import estimate
from proxytune.report.teaching.table import count
from proxytune.study.settings import as_document
from proxytune.teaching.search import PlvStudy, PlvTrial


def plv_document(found: PlvStudy) -> dict[str, Any]:
    """A study of learning value as plain JSON; its keys are promises."""
    return {
        "name": found.settings.name,
        "objective": "plv",
        "best": _trial(found.best),
        "trials": [_trial(trial) for trial in found.trials],
        "searched": {interval.name: [interval.low, interval.high] for interval in found.space.intervals},
        "narrowed_by_prpv": found.narrowed,
        "stopped": found.stopped,
        "convergence": {"level": found.when.level, "threshold": found.when.threshold},
        "settings": dict(as_document(found.settings)),
    }


def _trial(trial: PlvTrial) -> dict[str, Any]:
    return {
        "index": trial.number,
        "theta": dict(trial.theta),
        "plv": estimate(trial.worth.plv),
        "needed": estimate(trial.worth.needed),
        "zero_shot": float(trial.curve.mean[0]),
    }


def plv_table(found: PlvStudy, files: Mapping[str, Any]) -> RenderableType:
    """The trials, the best one first, and what was searched."""
    names = found.space.names
    table = Table(box=None, pad_edge=False)
    for name in ("trial", *names, "zero-shot", "target samples", "PLV"):
        table.add_column(name, justify="right")
    ordered = sorted(found.trials, key=lambda trial: (trial is not found.best, trial.number))
    for trial in ordered:
        values = [f"{trial.theta[name]:.4g}" for name in names]
        shown = (f"{trial.curve.mean[0]:.1f}", count(trial.worth.needed), count(trial.worth.plv))
        table.add_row(str(trial.number), *values, *shown)
    head = f"{found.settings.name}: {len(found.trials)} proxies tried; highest PLV first, then in order"
    box = ", ".join(f"{interval.name} [{interval.low:.4g}, {interval.high:.4g}]" for interval in found.space.intervals)
    by = " (narrowed: PRPV cannot tell these θ from the best)" if found.narrowed else ""
    lines = [
        f"searched: {box}{by}",
        f"stopped: {found.stopped}",
        f"converged: a mean score of at least {found.when.threshold:.1f}, from there on",
        *(f"{what}: {path}" for what, path in files.items()),
    ]
    return Group(Text(head), table, *(Text(line) for line in lines))
