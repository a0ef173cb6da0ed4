"""The finalists of a search by PLV, taught anew: the best p(θ), the best single θ, all of the box, and PRPV's choice.

The highest of many uncertain PLVs is partly luck; what the finalists are worth is told by lessons, learners and
examinations that the search has not used.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from proxytune.errors import LearnerError
from proxytune.learning.lessons import Distribution
from proxytune.learning.plv import Estimate, difference
from proxytune.learning.settings import NONE, TeachingSettings
from proxytune.learning.spending import curves_of
from proxytune.running.progress import Watcher
from proxytune.search.design import from_unit, unit_points
from proxytune.search.proposer import Trial, with_failures_as_worst
from proxytune.search.surrogate import Array, Surrogate, fit_surrogate, unit_array
from proxytune.seeds import fresh_seed, proposal_seed
from proxytune.space import Space, Theta
from proxytune.study.settings import StudySettings
from proxytune.teaching.box import WIDTH, distribution
from proxytune.teaching.examining import count_examinations, examine_curves
from proxytune.teaching.experiment import Experiment, TeacherResult, judge_curves
from proxytune.teaching.points import Point, TeachingSetup
from proxytune.teaching.spreading import prepare_points

BEST, SINGLE, BOX, BY_PRPV = "best p(θ)", "best single θ", "all of the box", "lowest PRPV"
CLOUD = 4096
CLOSER = 2
"""A finalist gets so many times the examinations of a trial, where these are chosen."""


@dataclass(frozen=True)
class Confirmation:
    """What the finalists are worth under fresh seeds.

    Attributes:
        experiment: Those that can teach, and the learner without a proxy.
        unable: Why each of the others cannot, by name.
    """

    experiment: Experiment
    unable: Mapping[str, str]


def finalists(
    setup: TeachingSetup, settings: StudySettings, space: Space, trials: Sequence[Trial], by_prpv: Theta | None
) -> dict[str, Distribution]:
    """The distributions that are worth a closer look, by name; none twice.

    Args:
        setup: Of the learning experiment.
        settings: Of the study, whose whole box is one of the finalists where widths are searched.
        space: What was searched.
        trials: Those that have ended.
        by_prpv: The θ of lowest PRPV, None where that is not known.
    """
    if all(trial.score is None for trial in trials):
        return {}
    surrogate = fit_surrogate(space, with_failures_as_worst(trials))
    widths = np.array([name.endswith(WIDTH) for name in space.names])
    points = _points(surrogate, settings.seed)
    single = np.where(widths, 0.0, points)
    named = {SINGLE: distribution(setup, _without_width(_lowest(surrogate, single)))}
    if widths.any():
        whole = {box.name: (box.low, box.high) for box in settings.space.intervals}
        named = {BEST: distribution(setup, _lowest(surrogate, points)), **named, BOX: Distribution(whole)}
    if by_prpv is not None:
        named[BY_PRPV] = distribution(setup, by_prpv)
    return {name: one for name, one in named.items() if name == next(first for first in named if named[first] == one)}


def most_examinations(taught: TeachingSettings) -> int:
    """The most that a search by PLV takes: every trial, four finalists, and the learner without a proxy beside both."""
    return count_examinations(taught, taught.budget + 1) + count_examinations(_closer(taught), 5)


def _closer(taught: TeachingSettings) -> TeachingSettings:
    """How finalists are examined."""
    return replace(taught, examinations=taught.examinations and CLOSER * taught.examinations)


def confirm(
    settings: StudySettings, setup: TeachingSetup, named: Mapping[str, Distribution], watcher: Watcher
) -> Confirmation:
    """Teach the finalists and the learner without a proxy under fresh seeds."""
    taught = _closer(setup.settings)
    fresh = replace(setup, seed=fresh_seed(setup.seed, 1), settings=taught)
    unable = {name: reason for name, proxy in named.items() if (reason := _why_unable(fresh, name, proxy))}
    able = {name: proxy for name, proxy in named.items() if name not in unable}
    fresh = replace(fresh, settings=replace(taught, proxies=able))
    scores = examine_curves(fresh, {NONE: None, **able}, settings.jobs, watcher)
    return Confirmation(judge_curves(settings, fresh, curves_of(taught.target_samples, scores)), unable)


def _why_unable(setup: TeachingSetup, name: str, proxy: Distribution) -> str:
    """Why a proxy cannot teach, empty if it can: nobody has driven in it before, and its expert may leave the road."""
    try:
        prepare_points(setup, [Point(name, proxy, 0, 0)], jobs=1)
    except LearnerError as problem:
        return str(problem)
    return ""


def best_teacher(experiment: Experiment) -> TeacherResult | None:
    """The proxy of highest PLV, the first of them; None where no PLV is known."""
    return max((one for one in experiment.teachers if np.isfinite(_plv(one))), key=_plv, default=None)


def _plv(one: TeacherResult) -> float:
    """PLV, minus infinity where it is not known."""
    value = one.worth.plv.value if one.worth else None
    return -np.inf if value is None else value


def saves_more(experiment: Experiment, name: str, other: str) -> Estimate:
    """How many target samples one proxy saves more than another: what the other needs less what the one needs."""
    return difference(experiment.needs, more=other, less=name)


def _points(surrogate: Surrogate, seed: int) -> Array:
    """Where the best is looked for: a cloud over the unit cube, and the points tried."""
    tried = unit_array(surrogate.space, [trial.values for trial in surrogate.visited])
    cloud = unit_points(tried.shape[1], CLOUD, proposal_seed(seed, len(tried)))
    return np.concatenate((tried, cloud))


def _lowest(surrogate: Surrogate, points: Array) -> Theta:
    """The θ of the point with the lowest posterior mean score, which is PLV with its sign turned."""
    return surrogate.space.theta(from_unit(surrogate.space, points[int(np.argmin(surrogate.mean(points)))]))


def _without_width(theta: Theta) -> Theta:
    return {name: value for name, value in theta.items() if not name.endswith(WIDTH)}
