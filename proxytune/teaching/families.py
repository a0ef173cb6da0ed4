"""What each of several families is worth as a teacher: all at their best θ, for one target and one learner."""

from collections.abc import Callable, Mapping
from contextlib import AbstractContextManager
from dataclasses import replace

from proxytune.domain import Classroom
from proxytune.errors import LearnerError
from proxytune.learning.lessons import Distribution
from proxytune.learning.plv import SampleNeeds, difference, mean_score, teaching
from proxytune.learning.settings import NONE
from proxytune.learning.spending import curves_of
from proxytune.running.progress import Watcher
from proxytune.space import Theta
from proxytune.study.families.compared import Lesson, best_teacher
from proxytune.study.settings import StudySettings
from proxytune.teaching.examining import count_examinations, examine_curves, needs_of
from proxytune.teaching.experiment import classroom, load_setup


def classrooms(settings: StudySettings) -> dict[str, Classroom]:
    """Every family of a study as one that can teach; none where the study has no [teaching].

    Raises:
        SettingsError: If one cannot, with its name.
    """
    if settings.teaching is None:
        return {}
    load_setup(settings)
    return {name: classroom(one, one.proxy, "proxy_lessons") for name, one in settings.families.items()}


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
    rooms = classrooms(settings)
    if not rooms:
        return {}
    setup = load_setup(settings)
    with watching(count_examinations(setup.settings, 1)) as watcher:
        alone = examine_curves(setup, {NONE: None}, settings.jobs, watcher)
    scores, failed = dict(alone), dict[str, LearnerError]()
    for name, room in rooms.items():
        there = replace(setup, proxy=room)
        try:
            with watching(count_examinations(setup.settings, 1)) as watcher:
                scores |= examine_curves(there, {name: _fixed(thetas[name])}, settings.jobs, watcher, alone)
        except LearnerError as problem:
            failed[name] = problem
    if len(failed) == len(rooms):
        raise next(iter(failed.values()))
    needs = needs_of(setup, curves_of(setup.settings.target_samples, scores))
    lessons = {name: _lesson(needs, name, thetas[name]) for name in rooms if name not in failed}
    best = best_teacher(lessons)
    if best is not None:
        lessons = {
            name: lesson if name == best else replace(lesson, more=difference(needs, more=name, less=best))
            for name, lesson in lessons.items()
        }
    lessons |= {name: Lesson(thetas[name], failure=str(problem)) for name, problem in failed.items()}
    return {name: lessons[name] for name in thetas if name in lessons}


def _fixed(theta: Theta) -> Distribution:
    """One θ as a distribution."""
    return Distribution({parameter: (value, value) for parameter, value in sorted(theta.items())})


def _lesson(needs: SampleNeeds, name: str, theta: Theta) -> Lesson:
    zero_shot = mean_score(needs, name, 0).value or 0.0
    if not needs.settled:
        return Lesson(theta, zero_shot)
    worth = teaching(needs, none=NONE, proxy=name)
    return Lesson(theta, zero_shot, worth.needed, worth.plv)
