"""The learning experiment: learning curves with and without each proxy, and what each is worth as a teacher.

`run_experiment` teaches a learner in every proxy of [teaching], and `teach_families` in each of several families at its
best θ, for one target and one learner. `predictivity` says how well each proxy predicts: PRPV beside PLV, since the one
does not tell the other. `observe` holds the paper's two observations against an experiment: what zero-shot scores and
PRPV tell of PLV, by Kendall's τ of their rankings with its interval, from draws of both.
"""

from collections.abc import Callable, Mapping, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import cast

import numpy as np

from proxytune import learning, study, usefulness
from proxytune.arrays import Floats
from proxytune.domain import Classroom
from proxytune.errors import LearnerError
from proxytune.extensions import load
from proxytune.running import Watcher
from proxytune.space import Theta
from proxytune.teaching.examining import count_examinations, examine_curves, needs_of
from proxytune.teaching.points import TeachingSetup

CACHE = "teaching"
"""The folder, within a study's, where all that was taught is kept."""


@dataclass(frozen=True)
class TeacherResult:
    """The result of one proxy as a teacher."""

    name: str  # what it is called
    proxy: learning.Distribution  # its p(θ)
    # scores in the target after so many target samples, having learnt from the proxy first
    curve: learning.LearningCurve
    zero_shot: learning.LearningEstimate  # mean score before any target sample
    # PLV and what it is made of; None where the learner without a proxy has not converged
    worth: learning.TeachingValue | None
    cost: learning.LearningEstimate | None  # PLV in cost, in the unit of [teaching.costs]; None likewise


@dataclass(frozen=True)
class Experiment:
    """The result of a learning experiment."""

    settings: study.StudySettings  # of the study
    best_score: float  # the score of a flawless examination
    needs: learning.SampleNeeds  # how many target samples each learner needs, from the posterior of all learning curves
    teachers: tuple[TeacherResult, ...]  # one per proxy, in the order of study.toml

    @property
    def without(self) -> learning.LearningCurve:
        """The learning curve without a proxy."""
        return self.needs.curves[learning.NONE]

    @property
    def when(self) -> learning.Convergence:
        """The rule by which a learner counts as converged."""
        return self.needs.when

    @property
    def settled(self) -> bool:
        """True if the learner without a proxy converges."""
        return self.needs.settled


def load_setup(settings: study.StudySettings) -> TeachingSetup:
    """Load the families and the learner that a study's [teaching] names; an InputError tells file, key and remedy."""
    taught = teaching_settings(settings)
    with settings.complaints_about("teaching.learner"):
        found = load(taught.learner, kind="learner", beside=settings.folder, needs=("train", "act"), call=True)
    learner = cast(learning.Learner, found)
    return TeachingSetup(
        proxy=classroom(settings, settings.proxy, "proxy_lessons"),
        target=classroom(settings, taught.target, "target_lessons"),
        learner=learner,
        learner_identity=learning.learner_identity(learner),
        settings=taught,
        seed=settings.seed,
        starts=settings.starts,
        cache=learning.Cache(settings.home / CACHE),
        timeout_s=settings.episode_timeout_s,
    )


def teaching_settings(settings: study.StudySettings) -> learning.TeachingSettings:
    """The [teaching] table of a study; a SettingsError if it has none."""
    if settings.teaching is None:
        raise settings.error("teaching", "is missing; add the table, as in studies/teacher/study.toml")
    return settings.teaching


def run_experiment(settings: study.StudySettings, setup: TeachingSetup, watcher: Watcher) -> Experiment:
    """Teach every proxy's learner and the one without, from wherever an earlier run was left.

    Raises:
        InputError: If there is no proxy, or one's expert cannot drive.
        RunError: If a domain, the learner or the machine fails; all that was finished is kept.
    """
    check_proxies(settings, setup)
    scores = examine_curves(setup, {learning.NONE: None, **setup.settings.proxies}, settings.jobs, watcher)
    return judge_curves(settings, setup, learning.curves_of(setup.settings.target_samples, scores))


