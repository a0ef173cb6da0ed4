"""Usefulness along one parameter of the domain family, the others held."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from proxytune.errors import InputError
from proxytune.settings import nearest
from proxytune.space import Interval, Parameter, Theta
from proxytune.storage.records import SweepRecord
from proxytune.study.evaluation import Evaluation, plan
from proxytune.study.study import Study
from proxytune.study.study_run import StudyRun
from proxytune.sweep.discrepancy import METRICS
from proxytune.usefulness import Assessment, assess
from proxytune.usefulness.resampling import interval as central_interval

RESAMPLES = 1000
DECIMALS = 12
"""Grid values are rounded to so many, that 0.1 is 0.1 and not a hair less."""


@dataclass(frozen=True)
class PodMean:
    """A POD averaged over the starts.

    Attributes:
        value: In its own unit.
        interval: Its bootstrap interval over the starts; None for a single start.
        starts: How many starts worked.
    """

    value: float
    interval: tuple[float, float] | None
    starts: int


@dataclass(frozen=True)
class SweepPoint:
    """One point of a curve.

    Attributes:
        value: The parameter, in its unit.
        evaluation: What the agents scored there.
        assessment: How useful the proxy is there; None if an agent has no episode that worked.
        pod: "pod_pose" [m] and "pod_image" [of full scale]; empty where POD was not asked for or every replay failed.
    """

    value: float
    evaluation: Evaluation
    assessment: Assessment | None
    pod: Mapping[str, PodMean] = field(default_factory=dict)


@dataclass(frozen=True)
class Curve:
    """Usefulness along one parameter.

    Attributes:
        parameter: Its name.
        unit: Its unit.
        base: What the other parameters are held at; those not named are nominal.
        metrics: How agents are compared.
        points: In rising order of the parameter.
        has_pod: Whether POD was asked for.
    """

    parameter: str
    unit: str
    base: Theta
    metrics: tuple[str, ...]
    points: tuple[SweepPoint, ...]
    has_pod: bool = False

    @property
    def label(self) -> str:
        """The parameter with its unit, as axes and columns name it."""
        return f"{self.parameter} [{self.unit}]" if self.unit else self.parameter


def sweep_interval(study: Study, parameter: str) -> Interval:
    """Where a parameter is swept: over the study's box, or over all it may be where the study does not search it.

    Raises:
        InputError: If the family has no such parameter.
    """
    boxes = {interval.name: interval for interval in study.settings.space.intervals}
    if parameter in boxes:
        return boxes[parameter]
    known = _parameter(study, parameter)
    return Interval(parameter, known.low, known.high)


def check_base(study: Study, base: Theta) -> None:
    """Refuse values that the family cannot take.

    Raises:
        InputError: With the parameter's name.
    """
    for name, value in base.items():
        known = _parameter(study, name)
        if not known.low <= value <= known.high:
            raise InputError(f"parameter '{name}': must lie within [{known.low:g}, {known.high:g}], got {value:g}")


def _parameter(study: Study, name: str) -> Parameter:
    known = study.family.parameters
    if name not in known:
        raise InputError(f"no parameter '{name}' in this study's domain family; {nearest(name, known)}")
    return known[name]


def plan_sweep(interval: Interval, base: Theta, points: int) -> SweepRecord:
    """An even grid over the interval, both ends included, and the parameter's own value in the base if it has one."""
    grid = np.linspace(interval.low, interval.high, points).round(DECIMALS).tolist()
    own = [base[interval.name]] if interval.name in base else []
    return SweepRecord(interval.name, dict(base), tuple(sorted({*grid, *own})))


def with_target(sweep: SweepRecord, model: Path, discrepancy: Study) -> SweepRecord:
    """The sweep with POD besides, against the target of this model (discrepancy.discrepancy_study)."""
    return replace(sweep, target_model=model.read_text(encoding="utf-8"), replays=discrepancy.identity)


def run_sweep(run: StudyRun, sweep: SweepRecord, discrepancy: Study | None = None) -> None:
    """Simulate what is missing of a sweep; episodes are shared with the study's trials and other sweeps.

    With the study of the discrepancy that the sweep names (with_target), POD is simulated too.
    """
    run.store.save_sweep(run.study.identity, sweep)
    replays = run.of(discrepancy) if discrepancy is not None else None
    for number, value in enumerate(sweep.points, start=1):
        what = f"{sweep.parameter} {number} of {len(sweep.points)}"
        scored = run.evaluate(_theta(sweep, value), what)
        if replays is not None:
            planned = plan(replays.settings, _theta(sweep, value), replays.settings.seed)
            replays.outcomes(planned, f"POD, {what}")
        came = "failed" if scored.prpv is None else f"PRPV {scored.prpv:g}"
        run.watcher.finished(f"{what}, at {value:g}: {came}")
    if replays is not None:
        run.spent += replays.spent


def curve_of(run: StudyRun, sweep: SweepRecord) -> Curve | None:
    """The curve of a sweep from what has been simulated; None if an episode is still missing."""
    points = [point for value in sweep.points if (point := _point(run, sweep, value))]
    if len(points) < len(sweep.points):
        return None
    unit = run.study.family.parameters[sweep.parameter].unit
    metrics = tuple(metric.name for metric in run.settings.metrics)
    return Curve(sweep.parameter, unit, sweep.base, metrics, tuple(points), bool(sweep.replays))


def pod_mean(values: Sequence[float], *, seed: int = 0) -> PodMean:
    """Average a POD over starts, with the percentile bootstrap interval of the mean."""
    found = np.asarray(values, dtype=np.float64)
    if len(found) < 2:
        return PodMean(float(found.mean()), None, len(found))
    draws = np.random.default_rng(seed).integers(len(found), size=(RESAMPLES, len(found)))
    return PodMean(float(found.mean()), central_interval(found[draws].mean(axis=1)), len(found))


def all_curves(run: StudyRun) -> Sequence[Curve]:
    """The curves of every sweep that has been finished, the last one last, each in the domain family of then."""
    study = run.study
    known = [(identity, sweep) for identity, sweep in run.store.sweeps() if sweep.parameter in study.family.parameters]
    curves = [curve_of(run.of(replace(study, identity=identity)), sweep) for identity, sweep in known]
    return [curve for curve in curves if curve is not None]


def _theta(sweep: SweepRecord, value: float) -> dict[str, float]:
    return {**sweep.base, sweep.parameter: value}


def _point(run: StudyRun, sweep: SweepRecord, value: float) -> SweepPoint | None:
    """One point from what has been simulated; None if an episode or a replay is still missing."""
    known = run.evaluation(_theta(sweep, value))
    pod = _pod(run, sweep, value) if sweep.replays else {}
    if known is None or pod is None:
        return None
    assessment = None
    if known.proxy is not None:
        assessment = assess(proxy=known.proxy, target=run.study.target, metrics=run.settings.metrics)
    return SweepPoint(value, known, assessment, pod)


def _pod(run: StudyRun, sweep: SweepRecord, value: float) -> dict[str, PodMean] | None:
    # Its first agent's commands are replayed, as discrepancy_study has it.
    replayed = replace(run.settings, agents=run.settings.agents[:1])
    planned = plan(replayed, _theta(sweep, value), replayed.seed)
    known = run.store.outcomes(sweep.replays, _theta(sweep, value))
    if not all(episode in known for episode in planned):
        return None
    worked = [metrics for episode in planned if (metrics := known[episode].metrics) is not None]
    return {name: pod_mean([one[name] for one in worked]) for name in METRICS} if worked else {}
