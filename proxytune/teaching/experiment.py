"""The learning experiment: learning curves with and without each proxy, and what each is worth as a teacher."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import cast

from proxytune.domain import Classroom
from proxytune.errors import InputError
from proxytune.extensions import make
from proxytune.learning.cache import Cache
from proxytune.learning.curves import Array, Curve
from proxytune.learning.identity import learner_identity
from proxytune.learning.learner import Learner
from proxytune.learning.lessons import Distribution
from proxytune.learning.plv import Convergence, Estimate, SampleNeeds, Teaching, estimate, mean_score, teaching
from proxytune.learning.settings import EXPERT, LEARNER, NONE, TeachingSettings
from proxytune.learning.spending import curves_of
from proxytune.running.progress import Watcher
from proxytune.study.family import check_bounds, load_family
from proxytune.study.settings import StudySettings
from proxytune.teaching.examining import examine_curves, needs_of
from proxytune.teaching.points import TeachingSetup

CACHE = "teaching"
"""The folder, within a study's, where all that was taught is kept."""


@dataclass(frozen=True)
class TeacherResult:
    """What one proxy has come to as a teacher.

    Attributes:
        name: What it is called.
        proxy: Its p(θ).
        curve: Scores in the target after so many target samples, having learnt from the proxy first.
        zero_shot: Mean score before any target sample.
        worth: PLV and what it is made of; None where the learner without a proxy has not converged.
        cost: PLV in cost, in the unit of [teaching.costs]; None likewise.
    """

    name: str
    proxy: Distribution
    curve: Curve
    zero_shot: Estimate
    worth: Teaching | None
    cost: Estimate | None


@dataclass(frozen=True)
class Experiment:
    """The result of a learning experiment.

    Attributes:
        settings: Of the study.
        best_score: The score of a flawless examination.
        needs: How many target samples each learner needs, from the posterior of all learning curves.
        teachers: One per proxy, in the order of study.toml.
    """

    settings: StudySettings
    best_score: float
    needs: SampleNeeds
    teachers: tuple[TeacherResult, ...]

    @property
    def without(self) -> Curve:
        """The learning curve without a proxy."""
        return self.needs.curves[NONE]

    @property
    def when(self) -> Convergence:
        """When a learner counts as converged."""
        return self.needs.when

    @property
    def settled(self) -> bool:
        """Whether the learner without a proxy converges."""
        return self.needs.settled


def load_setup(settings: StudySettings) -> TeachingSetup:
    """Load both domain families and the learner that a study's [teaching] table names.

    Raises:
        InputError: If any of it cannot be used, with file, key and remedy.
    """
    taught = teaching_settings(settings)
    learner, identity = _load_learner(settings, taught.learner)
    return TeachingSetup(
        proxy=classroom(settings, settings.proxy, "proxy_lessons"),
        target=classroom(settings, taught.target, "target_lessons"),
        learner=learner,
        learner_identity=identity,
        settings=taught,
        seed=settings.seed,
        starts=settings.starts,
        cache=Cache(settings.home / CACHE),
        timeout_s=settings.episode_timeout_s,
    )


def teaching_settings(settings: StudySettings) -> TeachingSettings:
    """The [teaching] table of a study.

    Raises:
        SettingsError: If it has none.
    """
    if settings.teaching is None:
        raise settings.error("teaching", "is missing; add the table, as in studies/teacher/study.toml")
    return settings.teaching


def run_experiment(settings: StudySettings, setup: TeachingSetup, watcher: Watcher) -> Experiment:
    """Teach every proxy's learner and the one without, from wherever an earlier run was left.

    Raises:
        InputError: If there is no proxy, or one's expert cannot drive.
        RunError: If a domain, the learner or the machine fails; all that was finished is kept.
    """
    check_proxies(settings, setup)
    scores = examine_curves(setup, {NONE: None, **setup.settings.proxies}, settings.jobs, watcher)
    return judge_curves(settings, setup, curves_of(setup.settings.target_samples, scores))


def judge_curves(settings: StudySettings, setup: TeachingSetup, curves: Mapping[str, Curve]) -> Experiment:
    """Judge each proxy by the learning curves: a pure function of them and of what counts as converged."""
    needs = needs_of(setup, curves)
    teachers = [_teacher(setup.settings, needs, name, proxy) for name, proxy in setup.settings.proxies.items()]
    return Experiment(settings, setup.target.best_score, needs, tuple(teachers))


def _teacher(taught: TeachingSettings, needs: SampleNeeds, name: str, proxy: Distribution) -> TeacherResult:
    zero_shot, curve = mean_score(needs, name, 0), needs.curves[name]
    if not needs.settled:
        return TeacherResult(name, proxy, curve, zero_shot, None, None)
    worth = teaching(needs, none=NONE, proxy=name)
    return TeacherResult(name, proxy, curve, zero_shot, worth, _cost_saved(taught, needs, name))


def _cost_saved(taught: TeachingSettings, needs: SampleNeeds, name: str) -> Estimate:
    """PLV in cost (eq. 6)."""

    def saved(without: Array, needed: Array) -> Array:
        return taught.cost_saved(without=without, needed=needed)

    return estimate(saved, needs, more=NONE, less=name)


def check_proxies(settings: StudySettings, setup: TeachingSetup) -> None:
    """Refuse a study without proxies, a parameter that the family has not, or a value beyond its bounds.

    Raises:
        SettingsError: With the proxy and the parameter.
    """
    if not setup.settings.proxies:
        raise settings.error("teaching.proxies", "is missing; name at least one, as in [teaching.proxies.nominal]")
    for proxy, where in setup.settings.proxies.items():
        for name, (low, high) in where.bounds.items():
            key, given = f"teaching.proxies.{proxy}.{name}", f"{low:g} to {high:g}"
            check_bounds(settings, setup.proxy, key, name, (low, high), given)


def classroom(settings: StudySettings, model: Path | None, lessons: str) -> Classroom:
    """The domain family that a study names, with a model: one that can teach, for lessons as their key has them.

    Raises:
        SettingsError: If it cannot.
    """
    family = load_family(settings, model)
    lacks = [member for member in ("best_score", "demonstrate", "examine") if not hasattr(family, member)]
    if lacks:
        raise settings.error("family", f"{settings.family} cannot teach: it lacks {', '.join(lacks)}")
    if getattr(teaching_settings(settings), lessons) == LEARNER and not hasattr(family, "guide"):
        raise settings.error(
            f"teaching.{lessons}",
            f"{settings.family} cannot teach a learner that drives: it lacks guide; add it, or take '{EXPERT}'",
        )
    return cast(Classroom, family)


def _load_learner(settings: StudySettings, name: str) -> tuple[Learner, str]:
    """The learner and a digest of what its code means and of its settings."""
    try:
        made = make(name, kind="learner", beside=settings.folder, needs=("train", "act"))
    except InputError as problem:
        raise settings.error("teaching.learner", str(problem)) from None
    learner = cast(Learner, made)
    return learner, learner_identity(learner)