def judge_curves(
    settings: study.StudySettings, setup: TeachingSetup, curves: Mapping[str, learning.LearningCurve]
) -> Experiment:
    """Judge each proxy by the learning curves: a pure function of them and of what counts as converged."""
    needs = needs_of(setup, curves)
    teachers = [_teacher(setup.settings, needs, name, proxy) for name, proxy in setup.settings.proxies.items()]
    return Experiment(settings, setup.target.best_score, needs, tuple(teachers))


def _teacher(
    taught: learning.TeachingSettings, needs: learning.SampleNeeds, name: str, proxy: learning.Distribution
) -> TeacherResult:
    zero_shot, curve = learning.mean_score(needs, name, 0), needs.curves[name]
    if not needs.settled:
        return TeacherResult(name, proxy, curve, zero_shot, None, None)
    worth = learning.teaching_value(needs, name)
    # PLV in cost (eq. 6)
    cost = learning.estimate_figure(
        lambda without, needed: taught.cost_saved(without=without, needed=needed), needs, more=learning.NONE, less=name
    )
    return TeacherResult(name, proxy, curve, zero_shot, worth, cost)


def check_proxies(settings: study.StudySettings, setup: TeachingSetup) -> None:
    """Refuse by a SettingsError a study without proxies, an unknown parameter, or a value beyond its bounds."""
    if not setup.settings.proxies:
        raise settings.error("teaching.proxies", "is missing; name at least one, as in [teaching.proxies.nominal]")
    for proxy, where in setup.settings.proxies.items():
        for name, (low, high) in where.bounds.items():
            key, given = f"teaching.proxies.{proxy}.{name}", f"{low:g} to {high:g}"
            study.check_bounds(settings, setup.proxy, key, name, (low, high), given)


def classroom(settings: study.StudySettings, model: Path | None, lessons: str) -> Classroom:
    """The domain family that a study names, with a model: one that can teach, for lessons as their key has them."""
    family = study.load_family(settings, model)
    if lacks := [member for member in ("best_score", "demonstrate", "examine") if not hasattr(family, member)]:
        raise settings.error("family", f"{settings.family} cannot teach: it lacks {', '.join(lacks)}")
    if getattr(teaching_settings(settings), lessons) == learning.LEARNER and not hasattr(family, "guide"):
        problem = f"{settings.family} cannot teach a learner that drives: it lacks guide"
        raise settings.error(f"teaching.{lessons}", f"{problem}; add it, or take '{learning.EXPERT}'")
    return cast(Classroom, family)


def classrooms(settings: study.StudySettings) -> dict[str, Classroom]:
    """Every family of a study as one that can teach, else a SettingsError; none where it has no [teaching]."""
    if settings.teaching is None:
        return {}
    load_setup(settings)
    return {name: classroom(one, one.proxy, "proxy_lessons") for name, one in settings.families.items()}


