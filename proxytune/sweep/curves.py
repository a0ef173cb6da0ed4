"""A sweep's curve as one series per measure, each with its interval and direction."""

from collections.abc import Callable
from dataclasses import dataclass

from proxytune.sweep.sweep import Curve, SweepPoint
from proxytune.usefulness import Assessment

Ends = tuple[float, float]
PER_METRIC = {"srcc": ("SRCC", True), "kendall_tau": ("Kendall τ", True), "mmrv": ("MMRV", False)}
"""Measures that each metric has: what they are called, and whether higher is better."""
PODS = {"pod_pose": "POD pose", "pod_image": "POD image"}


@dataclass(frozen=True)
class Estimate:
    """A measure at one value of the parameter; None where it is undefined or has no interval."""

    value: float
    score: float | None
    interval: Ends | None


@dataclass(frozen=True)
class Series:
    """One measure along the parameter.

    Attributes:
        key: Its name in files: prpv, ppv, srcc_<metric>, kendall_tau_<metric>, mmrv_<metric>, pod_pose, pod_image.
        name: Its name for people.
        higher_is_better: Its direction.
        estimates: One per point, in rising order of the parameter.
    """

    key: str
    name: str
    higher_is_better: bool
    estimates: tuple[Estimate, ...]


def series_of(curve: Curve) -> tuple[Series, ...]:
    """Every measure of a curve; POD only where it was asked for."""
    found = [
        _series(curve, "prpv", "PRPV", False, _assessed(_prpv)),
        _series(curve, "ppv", "PPV", False, _assessed(_ppv)),
    ]
    for measure, (name, higher) in PER_METRIC.items():
        for metric in curve.metrics:
            key, called = f"{measure}_{metric}", f"{name} {metric}"
            found.append(_series(curve, key, called, higher, _assessed(_per_metric(measure, metric))))
    if curve.has_pod:
        found += [_series(curve, key, name, False, _pod(key)) for key, name in PODS.items()]
    return tuple(found)


Reader = Callable[[SweepPoint], tuple[float | None, Ends | None]]


def _series(curve: Curve, key: str, name: str, higher: bool, read: Reader) -> Series:
    return Series(key, name, higher, tuple(Estimate(point.value, *read(point)) for point in curve.points))


def _assessed(read: Callable[[Assessment], tuple[float | None, Ends | None]]) -> Reader:
    return lambda point: (None, None) if point.assessment is None else read(point.assessment)


def _prpv(found: Assessment) -> tuple[float | None, Ends | None]:
    inner = found.prpv_interval
    return found.prpv.value, None if inner.low is None or inner.high is None else (inner.low, inner.high)


def _ppv(found: Assessment) -> tuple[float | None, Ends | None]:
    return found.ppv.value, found.intervals.ppv if found.intervals else None


def _per_metric(measure: str, metric: str) -> Callable[[Assessment], tuple[float | None, Ends | None]]:
    def read(found: Assessment) -> tuple[float | None, Ends | None]:
        inner = getattr(found.intervals, measure)[metric] if found.intervals else None
        return getattr(found, measure).value[metric], inner

    return read


def _pod(key: str) -> Reader:
    return lambda point: (point.pod[key].value, point.pod[key].interval) if key in point.pod else (None, None)
