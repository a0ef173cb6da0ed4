"""A search by PLV: as JSON, and for people."""

from collections.abc import Mapping
from typing import Any

from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from proxytune.learning import Distribution
from proxytune.report.numbers import short
from proxytune.report.teaching.document import estimate, theta_of
from proxytune.report.teaching.table import CONVERGED, PLV_MEANING, UNKNOWN, count, one_decimal
from proxytune.study import as_document
from proxytune.teaching import Experiment, PlvStudy, PlvTrial, best_teacher, saves_more

CONFIRMED = "Finalists, taught anew with fresh lessons, learners and examinations:"
SCORES = ("zero-shot score", "samples needed", "PLV")


def plv_document(study: PlvStudy) -> dict[str, Any]:
    """A search by PLV as plain JSON; its keys are promises."""
    return {
        "name": study.settings.name,
        "objective": "plv",
        "best": _trial(study.best),
        "confirmed": {**_confirmed(study.confirmed), "cannot_teach": dict(study.unable)},
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
        "zero_shot": trial.zero_shot.value,
    }


def _confirmed(experiment: Experiment) -> dict[str, Any]:
    """The finalists, taught anew: what each is worth, and how much the best saves more than each."""
    best = best_teacher(experiment)
    return {
        "best": best.name if best else None,
        "settled": experiment.settled,
        "finalists": {
            one.name: {
                "theta": theta_of(one.proxy),
                "zero_shot": one.zero_shot.value,
                "plv": estimate(one.worth.plv if one.worth else None),
                "plv_cost": estimate(one.cost),
                "needed": estimate(one.worth.needed if one.worth else None),
                "best_saves_more": estimate(saves_more(experiment, best.name, one.name)) if best else None,
            }
            for one in experiment.teachers
        },
    }


def plv_table(study: PlvStudy, files: Mapping[str, Any]) -> RenderableType:
    """The trials, the best one first, and what was searched."""
    table = _table("trial", study, SCORES)
    ordered = sorted(study.trials, key=lambda trial: (trial is not study.best, trial.number))
    for trial in ordered:
        scores = (one_decimal(trial.zero_shot), count(trial.worth.needed), count(trial.worth.plv, UNKNOWN))
        table.add_row(str(trial.number), *_spans(study, trial.proxy), *scores)
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
    finals = _table("finalist", study, (*SCORES, "the best saves more by"))
    for row in _final_rows(study):
        finals.add_row(*row)
    above, below = map(Text, lines), map(Text, study.unable.values())
    return Group(Text(head), table, *above, Text(f"\n{CONFIRMED}"), finals, *below)


def _table(first: str, study: PlvStudy, figures: tuple[str, ...]) -> Table:
    """An empty table of proxies: what they are called, p(θ) by parameter, and figures."""
    table = Table(box=None, pad_edge=False)
    table.add_column(first, overflow="fold")
    for name in (*study.settings.space.names, *figures):
        table.add_column(name, justify="right", overflow="fold")
    return table


def _spans(study: PlvStudy, proxy: Distribution) -> list[str]:
    """What each parameter is in a proxy, or between which values it is drawn."""
    bounds = [proxy.bounds[name] for name in study.settings.space.names]
    return [short(low) if low == high else f"{short(low)} to {short(high)}" for low, high in bounds]


def _final_rows(study: PlvStudy) -> list[tuple[str, ...]]:
    """The finalists as texts: their θ, and what they are worth."""
    experiment, best = study.confirmed, best_teacher(study.confirmed)
    rows: list[tuple[str, ...]] = []
    for one in experiment.teachers:
        plv = count(one.worth.plv, UNKNOWN) if one.worth else UNKNOWN
        needed = count(one.worth.needed) if one.worth else ""
        less = count(saves_more(experiment, best.name, one.name), UNKNOWN) if best and best is not one else ""
        rows.append((one.name, *_spans(study, one.proxy), one_decimal(one.zero_shot), needed, plv, less))
    return rows