def teach_families(
    settings: study.StudySettings,
    thetas: Mapping[str, Theta],
    watching: Callable[[int], AbstractContextManager[Watcher]],
) -> dict[str, study.Lesson]:
    """Teach a learner in each family at its best θ, from wherever an earlier run was left.

    The target is the study's own family, with its [domain] and the model that [teaching] names. The learner without a
    proxy, its lessons and its examinations are the same for all.

    Args:
        settings: Of the study of all families.
        thetas: The best θ of each, by name.
        watching: Gives what hears of so many points.

    Raises:
        LearnerError: If none can teach.
        RunError: If a domain, the learner or the machine fails; all that was finished is kept.
    """
    if not (rooms := classrooms(settings)):
        return {}
    setup = load_setup(settings)
    with watching(count_examinations(setup.settings, 1)) as watcher:
        alone = examine_curves(setup, {learning.NONE: None}, settings.jobs, watcher)
    scores, failed = dict(alone), dict[str, LearnerError]()
    for name, room in rooms.items():
        try:
            with watching(count_examinations(setup.settings, 1)) as watcher:
                proxy = learning.Distribution({one: (value, value) for one, value in sorted(thetas[name].items())})
                scores |= examine_curves(replace(setup, proxy=room), {name: proxy}, settings.jobs, watcher, alone)
        except LearnerError as problem:
            failed[name] = problem
    if len(failed) == len(rooms):
        raise next(iter(failed.values()))
    needs = needs_of(setup, learning.curves_of(setup.settings.target_samples, scores))
    lessons = {name: _lesson(needs, name, thetas[name]) for name in rooms if name not in failed}
    if (best := study.best_teaching_family(lessons)) is not None:
        lessons = {
            name: lesson if name == best else replace(lesson, more=learning.more_needed(needs, more=name, less=best))
            for name, lesson in lessons.items()
        }
    lessons |= {name: study.Lesson(thetas[name], failure=str(problem)) for name, problem in failed.items()}
    return {name: lessons[name] for name in thetas if name in lessons}


def _lesson(needs: learning.SampleNeeds, name: str, theta: Theta) -> study.Lesson:
    zero_shot = learning.mean_score(needs, name, 0).value or 0.0
    if not needs.settled:
        return study.Lesson(theta, zero_shot)
    worth = learning.teaching_value(needs, name)
    return study.Lesson(theta, zero_shot, worth.needed, worth.plv)


SURE = 0.95
"""Two proxies are ordered where so many of the draws order them so."""


@dataclass(frozen=True)
class RankAgreement:
    """The agreement of two rankings of the same proxies."""

    tau: float  # kendall's τ, the median over draws: 1 the same ranking, −1 its reverse
    low: float  # lower end of its 95 % interval
    high: float  # upper end
    # pairs of proxies, by name, that the two figures order otherwise, each order sure; the first of a pair is
    # ahead by the second figure
    reversed: tuple[tuple[str, str], ...]
    proxies: int  # how many are ranked


def agreement(names: Sequence[str], first: Floats, second: Floats) -> RankAgreement:
    """Compare two rankings, each from draws (draws, proxies) in which more is better; ties count for neither order."""
    one, other = _orders(first), _orders(second)
    above, below = np.triu_indices(len(names), 1)
    pairs = one[:, above, below] * other[:, above, below]
    taus = pairs.sum(axis=1) / np.sqrt(_untied(one[:, above, below]) * _untied(other[:, above, below]))
    contrary = _sure(one) * _sure(other) < 0
    ahead = np.argwhere(contrary & (_sure(other) > 0))
    low, middle, high = np.quantile(taus, (learning.LEVELS[0], 0.5, learning.LEVELS[1]))
    named = tuple((names[better], names[worse]) for better, worse in ahead)
    return RankAgreement(float(middle), float(low), float(high), named, len(names))


def _orders(values: Floats) -> Floats:
    """1 where the first proxy is ahead of the second, −1 where it is behind, 0 where they are tied."""
    return np.asarray((values[:, :, None] > values[:, None]).astype(float) - (values[:, :, None] < values[:, None]))


def _untied(orders: Floats) -> Floats:
    return np.asarray(np.maximum(np.abs(orders).sum(axis=1), 1.0))


def _sure(orders: Floats) -> Floats:
    """1 or −1 where nearly all draws order two proxies so, else 0."""
    return np.asarray(((orders > 0).mean(axis=0) >= SURE).astype(float) - ((orders < 0).mean(axis=0) >= SURE))


