"""The trials of a study, a row each."""

from collections.abc import Sequence

from proxytune.report.page.parts import Table
from proxytune.storage import TrialRecord

MEASURES = ("prpv", "ppv")


def trials_table(trials: Sequence[TrialRecord], names: Sequence[str], measures: Sequence[str] = MEASURES) -> Table:
    """Every trial that has ended: its θ, in the order of these names, and its measures, the first of which counts."""
    columns = ("trial", *names, *(name.upper() for name in measures), "failed episodes")
    return Table("Trials", columns, tuple(_row(trial, names, measures) for trial in trials))


def _row(trial: TrialRecord, names: Sequence[str], measures: Sequence[str]) -> tuple[str, ...]:
    theta = (f"{trial.theta[name]:.4g}" for name in names)
    first, *others = (trial.measures.get(name) for name in measures)
    counts = "failed" if first is None else f"{first:g}"
    if trial.bound is not None:
        counts = f"stopped early, at least {trial.bound:g}"
    beside = ("" if value is None else f"{value:.3g}" for value in others)
    return (str(trial.number), *theta, counts, *beside, str(trial.failed_episodes))
