"""A sweep's curve as one series per measure, each with its interval and direction."""

from dataclasses import dataclass

from proxytune.sweep.sweep import Curve, SweepPoint
from proxytune.usefulness import MEASURES, PODS, Measure, Measured
from proxytune.usefulness.intervals import Ends
from proxytune.usefulness.measure import ALL

UNKNOWN = Measured(None, None)


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
        measure: What is measured.
        metric: Of which metric; ALL where there is one value for all metrics.
        estimates: One per point, in rising order of the parameter.
    """

    measure: Measure
    metric: str
    estimates: tuple[Estimate, ...]

    @property
    def key(self) -> str:
        """Its name in files: prpv, ppv, srcc_<metric>, kendall_tau_<metric>, mmrv_<metric>, pod_pose, pod_image."""
        return self.measure.key_for(self.metric)

    @property
    def name(self) -> str:
        """Its name for people."""
        return self.measure.name_for(self.metric)

    @property
    def higher_is_better(self) -> bool:
        """Its direction."""
        return not self.measure.lower_is_better


def series_of(curve: Curve) -> tuple[Series, ...]:
    """Every measure of a curve; POD only where it was asked for."""
    on_scores = [one for measure in MEASURES for one in _of_measure(curve, measure)]
    pods = [_of_pod(curve, measure) for measure in PODS] if curve.has_pod else []
    return (*on_scores, *pods)


def _of_measure(curve: Curve, measure: Measure) -> list[Series]:
    """One series, or one per metric."""
    found = [measure.measured(point.assessment) if point.assessment else {} for point in curve.points]
    metrics = curve.metrics if measure.per_metric else (ALL,)
    return [_series(curve, measure, metric, [one.get(metric, UNKNOWN) for one in found]) for metric in metrics]


def _of_pod(curve: Curve, measure: Measure) -> Series:
    return _series(curve, measure, ALL, [_pod(point, measure) for point in curve.points])


def _pod(point: SweepPoint, measure: Measure) -> Measured:
    found = point.pod.get(measure.key)
    return Measured(found.value, found.interval) if found else UNKNOWN


def _series(curve: Curve, measure: Measure, metric: str, found: list[Measured]) -> Series:
    pairs = zip(curve.points, found, strict=True)
    return Series(measure, metric, tuple(Estimate(point.value, *one) for point, one in pairs))
