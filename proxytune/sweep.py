"""Usefulness along one parameter of the domain family, the others held, as at the study's answer (`best_theta`).

`run_sweep` simulates what is missing of a sweep's points, and `curve_of` makes a `SweepCurve` of them. POD is simulated
as a domain family of its own, `Discrepancy`: the same commands in proxy and target, and how unlike the two answer.
`series_of` takes a curve apart into one series per measure, each with its interval and direction; `shape_of` says where
a measure is best, and whether it gets worse on both sides of where it was held.
"""

import functools
import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Literal, Protocol

import numpy as np

from proxytune import usefulness
from proxytune.arrays import Floats
from proxytune.domain import DomainFamily, Episode
from proxytune.errors import InputError, SettingsError
from proxytune.identity import digest
from proxytune.settings import check_numbers, nearest
from proxytune.space import Interval, Parameter, Theta
from proxytune.storage import Store, SweepRecord, is_begun
from proxytune.study import (
    LEARNING,
    WITHOUT_THETA,
    Evaluation,
    Study,
    StudyRun,
    check_model,
    describe,
    load_family,
    plan_episodes,
    result_of,
    stored_run,
)
from proxytune.usefulness import ALL, MEASURES, PODS, Assessment, Measure, Measured, assess


def has_answer(study: Study) -> bool:
    """Tell whether a trial of a search by predictivity is finished; a search for PLV has its answer elsewhere."""
    if study.settings.objective == LEARNING or not is_begun(study.settings.home):
        return False
    with Store.read(study.settings.home) as store:
        return any(trial.state == "finished" for trial in store.trials(study.objective.name))


def best_theta(study: Study, option: str = "--at") -> Theta:
    """The best θ that the study has found so far; the option that asks for it is named in complaints."""
    if not has_answer(study):
        folder = study.settings.home
        if study.settings.objective == LEARNING:
            remedy = f"give θ itself: {option} NAME=VALUE,NAME=VALUE"
            raise InputError(f"{folder}: is a {WITHOUT_THETA}; {remedy}")
        raise InputError(f"{folder}: has no finished trial; run it first (python -m proxytune study {folder})")
    with Store.read(study.settings.home) as store:
        try:
            run = stored_run(study, store)
        except SettingsError as problem:
            raise InputError(f"{problem}; or hold other values: {option} nominal") from None
        return dict(result_of(run).best.trial.theta)


COMMANDS = 100
"""At most so many commands are replayed, 5 s at 20 Hz: later, two domains are far apart whatever their difference."""
REPLAYED = "f1b2d6a3eda6bd6409dcf09bb3bf65753aad6648d68c23ac343b313fa66dcbc8"
"""Names how replays are compared: what is kept of them is found by it. Change it where they are compared otherwise."""
METRICS = {"pod_pose": "m", "pod_image": "of full scale"}


class Replayable(DomainFamily, Protocol):
    """A domain family that can also repeat commands, and be a key of a cache."""

    def __hash__(self) -> int: ...

    def drive(self, episode: Episode) -> Any:
        """Drive an episode; the answer's `commands` (control steps, …) are what the agent issued."""
        ...

    def replay(self, episode: Episode, commands: Any) -> Any:
        """Drive commands in place of the episode's agent, from the episode's start and with its seed.

        The answer has `poses` (ticks + 1, 3), the start first, and `pictures` (steps, rows, columns, channels).
        """
        ...


