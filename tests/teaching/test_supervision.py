"""Whatever code that is not ours does in a lesson, a training or an examination is told in one line that names it."""

import functools
import re
from dataclasses import replace

import numpy as np
import pytest
from schoolroom import Schoolroom
from stuck import StuckRoom, StuckTogether, acts, trains
from taught import PROXY, setup
from wobbly import Wobbly

from proxytune.cli.terminal.interruption import signals_as_interruptions
from proxytune.errors import EpisodeError, RunError
from proxytune.teaching.points import Point
from proxytune.teaching.spreading import prepare_points, score_points

POINT = Point("near", PROXY, 0, 20)
ALONE = Point("none", None, 0, 20)
LESSON = r"near: the expert's lesson in the proxy at trim = 0\.1\d+, start \d"
EXAM = "none: the learner's examination in the target at start 2"


def room(*faults, kind=StuckRoom):
    return kind(Wobbly(theta=(("trim", 0.12), ("delay", 0.21)), faults=faults))


MOMENTS = {
    "a lesson": ({"proxy": room("lesson:*:raises")}, POINT, LESSON),
    "a training": ({"learner": trains("raises")}, ALONE, "none: the learner's training"),
    "an answer": ({"learner": acts("raises")}, ALONE, "none: the learner's examination in the target at start 0"),
    "an examination": ({"target": room("exam:2:raises")}, ALONE, EXAM),
    "examinations at once": (
        {"target": room("together:2:raises", kind=StuckTogether)},
        ALONE,
        "none: the learner's examination in the target at start 0 and the others beside it",
    ),
}


@pytest.mark.parametrize("moment", MOMENTS)
def test_what_raises_is_named_with_its_start(tmp_path, moment):
    changes, point, named = MOMENTS[moment]
    with pytest.raises(EpisodeError) as told:
        setup(tmp_path, **changes).score(point)
    assert re.fullmatch(rf"{named} raised ValueError: of its own \(deadly\.py, line \d+\); correct it", str(told.value))


@pytest.mark.parametrize("ending", ["exits", "own error", "interrupts"])
def test_what_exits_or_interrupts_is_named_alike(tmp_path, ending):
    with signals_as_interruptions(), pytest.raises(EpisodeError, match=f"^{EXAM} raised (System|Own|Keyboard)"):
        setup(tmp_path, target=room(f"exam:2:{ending}")).score(ALONE)


@pytest.mark.parametrize("ending", ["memory", "files"])
def test_what_the_machine_lacks_is_no_failure_of_the_learner(tmp_path, ending):
    told = r"the learner's training: the machine failed \((Memory|OS)Error.*run again to continue"
    with pytest.raises(RunError, match=told) as found:
        setup(tmp_path, learner=trains(ending)).score(ALONE)
    assert not isinstance(found.value, EpisodeError)


class Silly(Schoolroom):
    """Its scores are none."""

    def examine(self, episode, policy):
        return "much"


def test_what_is_no_score_is_named(tmp_path):
    with pytest.raises(EpisodeError, match="none: an examination raised TypeError"):
        setup(tmp_path, target=Silly(Wobbly())).score(ALONE)


HANGING = {
    "a lesson": ({"proxy": room("lesson:*:hangs")}, POINT, LESSON),
    "a learner's answer": (
        {"learner": acts("hangs in C")},
        ALONE,
        "none: the learner's examination in the target at start 0",
    ),
    "an examination": ({"target": room("exam:2:hangs")}, ALONE, EXAM),
    "one of several at once": (
        {"target": room("together:2:hangs", "exam:2:hangs", kind=StuckTogether)},
        ALONE,
        EXAM,
    ),
}


@pytest.mark.slow
@pytest.mark.parametrize("jobs", [1, 2])
@pytest.mark.parametrize("moment", HANGING)
def test_what_hangs_is_ended_and_named_with_its_start(tmp_path, moment, jobs):
    changes, point, named = HANGING[moment]
    limited = setup(tmp_path, timeout_s=0.5, **changes)
    with pytest.raises(EpisodeError) as told:
        make(limited, [point, replace(point, count=0)], jobs)
    remedy = "correct the learner or the domain family, or raise episode_timeout_s, and run again to continue"
    assert re.fullmatch(rf"{named} took longer than 0\.5 s; {remedy}", str(told.value))


def make(made, points, jobs):
    """The scores, in the points' order."""
    prepare_points(made, points, jobs)
    with score_points(made, points, jobs) as scored:
        found = {repr(point): score for point, score in scored}
    return [found[repr(point)] for point in points]


@pytest.mark.slow
@pytest.mark.parametrize("jobs", [1, 2])
def test_examinations_that_hang_only_side_by_side_come_to_the_same_one_after_the_other(tmp_path, jobs):
    points = [POINT, ALONE]
    whole = make(setup(tmp_path / "whole", target=room()), points, jobs)
    stuck = setup(tmp_path / "stuck", target=room("together:2:hangs", kind=StuckTogether), timeout_s=1.0)
    assert make(stuck, points, jobs) == whole


@pytest.mark.slow
@pytest.mark.parametrize("jobs", [1, 2])
def test_a_limit_that_nothing_overruns_changes_no_score_and_is_none_for_trainings(tmp_path, jobs):
    points = [Point("near", PROXY, 0, count) for count in (0, 20, 40)]
    whole = make(setup(tmp_path / "whole"), points, jobs=1)
    slow = setup(tmp_path / "slow", learner=trains("lingers"), timeout_s=1.0)
    found = make(slow, points, jobs)
    assert np.isfinite(found).all()
    assert found == whole


@pytest.mark.slow
@pytest.mark.parametrize("timeout_s", [None, 5.0])
def test_what_ends_its_process_is_named(tmp_path, timeout_s):
    deadly = setup(tmp_path, target=room("exam:2:aborts"), timeout_s=timeout_s)
    with pytest.raises(RunError, match=rf"^{EXAM} ended its process \(SIGABRT\); correct that, and run again"):
        make(deadly, [ALONE, replace(ALONE, count=40)], jobs=2)


@pytest.mark.slow
def test_what_an_ended_command_had_made_is_there(tmp_path):
    limited = functools.partial(setup, tmp_path, timeout_s=1.0)
    with pytest.raises(EpisodeError):
        make(limited(target=room("exam:2:hangs")), [POINT], 1)
    kept = {path: path.stat().st_mtime_ns for path in tmp_path.glob("*.npz")}
    assert {path.name.partition("-")[0] for path in kept} == {"samples", "weights"}
    make(limited(target=room()), [POINT], 1)
    assert {path: path.stat().st_mtime_ns for path in kept} == kept
    assert len(list(tmp_path.glob("exam-*.npz"))) == 1
