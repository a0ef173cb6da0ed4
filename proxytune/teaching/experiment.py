"""The learning experiment: learning curves with and without each proxy, and what each is worth as a teacher."""

import hashlib
import inspect
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import cast

import numpy as np

from proxytune.domain import Classroom
from proxytune.errors import InputError
from proxytune.extensions import make
from proxytune.learning.cache import Cache
from proxytune.learning.learner import Learner
from proxytune.learning.lessons import Distribution
from proxytune.learning.plv import Convergence, Curve, Teaching, converged_level, settled, teaching
from proxytune.learning.settings import NONE, TeachingSettings
from proxytune.meaning import meaning_of
from proxytune.running.progress import Watcher
from proxytune.study.family import check_bounds, load_family
from proxytune.study.settings import StudySettings
from proxytune.teaching.points import Point, TeachingSetup, prepare_shared, score_points

CACHE = "teaching"
"""The folder, within a study's, where all that was taught is kept."""


@dataclass(frozen=True)
class TeacherResult:
    """What one proxy has come to as a teacher.

    Attributes:
        name: What it is called.
        proxy: Its p(θ).
        curve: Scores in the target after so many target samples, having learnt from the proxy first.
        worth: PLV and what it is made of; None where the learner without a proxy has not converged.
    """

    name: str
    proxy: Distribution
    curve: Curve
    worth: Teaching | None


@dataclass(frozen=True)
class Experiment:
    """The result of a learning experiment.

    Attributes:
        settings: Of the study.
        best_score: The score of a flawless examination.
        without: The learning curve without a proxy.
        when: When a learner counts as converged.
        settled: Whether it has, without a proxy: over the last doubling of samples it gains no more than the tolerance.
        teachers: One per proxy, in the order of study.toml.
    """

    settings: StudySettings
    best_score: float
    without: Curve
    when: Convergence
    settled: bool
    teachers: tuple[TeacherResult, ...]


def load_setup(settings: StudySettings) -> TeachingSetup:
    """Load both domain families and the learner that a study's [teaching] table names.

    Raises:
        InputError: If any of it cannot be used, with file, key and remedy.
    """
    taught = teaching_settings(settings)
    learner, identity = _load_learner(settings, taught.learner)
    return TeachingSetup(
        proxy=classroom(settings, settings.proxy),
        target=classroom(settings, taught.target),
        learner=learner,
        learner_identity=identity,
        settings=taught,
        seed=settings.seed,
        starts=settings.starts,
        cache=Cache(settings.home / CACHE),
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
    proxies = setup.settings.proxies
    if not proxies:
        raise settings.error("teaching.proxies", "is missing; name at least one, as in [teaching.proxies.nominal]")
    check_proxies(settings, setup, proxies)
    curves = learning_curves(setup, {NONE: None, **proxies}, settings.jobs, watcher)
    return judge_curves(settings, setup, curves)


def judge_curves(settings: StudySettings, setup: TeachingSetup, curves: Mapping[str, Curve]) -> Experiment:
    """Judge each proxy by the learning curves: a pure function of them and of what counts as converged."""
    taught, without = setup.settings, curves[NONE]
    when = convergence(taught, without)
    steady = settled(without, taught.tolerance)
    teachers = [
        TeacherResult(
            name, proxy, curves[name], teaching(without=without, with_proxy=curves[name], when=when) if steady else None
        )
        for name, proxy in taught.proxies.items()
    ]
    return Experiment(settings, setup.target.best_score, without, when, steady, tuple(teachers))


def convergence(taught: TeachingSettings, without: Curve) -> Convergence:
    """When a learner counts as converged: at the level stated, or at what it comes to without a proxy."""
    level = converged_level(without) if taught.level is None else taught.level
    return Convergence(level, taught.tolerance)


def learning_curves(
    setup: TeachingSetup, proxies: Mapping[str, Distribution | None], jobs: int, watcher: Watcher
) -> dict[str, Curve]:
    """The learning curve of each proxy, by name; what is cached is not made again."""
    points = [
        Point(name, proxy, repetition, count)
        for name, proxy in proxies.items()
        for repetition in range(setup.settings.seeds)
        for count in setup.settings.target_samples
    ]
    missing = [point for point in points if not setup.is_cached(point)]
    watcher.begin("demonstrations", len(points) - len(missing))
    with prepare_shared(setup, missing, jobs) as made:
        for _ in made:
            pass
    watcher.begin("learning", 0)
    with score_points(setup, missing, jobs) as scored:
        for point, score in scored:
            watcher.episode()
            watcher.finished(_came_to(point, score))
    return {name: _curve(setup, [point for point in points if point.name == name]) for name in proxies}


def _came_to(point: Point, score: float) -> str:
    """What became of a point of a learning curve, in one line."""
    came = "nothing learnt yet" if np.isnan(score) else f"score {score:.3g}"
    return f"{point.name}, repetition {point.repetition + 1}, {point.count} target samples: {came}"


def count_points(setup: TeachingSetup, proxies: int) -> int:
    """The number of points on the learning curves of this many proxies and of the learner without one."""
    return (proxies + 1) * setup.settings.seeds * len(setup.settings.target_samples)


def _curve(setup: TeachingSetup, points: Sequence[Point]) -> Curve:
    scores = np.array([setup.score(point) for point in points])
    return Curve(setup.settings.target_samples, scores.reshape(setup.settings.seeds, -1))


def check_proxies(settings: StudySettings, setup: TeachingSetup, proxies: Mapping[str, Distribution]) -> None:
    """Refuse a parameter that the family has not, or a value beyond its bounds.

    Raises:
        SettingsError: With the proxy and the parameter.
    """
    for proxy, where in proxies.items():
        for name, (low, high) in where.bounds.items():
            key, given = f"teaching.proxies.{proxy}.{name}", f"{low:g} to {high:g}"
            check_bounds(settings, setup.proxy, key, name, (low, high), given)


def classroom(settings: StudySettings, model: Path | None) -> Classroom:
    """The domain family that a study names, with a model; it can teach.

    Raises:
        SettingsError: If it cannot.
    """
    family = load_family(settings, model)
    lacks = [member for member in ("best_score", "demonstrate", "examine") if not hasattr(family, member)]
    if lacks:
        raise settings.error("family", f"{settings.family} cannot teach: it lacks {', '.join(lacks)}")
    return cast(Classroom, family)


def _load_learner(settings: StudySettings, name: str) -> tuple[Learner, str]:
    """The learner and a digest of what its code means and of its settings."""
    try:
        made = make(name, kind="learner", beside=settings.folder, needs=("train", "act"))
    except InputError as problem:
        raise settings.error("teaching.learner", str(problem)) from None
    source = Path(inspect.getfile(type(made)))
    code = meaning_of([source], source.parent)
    return cast(Learner, made), hashlib.sha256(code.encode() + repr(made).encode()).hexdigest()[:16]