@dataclass(frozen=True)
class Discrepancy:
    """A family whose episodes are replays on both of what an agent issued on the target, scored by discrepancies."""

    proxy: Replayable
    target: Replayable

    @property
    def identity(self) -> str:
        """A digest of both families and of how they are compared."""
        return digest(repr([self.proxy.identity, self.target.identity, REPLAYED]))

    @property
    def metrics(self) -> Mapping[str, str]:
        """POD of poses and of images, with their units."""
        return METRICS

    @property
    def parameters(self) -> Mapping[str, Parameter]:
        """Those of the proxy."""
        return self.proxy.parameters

    @property
    def starts(self) -> int:
        """Those of the proxy."""
        return self.proxy.starts

    def check_agent(self, name: str) -> None:
        """Refuse an agent that the target cannot run."""
        self.target.check_agent(name)

    def run(self, episode: Episode) -> Mapping[str, float]:
        """Replay in both domains and compare, eq. (1), over the time until the first of them ends."""
        commands, there = _on_target(self.target, replace(episode, theta=()))
        here = self.proxy.replay(episode, commands)
        poses, pictures = (min(map(len, both)) for both in ((here.poses, there.poses), (here.pictures, there.pictures)))
        # The start is the same by construction, so it is no observation.
        pose = usefulness.pod_of_poses(proxy=here.poses[1:poses], target=there.poses[1:poses])
        image = usefulness.pod_of_images(proxy=here.pictures[:pictures], target=there.pictures[:pictures])
        return {"pod_pose": pose, "pod_image": image}


@functools.lru_cache(maxsize=64)
def _on_target(target: Replayable, episode: Episode) -> tuple[Any, Any]:
    """Commands of the agent and the poses they led to; the same at every point of a sweep."""
    commands = np.asarray(target.drive(episode).commands)[:COMMANDS]
    return commands, target.replay(episode, commands)


def discrepancy_study(study: Study, model: Path) -> Study:
    """The study whose episodes are replays of its first agent's commands on the target that a model describes."""
    check_model(study.settings, model, "--target-model")
    proxy: Any = study.family
    if not (hasattr(proxy, "drive") and hasattr(proxy, "replay")):
        lacks = f"family {study.settings.family} has no `drive` and `replay`, without which there is no POD"
        raise InputError(f"--target-model: {lacks}; leave the option out")
    target: Any = load_family(study.settings, model)
    both = Discrepancy(proxy, target)
    return Study(replace(study.settings, agents=study.settings.agents[:1]), both, study.target, both.identity)


RESAMPLES = 1000
DECIMALS = 12
"""Grid values are rounded to so many, that 0.1 is 0.1 and not a hair less."""


@dataclass(frozen=True)
class PodMean:
    """A POD in its own unit over the starts that worked; its interval is bootstrapped, None for a single start."""

    value: float
    interval: tuple[float, float] | None
    starts: int


@dataclass(frozen=True)
class SweepPoint:
    """One point of a curve."""

    value: float  # the parameter, in its unit
    evaluation: Evaluation  # what the agents scored there
    assessment: Assessment | None  # how useful the proxy is there; None if an agent has no episode that worked
    # "pod_pose" [m] and "pod_image" [of full scale]; empty where POD was not asked for or every replay failed
    pod: Mapping[str, PodMean] = field(default_factory=dict)


@dataclass(frozen=True)
class SweepCurve:
    """Usefulness along one parameter."""

    parameter: str  # its name
    unit: str
    base: Theta  # what the other parameters are held at; those not named are nominal
    metrics: tuple[str, ...]  # how agents are compared
    points: tuple[SweepPoint, ...]  # in rising order of the parameter
    has_pod: bool = False  # whether POD was asked for

    @property
    def label(self) -> str:
        """The parameter with its unit, as axes and columns name it."""
        return f"{self.parameter} [{self.unit}]" if self.unit else self.parameter


def sweep_interval(study: Study, parameter: str) -> Interval:
    """The interval of a sweep: the study's box, or a parameter's usual range where the study does not search it."""
    boxes = {interval.name: interval for interval in study.settings.space.intervals}
    if parameter in boxes:
        return boxes[parameter]
    return Interval(parameter, *_parameter(study, parameter).usual_range)


def check_base(study: Study, base: Theta) -> None:
    """Refuse values that the family cannot take."""
    check_numbers(base)
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
    describe(run.study, run.store)
    run.store.save_sweep(run.study.identity, sweep)
    replays = run.of(discrepancy) if discrepancy is not None else None
    for number, value in enumerate(sweep.points, start=1):
        what = f"{sweep.parameter} {number} of {len(sweep.points)}"
        scored = run.evaluate(_theta(sweep, value), what)
        if replays is not None:
            replays.outcomes(plan_episodes(replays.settings, _theta(sweep, value)), f"POD, {what}")
        came = "failed" if scored.prpv is None else f"PRPV {scored.prpv:g}"
        run.watcher.finished(f"{what}, at {value:g}: {came}")
    if replays is not None:
        run.spent += replays.spent