@dataclass(frozen=True)
class Predictivity:
    """The predictivity of a proxy."""

    prpv: float  # PRPV of its episodes as they are
    chance: usefulness.Chance  # PRPV of a proxy that ranks the agents at random
    # PRPV of resampled episodes, the same resample for all proxies (DRAWS,); None where episodes are not repeated
    resampled: Floats | None = field(repr=False, compare=False)

    @property
    def interval(self) -> tuple[float, float] | None:
        """The 95 % interval of PRPV, which holds the value."""
        if self.resampled is None:
            return None
        low, high = usefulness.interval(self.resampled)
        return min(low, self.prpv), max(high, self.prpv)


def predictivity(run: study.StudyRun, proxies: Mapping[str, learning.Distribution]) -> dict[str, Predictivity | None]:
    """PRPV of every proxy, by name; None where an agent failed there from every start.

    A proxy that draws θ anew for every lesson draws it anew for every start, the same for all agents.

    Raises:
        EpisodeError: If an episode fails and the study is to stop then.
    """
    settings, known = run.settings, dict[str, Predictivity | None]()
    for name, proxy in proxies.items():
        drawn = [study.plan_episodes(settings, proxy.draw(start), settings.seed) for start in range(settings.starts)]
        planned = [episode for start, each in enumerate(drawn) for episode in each if episode.start == start]
        found = run.outcomes(planned, f"agents in {name}")
        evaluation = study.evaluate_outcomes(run.study, proxy.centre, [found[episode] for episode in planned])
        if evaluation.proxy is None or evaluation.prpv is None:
            known[name] = None
            continue
        inputs = usefulness.compare(proxy=evaluation.proxy, target=run.study.target, metrics=settings.metrics)
        resampled = None
        if not usefulness.why_not_repeated(inputs):
            means = usefulness.bootstrap_means(inputs, resamples=learning.POSTERIOR_DRAWS, seed=0)
            resampled = usefulness.in_blocks(lambda p, t: usefulness.prpv_of_means(p, t, settings.metrics), *means)
        known[name] = Predictivity(evaluation.prpv, usefulness.chance(inputs), resampled)
    return known


@dataclass(frozen=True)
class Observations:
    """The paper's two observations, as a learning experiment has them.

    Attributes:
        zero_shot: Whether proxies rank by zero-shot score (first) as they do by PLV (second); None of a single one.
        prpv: Whether they rank by PRPV, low first, as they do by PLV; None without intervals of PRPV.
        poor_predictors: Proxies that save samples though their PRPV is such as chance gives.
    """

    zero_shot: RankAgreement | None
    prpv: RankAgreement | None
    poor_predictors: tuple[str, ...]


def observe(experiment: Experiment, prpv: Mapping[str, Predictivity | None]) -> Observations | None:
    """Hold the two observations against an experiment; None where PLV is unknown.

    Args:
        experiment: With the posterior of its learning curves.
        prpv: How well each proxy predicts, by name.
    """
    names = [teacher.name for teacher in experiment.teachers]
    if not experiment.settled:
        return None
    starts = {name: experiment.needs.draws.scores[name][:, 0] for name in names}
    lowest = {name: -one.resampled for name in names if (one := prpv.get(name)) and one.resampled is not None}
    return Observations(
        zero_shot=_agreement(experiment, starts),
        prpv=_agreement(experiment, lowest),
        poor_predictors=tuple(
            one.name
            for one in experiment.teachers
            if one.worth and one.worth.plv.above_zero and (known := prpv.get(one.name)) and known.chance.explains
        ),
    )


def _agreement(experiment: Experiment, figures: Mapping[str, Floats]) -> RankAgreement | None:
    """Compare how proxies rank by a figure (draws by name, more is better) and by PLV; None of fewer than two."""
    names, needed = list(figures), experiment.needs.needed
    if len(names) < 2:
        return None
    # A PLV that is not reached is the worst there is.
    alone = np.minimum(needed[learning.NONE], experiment.needs.last)
    plv = np.column_stack([alone - needed[name] for name in names])
    return agreement(names, np.column_stack(list(figures.values())), plv)
