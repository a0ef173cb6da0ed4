"""What each of several families is worth as a teacher: all at their best θ, for one target and one learner."""

from collections.abc import Callable, Mapping
from contextlib import AbstractContextManager
from dataclasses import replace

from proxytune.domain import Classroom
from proxytune.errors import LearnerError
from proxytune.learning.lessons import Distribution
from proxytune.learning.plv import teaching
from proxytune.running.progress import Watcher
from proxytune.space import Theta
from proxytune.study.families.compared import Lesson, best_teacher
from proxytune.study.settings import StudySettings
from proxytune.teaching.experiment import Experiment, classroom, count_points, load_setup, run_experiment


def classrooms(settings: StudySettings) -> dict[str, Classroom]:
    """Every family of a study as one that can teach; none where the study has no [teaching].

    Raises:
        SettingsError: If one cannot, with its name.
    """
    if settings.teaching is None:
        return {}
    load_setup(settings)
    return {name: classroom(one, one.proxy) for name, one in settings.families.items()}


def teach_families(
    settings: StudySettings,
    thetas: Mapping[str, Theta],
    watching: Callable[[int], AbstractContextManager[Watcher]],
) -> dict[str, Lesson]:
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
    found: dict[str, Experiment] = {}
    failed: dict[str, LearnerError] = {}
    for name, room in classrooms(settings).items():
        try:
            found[name] = _teach(settings, name, room, thetas[name], watching)
        except LearnerError as problem:
            failed[name] = problem
    if failed and not found:
        raise next(iter(failed.values()))
    lessons = {name: _lesson(thetas[name], one) for name, one in found.items()}
    best = best_teacher(lessons)
    if best is not None:
        lessons = {name: _beside(lesson, found, name, best) for name, lesson in lessons.items()}
    lessons |= {name: Lesson(thetas[name], failure=str(problem)) for name, problem in failed.items()}
    return {name: lessons[name] for name in thetas if name in lessons}


def _teach(
    settings: StudySettings,
    name: str,
    room: Classroom,
    theta: Theta,
    watching: Callable[[int], AbstractContextManager[Watcher]],
) -> Experiment:
    """The learning experiment whose only proxy is this family at this θ."""
    assert settings.teaching is not None
    where = Distribution({parameter: (value, value) for parameter, value in sorted(theta.items())})
    alone = replace(settings, teaching=replace(settings.teaching, proxies={name: where}, published={}))
    setup = replace(load_setup(alone), proxy=room)
    with watching(count_points(setup, 1)) as watcher:
        return run_experiment(alone, setup, watcher)


def _lesson(theta: Theta, experiment: Experiment) -> Lesson:
    (teacher,) = experiment.teachers
    zero_shot, worth = float(teacher.curve.mean[0]), teacher.worth
    return Lesson(theta, zero_shot) if worth is None else Lesson(theta, zero_shot, worth.needed, worth.plv)


def _beside(lesson: Lesson, found: Mapping[str, Experiment], name: str, best: str) -> Lesson:
    """The lesson with how many more samples it takes than the best one, seed by seed."""
    if name == best:
        return lesson
    curves = [found[one].teachers[0].curve for one in (name, best)]
    more = teaching(without=curves[0], with_proxy=curves[1], when=found[name].when).plv
    return replace(lesson, more=more)