def curve_of(run: StudyRun, sweep: SweepRecord) -> SweepCurve | None:
    """The curve of a sweep from what has been simulated; None if an episode is still missing."""
    points = [point for value in sweep.points if (point := _point(run, sweep, value))]
    if len(points) < len(sweep.points):
        return None
    unit = run.study.family.parameters[sweep.parameter].unit
    names = run.settings.metric_names
    return SweepCurve(sweep.parameter, unit, sweep.base, names, tuple(points), bool(sweep.replays))


def pod_mean(values: Sequence[float]) -> PodMean:
    """Average a POD over starts, with the percentile bootstrap interval of the mean."""
    found = np.asarray(values, dtype=np.float64)
    if len(found) < 2:
        return PodMean(float(found.mean()), None, len(found))
    draws = np.random.default_rng(0).integers(len(found), size=(RESAMPLES, len(found)))
    return PodMean(float(found.mean()), usefulness.interval(found[draws].mean(axis=1)), len(found))


def all_curves(run: StudyRun) -> Sequence[SweepCurve]:
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
    planned = plan_episodes(replayed, _theta(sweep, value))
    known = run.store.outcomes(sweep.replays, _theta(sweep, value))
    if not all(episode in known for episode in planned):
        return None
    worked = [metrics for episode in planned if (metrics := known[episode].metrics) is not None]
    return {name: pod_mean([one[name] for one in worked]) for name in METRICS} if worked else {}


UNKNOWN = Measured(None, None)


@dataclass(frozen=True)
class Series:
    """One measure along the parameter, ALL or of one metric: an estimate by each value of that, in rising order."""

    measure: Measure
    metric: str
    estimates: Mapping[float, Measured]

    @property
    def key(self) -> str:
        """Its name in files: prpv, ppv, srcc_<metric>, kendall_tau_<metric>, mmrv_<metric>, pod_pose, pod_image."""
        return self.measure.key_for(self.metric)

    @property
    def name(self) -> str:
        """Its name for people."""
        return self.measure.name_for(self.metric)


def series_of(curve: SweepCurve) -> tuple[Series, ...]:
    """Every measure of a curve; POD only where it was asked for."""

    def along(measure: Measure, metric: str, found: Sequence[Measured]) -> Series:
        return Series(measure, metric, dict(zip((point.value for point in curve.points), found, strict=True)))

    series = []
    for measure in MEASURES:
        found = [measure.measured(point.assessment) if point.assessment else {} for point in curve.points]
        metrics = curve.metrics if measure.per_metric else (ALL,)
        series += [along(measure, metric, [one.get(metric, UNKNOWN) for one in found]) for metric in metrics]
    for measure in PODS if curve.has_pod else ():
        pods = [point.pod.get(measure.key) for point in curve.points]
        series.append(along(measure, ALL, [Measured(one.value, one.interval) if one else UNKNOWN for one in pods]))
    return tuple(series)


Side = Literal["worsens", "flat", "turns", "unknown", "unseen"]
OUTWARDS: dict[Side, str] = {
    "worsens": "worsens monotonically within noise",
    "flat": "does not end up worse beyond noise",
    "turns": "turns: gets better again beyond noise",
    "unknown": "cannot be judged without intervals",
    "unseen": "was not looked at",
}


