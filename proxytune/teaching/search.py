"""A study that looks for the proxy of highest learning value: θ, or p(θ) by the centre and width of each parameter.

Nothing but trained points is kept (see `Cache`): a proposal is a pure function of seed and finished trials, so a study
that is run again finds every trial it had and goes on after them.
"""

from collections.abc import Mapping
from dataclasses import dataclass

from proxytune.errors import RunError
from proxytune.learning.lessons import Distribution
from proxytune.learning.plv import Convergence, Curve, Teaching, settled, teaching
from proxytune.learning.settings import NONE
from proxytune.running.progress import Watcher
from proxytune.search.proposer import Proposer, Trial
from proxytune.space import Interval, Space, Theta
from proxytune.study.settings import StudySettings
from proxytune.teaching.experiment import convergence, learning_curves, teaching_settings
from proxytune.teaching.points import School

WIDTH = " width"
"""What the width of a parameter's distribution is called, after the parameter."""

SLACK = 1.0 / 30.0
"""A parameter that PRPV has pinned down is still searched over this share of its box, to both sides."""


@dataclass(frozen=True)
class PlvTrial:
    """One proxy tried as a teacher.

    Attributes:
        number: Counted from 1.
        theta: Centre and, where searched, width of each parameter's distribution.
        proxy: That p(θ).
        curve: Its learning curve.
        worth: What it is worth.
    """

    number: int
    theta: Theta
    proxy: Distribution
    curve: Curve
    worth: Teaching


@dataclass(frozen=True)
class PlvStudy:
    """What a study of learning value has found.

    Attributes:
        settings: Of the study.
        space: The box that was searched: the study's, or what PRPV left of it, and the widths'.
        without: The learning curve without a proxy.
        when: When a learner counts as converged.
        trials: Every proxy tried, in order.
    """

    settings: StudySettings
    space: Space
    without: Curve
    when: Convergence
    trials: tuple[PlvTrial, ...]

    @property
    def narrowed(self) -> bool:
        """Whether PRPV has narrowed the box first."""
        return teaching_settings(self.settings).narrow

    @property
    def best(self) -> PlvTrial:
        """The trial of highest PLV, the first of them; where none is known, the first."""
        return max(self.trials, key=lambda trial: (plv_or_worst(trial), -trial.number))


def plv_or_worst(trial: PlvTrial) -> float:
    """PLV, minus infinity where the learner did not converge."""
    value = trial.worth.plv.value
    return float("-inf") if value is None else value


def search_space(
    settings: StudySettings, widths: Mapping[str, tuple[float, float]], left: Mapping[str, tuple[float, float]]
) -> Space:
    """The box that is searched for PLV: centres where PRPV cannot tell θ from the best, and widths as asked for.

    Args:
        settings: Of the study.
        widths: Bounds of the width of each parameter's distribution, by parameter.
        left: The ends of what PRPV cannot tell from the best, by parameter; empty where the box is not narrowed.

    Raises:
        SettingsError: If a width is of a parameter that is not searched.
    """
    for name in widths:
        if name not in settings.space.names:
            raise settings.error(f"teaching.width.{name}", "is not among [parameters]; add it there, or take this out")
    centres = [_narrowed(box, left.get(box.name)) for box in settings.space.intervals]
    return Space((*centres, *(Interval(name + WIDTH, *bounds) for name, bounds in sorted(widths.items()))))


def _narrowed(box: Interval, left: tuple[float, float] | None) -> Interval:
    if left is None:
        return box
    step = SLACK * (box.high - box.low)
    slack = step if left[1] - left[0] < step else 0.0
    return Interval(box.name, max(box.low, left[0] - slack), min(box.high, left[1] + slack), box.unit)


def run_plv_study(
    settings: StudySettings, school: School, proposer: Proposer, space: Space, watcher: Watcher
) -> PlvStudy:
    """Try as many proxies as the budget of [teaching] says, from wherever an earlier run was left.

    Raises:
        RunError: If the learner does not converge without a proxy, so that no PLV is known.
        LearnerError: If an expert cannot drive somewhere in the box.
    """
    taught = school.settings
    without = learning_curves(school, {NONE: None}, settings.jobs, watcher)[NONE]
    when = convergence(taught, without)
    if not settled(without, taught.tolerance):
        raise RunError(
            f"{settings.path}: without a proxy the score still rises by more than {taught.tolerance:g} up to "
            f"{without.counts[-1]} target samples, so PLV is not known; raise teaching.target_samples"
        )
    trials: list[PlvTrial] = []
    while len(trials) < taught.budget:
        told = [Trial(space.values(trial.theta), _score(trial)) for trial in trials]
        theta = space.theta(proposer.propose(space, told, settings.seed))
        proxy = distribution(school, theta)
        name = f"trial {len(trials) + 1}"
        curve = learning_curves(school, {name: proxy}, settings.jobs, watcher)[name]
        worth = teaching(without=without, with_proxy=curve, when=when)
        trials.append(PlvTrial(len(trials) + 1, theta, proxy, curve, worth))
    return PlvStudy(settings, space, without, when, tuple(trials))


def distribution(school: School, theta: Theta) -> Distribution:
    """p(θ) with these centres and widths, cut off at what each parameter can be."""
    bounds = {}
    for name, centre in theta.items():
        if not name.endswith(WIDTH):
            half, known = theta.get(name + WIDTH, 0.0) / 2.0, school.proxy.parameters[name]
            bounds[name] = (max(known.low, centre - half), min(known.high, centre + half))
    return Distribution(bounds)


def _score(trial: PlvTrial) -> float | None:
    """What is made small: minus PLV; None where the learner did not converge, which is as bad as the worst."""
    value = trial.worth.plv.value
    return None if value is None else -value
