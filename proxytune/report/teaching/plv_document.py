"""A search by PLV: as JSON, and for people."""

from collections.abc import Mapping
from typing import Any

from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from proxytune.report.teaching.document import estimate
from proxytune.report.teaching.table import CONVERGED, PLV_MEANING, UNKNOWN, count
from proxytune.study.settings import as_document
from proxytune.teaching.search import PlvStudy, PlvTrial


def plv_document(study: PlvStudy) -> dict[str, Any]:
    """A search by PLV as plain JSON; its keys are promises."""
    return {
        "name": study.settings.name,
        "objective": "plv",
        "best": _trial(study.best),
        "trials": [_trial(trial) for trial in study.trials],
        "searched": {interval.name: [interval.low, interval.high] for interval in study.space.intervals},
        "narrowed_by_prpv": study.narrowed,
        "stopped": study.stopped,
        "convergence": {"level": study.when.level, "threshold": study.when.threshold},
        "settings": dict(as_document(study.settings)),
    }


def _trial(trial: PlvTrial) -> dict[str, Any]:
    return {
        "index": trial.number,
        "theta": dict(trial.theta),
        "plv": estimate(trial.worth.plv),
        "needed": estimate(trial.worth.needed),
        "zero_shot": float(trial.curve.mean[0]),
    }


def plv_table(study: PlvStudy, files: Mapping[str, Any]) -> RenderableType:
    """The trials, the best one first, and what was searched."""
    names = study.space.names
    table = Table(box=None, pad_edge=False)
    for name in ("trial", *names, "zero-shot score", "samples needed", "PLV"):
        table.add_column(name, justify="right", overflow="fold")
    ordered = sorted(study.trials, key=lambda trial: (trial is not study.best, trial.number))
    for trial in ordered:
        values = [f"{trial.theta[name]:.4g}" for name in names]
        scores = (f"{trial.curve.mean[0]:.1f}", count(trial.worth.needed), count(trial.worth.plv, UNKNOWN))
        table.add_row(str(trial.number), *values, *scores)
    head = f"{study.settings.name}: {len(study.trials)} proxies tried, the one of highest PLV first"
    box = ", ".join(f"{interval.name} [{interval.low:.4g}, {interval.high:.4g}]" for interval in study.space.intervals)
    by = " (narrowed to the θ whose PRPV is as low as the best, within noise)" if study.narrowed else ""
    lines = [
        f"searched: {box}{by}",
        f"stopped: {study.stopped}",
        PLV_MEANING,
        CONVERGED.format(f"{study.when.threshold:.1f}"),
        *(f"{what}: {path}" for what, path in files.items()),
    ]
    return Group(Text(head), table, *(Text(line) for line in lines))