@dataclass(frozen=True)
class Shape:
    """The shape of one measure along a parameter.

    Noise is told by the points' own 95 % intervals: one point is beyond noise of another where the two do not meet.
    That is cautious, since the points share their starts. A point without interval is beyond noise of none.
    """

    best: tuple[float, ...]  # the values of the parameter where the measure is best; empty if it is defined nowhere
    score: float | None  # its score there
    near_best: tuple[float, ...]  # the values where it is not worse beyond noise than any of the best
    worse: tuple[float, ...]  # those where it is; of others, without an interval, that is not known
    held: float | None  # where the parameter is held when others are swept; None if that was not said
    # what the measure does from there downwards: "worsens" if it never gets better again beyond noise and ends up
    # worse beyond noise, "flat" if neither, "turns" if it gets better again beyond noise, "unknown" where there
    # is no interval at an end, "unseen" without a point
    below: Side
    above: Side  # the same upwards

    @property
    def monotone(self) -> bool | None:
        """True if it worsens on every side that was seen, without a turn; None where that cannot be told."""
        seen = {self.below, self.above} - {"unseen"}
        if seen & {"flat", "turns"}:
            return False
        return True if seen == {"worsens"} else None


def shape_of(series: Series, held: float | None) -> Shape:
    """Describe one measure round the value at which its parameter is held, as a pure function."""
    sign = 1.0 if series.measure.lower_is_better else -1.0
    known = {value: one for value, one in series.estimates.items() if one.value is not None}
    if not known:
        return Shape((), None, (), (), held, "unseen", "unseen")
    # Turned such that lower is better.
    costs = sign * np.array([one.value for one in known.values()])
    ends = sign * np.array([one.interval or (-math.inf, math.inf) for one in known.values()])
    lows, highs = np.minimum(costs, ends.min(axis=1)), np.maximum(costs, ends.max(axis=1))
    values, best = list(known), costs == costs.min()
    told = np.array([one.interval is not None for one in known.values()])
    # Of several that are best, what is beyond noise of one is worse.
    near = lows <= np.where(told, highs, costs)[best].min()
    masks = (best, best | (told & near), told & ~near & ~best)
    at_best, near_best, worse = (tuple(itertools.compress(values, mask)) for mask in masks)
    sides = (_side(values[::-1], lows[::-1], highs[::-1], held), _side(values, lows, highs, held))
    return Shape(at_best, sign * float(costs.min()) + 0.0, near_best, worse, held, *sides)


def describe_shape(series: Series, held: float | None) -> str:
    """The shape in one line."""
    shape = shape_of(series, held)
    if shape.score is None:
        return f"{series.name}: undefined at every point"
    extreme = "lowest" if series.measure.lower_is_better else "highest"
    best, near = ", ".join(map(_number, shape.best)), _listed(shape.near_best, series)
    line = f"{series.name}: {extreme} ({shape.score:.3g}) at {best}; not worse beyond noise: {near}"
    judged = {*shape.near_best, *shape.worse}
    if unknown := [value for value, one in series.estimates.items() if one.value is not None and value not in judged]:
        line += f" (noise not known at {', '.join(map(_number, unknown))})"
    if held is None or "unseen" == shape.below == shape.above:
        return line
    return f"{line}; from {_number(held)} downwards it {OUTWARDS[shape.below]}, upwards it {OUTWARDS[shape.above]}"


def _listed(chosen: Sequence[float], series: Series) -> str:
    """The values as a range where they are one, by name where there are gaps."""
    known = (value for value, one in series.estimates.items() if one.value is not None)
    between = [value for value in known if chosen[0] <= value <= chosen[-1]]
    if len(chosen) > 1 and len(between) == len(chosen):
        return f"{_number(chosen[0])} to {_number(chosen[-1])}"
    return ", ".join(map(_number, chosen))


def _number(value: float) -> str:
    return f"{value:.4g}".replace("-", "−")


def _side(values: list[float], lows: Floats, highs: Floats, held: float | None) -> Side:
    """The course outwards of the held value; the points come in outward order."""
    if held is None or held not in values[:-1]:
        return "unseen"
    begin = values.index(held)
    lows, highs = lows[begin:], highs[begin:]
    if (highs[1:] < np.maximum.accumulate(lows)[:-1]).any():
        return "turns"
    if math.inf in (highs[0], highs[-1]):
        return "unknown"
    return "worsens" if lows[-1] > highs[0] else "flat"
