"""Who drives in which lessons, what is found again in the cache, and what other people's code does wrong there."""

import functools
import re
from dataclasses import dataclass, field, replace

import numpy as np
import pytest
from one_line import complaint_of
from schoolroom import Matrix, Schoolroom
from stuck import StuckRoom, StuckTogether, acts, trains
from taught import PROXY, make_taught, run, setup
from tightrope import Cells, Tightrope
from wobbly import Wobbly

from proxytune.cli.terminal import signals_as_interruptions
from proxytune.errors import EpisodeError, LearnerError, RunError
from proxytune.learning import Cache, Distribution, facts_digest
from proxytune.study import read_study_settings
from proxytune.teaching import load_setup
from proxytune.teaching.examining import prepare_points, score_points
from proxytune.teaching.points import CurvePoint, equal_rounds


@dataclass(frozen=True)
class Timid(Matrix):
    """Learns nine tenths of what it is shown."""

    def train(self, samples, start, seed):
        return {"matrix": 0.9 * super().train(samples, start, seed)["matrix"]}


CHANGES = {
    "another learner": {"learner": Timid(), "learner_identity": "timid"},
    "more starts": {"starts": 5},
    "another seed": {"seed": 2},
    "another proxy domain": {"proxy": Schoolroom(Wobbly(theta=(("delay", 0.2),)))},
    "another target": {"target": Schoolroom(Wobbly(theta=(("trim", 0.05), ("delay", 0.21))))},
    "more samples of the proxy": {"proxy_samples": 90},
    "longer lessons": {"lesson_s": 3.0},
}


@pytest.mark.parametrize(
    ("change", "point"),
    [
        *((change, CurvePoint("near", PROXY, 0, count)) for change in CHANGES for count in (0, 20)),
        *((change, CurvePoint("none", None, 0, 20)) for change in CHANGES if "proxy" not in change),
    ],
)
def test_a_used_cache_gives_what_an_empty_one_gives(tmp_path, change, point):
    before = setup(tmp_path / "used").score(point)
    fresh = setup(tmp_path / "empty", **CHANGES[change]).score(point)
    assert fresh != before
    assert setup(tmp_path / "used", **CHANGES[change]).score(point) == fresh


def test_what_a_proxy_taught_is_shared_by_all_points_after_it(tmp_path):
    one = setup(tmp_path)
    for count in (0, 20, 40):
        one.score(CurvePoint("near", PROXY, 0, count))
    assert len(list(tmp_path.glob("weights-*.npz"))) == 3
    assert len(list(tmp_path.glob("samples-*.npz"))) == 2
    assert one.is_cached(CurvePoint("renamed", PROXY, 0, 40))
    assert not one.is_cached(CurvePoint("near", PROXY, 1, 40))


@dataclass(frozen=True)
class Noting(Matrix):
    """Notes the samples of each training."""

    trained: list = field(default_factory=list)

    def train(self, samples, start, seed):
        self.trained.append(samples)
        return super().train(samples, start, seed)


def test_a_fine_tuning_goes_over_the_proxys_samples_again_beside_the_targets(tmp_path):
    plain, rehearsing = Noting(), Noting()
    point = CurvePoint("near", PROXY, 0, 20)
    setup(tmp_path / "plain", learner=plain).score(point)
    setup(tmp_path / "rehearsing", learner=rehearsing, rehearsal=0.6).score(point)
    taught, target = plain.trained[0].commands.tolist(), plain.trained[1].commands.tolist()
    mixed = rehearsing.trained[1].commands.tolist()
    assert rehearsing.trained[0].commands.tolist() == taught
    assert (len(target), len(mixed)) == (20, 50)
    assert mixed[:20] == target
    assert all(sample in taught for sample in mixed[20:])


def test_rehearsal_changes_fine_tunings_after_a_proxy_and_nothing_else(tmp_path):
    plain, rehearsing = setup(tmp_path), setup(tmp_path, rehearsal=0.6)
    tuned, taught = CurvePoint("near", PROXY, 0, 20), CurvePoint("near", PROXY, 0, 0)
    alone = CurvePoint("none", None, 0, 20)
    assert plain.exam_facts(tuned) != rehearsing.exam_facts(tuned)
    assert plain.exam_facts(tuned) != setup(tmp_path, rehearsal=0.5).exam_facts(tuned)
    for point in (taught, alone):
        assert plain.exam_facts(point) == rehearsing.exam_facts(point)
    before, empty = plain.score(tuned), setup(tmp_path / "empty", rehearsal=0.6)
    assert rehearsing.score(tuned) == empty.score(tuned) != before


# The names that files had then
KEPT = {
    "ff67f18fe321ea72a41a": CurvePoint("near", PROXY, 0, 20),
    "454406ad67f24dd8d50c": CurvePoint("none", None, 0, 20),
    "bfde94b57c9b6b4fe41f": CurvePoint("near", PROXY, 0, 0),
}


@pytest.mark.parametrize("name", KEPT)
def test_what_was_kept_before_there_was_rehearsal_is_found_again(tmp_path, name):
    assert facts_digest(setup(tmp_path).exam_facts(KEPT[name])) == name


GRID = (0, 20, 40, 80, 160, 320, 640)
NEAR = Distribution({})
ON_POLICY = 'target_lessons = "learner"\nproxy_lessons = "learner"'


def staged(folder, **changes):
    """An experiment on the tightrope; the target's deviations grow faster than the proxy's."""
    folder.mkdir(exist_ok=True)
    target = Tightrope(Wobbly(theta=(("trim", 0.1),)), journal=str(folder / "journal"))
    domains = {"proxy": Tightrope(Wobbly()), "target": target, "starts": 5, "cache": Cache(folder / "cache")}
    amounts = {"proxy_samples": 40, "target_samples": GRID, "seeds": 4, "tolerance": 5.0, "proxies": {"near": NEAR}}
    return setup(folder, learner=Cells(), learner_identity="cells", **domains, **{**amounts, **changes})


def mean_scores(made, proxy):
    """Of four repetitions, at each count of the grid."""
    points = [[CurvePoint("near", proxy, repetition, count) for count in GRID] for repetition in range(4)]
    return np.mean([[made.score(point) for point in row] for row in points], axis=0)


def first_within(scores, tolerance):
    """The first count from which on scores are within a tolerance of the best there is."""
    below = np.flatnonzero(~(scores >= 60.0 - tolerance))
    return GRID[below[-1] + 1 if len(below) else 0]


@pytest.mark.slow
@pytest.mark.parametrize("proxy", [None, NEAR], ids=["without a proxy", "after a proxy"])
def test_a_learner_that_errs_to_where_the_expert_never_is_needs_fewer_samples_of_its_own_driving(tmp_path, proxy):
    off, on = (mean_scores(staged(tmp_path / by, target_lessons=by), proxy) for by in ("expert", "learner"))
    assert 0 < first_within(on, 5.0) <= first_within(off, 5.0) / 4


def test_a_proxy_teaches_better_where_the_learner_drives_in_it(tmp_path):
    off, on = (mean_scores(staged(tmp_path / by, proxy_lessons=by), NEAR) for by in ("expert", "learner"))
    assert on[0] > off[0] + 20.0


def samples(made, count, proxy=None):
    return made._stage(CurvePoint("near", proxy, 0, count)).samples(count)


@pytest.mark.parametrize("by", ["expert", "learner"])
@pytest.mark.parametrize("proxy", [None, NEAR], ids=["without a proxy", "after a proxy"])
@pytest.mark.parametrize("count", [1, 20, 21, 71, 283])
def test_more_samples_begin_with_the_same_ones_whatever_the_count(tmp_path, by, proxy, count):
    whole = samples(staged(tmp_path / "whole", target_lessons=by), 320, proxy)
    first = samples(staged(tmp_path / "first", target_lessons=by), count, proxy)
    assert len(first.commands) == count
    np.testing.assert_array_equal(first.observations, whole.observations[:count])
    np.testing.assert_array_equal(first.commands, whole.commands[:count])


def test_a_proxy_is_asked_once_and_rounds_have_lessons_of_their_own(tmp_path):
    made = staged(tmp_path, target_lessons="learner")
    assert np.isnan(made.score(CurvePoint("none", None, 0, 0)))
    assert made.score(CurvePoint("near", NEAR, 0, 0)) > 0.0
    assert not any(line.startswith("guided") for line in (tmp_path / "journal").read_text().splitlines())
    samples(staged(tmp_path, target_lessons="learner"), 640)
    seeds = [line.split()[1] for line in (tmp_path / "journal").read_text().splitlines()]
    assert len(seeds) > 30
    assert len(set(seeds)) == len(seeds)


@pytest.mark.parametrize(("proxy", "first"), [(None, "lesson"), (NEAR, "guided")])
def test_the_expert_drives_where_nothing_has_been_learnt_and_the_learner_ever_after(tmp_path, proxy, first):
    made = staged(tmp_path, target_lessons="learner")
    for count, kind in ((20, first), (71, "guided"), (160, "guided")):
        samples(made, count, proxy)
        assert {line.split()[0] for line in (tmp_path / "journal").read_text().splitlines()} == {kind}
        (tmp_path / "journal").unlink()


def test_a_round_is_another_by_another_learner_proxy_or_repetition_and_not_by_what_comes_after_it(tmp_path):
    made, first = staged(tmp_path, target_lessons="learner"), CurvePoint("near", NEAR, 0, 0)

    def facts(made, point=first):
        return made._stage(point).round_facts(2)

    others = [facts(replace(made, learner_identity="others"))]
    for point in (("far", Distribution({"trim": (0.2, 0.2)}), 0), ("near", NEAR, 1), ("none", None, 0)):
        others.append(facts(made, CurvePoint(*point, 0)))
    for change in ({"rehearsal": 0.5}, {"proxy_lessons": "learner"}, {"target_samples": (0, 20, 60, 80)}):
        others.append(facts(staged(tmp_path, target_lessons="learner", **change)))
    assert facts(made) not in others
    assert facts(staged(tmp_path, target_lessons="learner", target_samples=(*GRID, 2000))) == facts(made)


@pytest.mark.parametrize(
    ("count", "rounds", "ends"),
    [(4000, 4, (1000, 2000, 3000, 4000)), (10, 4, (2, 5, 8, 10)), (2, 4, (1, 2)), (1, 4, (1,)), (7, 1, (7,))],
)
def test_equal_rounds_end_with_the_last_sample(count, rounds, ends):
    assert equal_rounds(count, rounds) == ends


def scores_of(folder):
    found = run(folder)
    return np.stack([found.without.scores, *(one.curve.scores for one in found.teachers)])


def make_tightrope(make_study, tmp_path, *, more=ON_POLICY, grid=GRID, **changes):
    domain = {"teaching_journal": f'"{tmp_path / "journal"}"', **changes.pop("domain", {})}
    family = {"family": '"tightrope:tightrope"', "domain": domain}
    folder = make_taught(make_study, more=more, grid=list(grid), **family, **changes)
    path = folder / "study.toml"
    path.write_text(path.read_text().replace("schoolroom:Matrix", "tightrope:Cells"))
    return folder


@pytest.mark.slow
@pytest.mark.parametrize(("lost", "jobs"), [("weights", "1"), ("samples", "2")])
def test_a_run_of_learners_that_drive_comes_to_the_same_whatever_its_cache_has_lost(make_study, tmp_path, lost, jobs):
    folder = make_tightrope(make_study, tmp_path, grid=GRID[:4], jobs=jobs)
    whole = scores_of(folder)
    for path in sorted((folder / "teaching").glob(f"{lost}-*.npz"))[::2]:
        path.unlink()
    for path in sorted((folder / "teaching").glob("exam-*.npz"))[::3]:
        path.unlink()
    np.testing.assert_array_equal(scores_of(folder), whole)


@pytest.mark.parametrize("jobs", ["1", pytest.param("2", marks=pytest.mark.slow)])
def test_no_round_is_driven_twice(make_study, tmp_path, jobs):
    folder = make_tightrope(make_study, tmp_path, grid=[0, 20, 40], jobs=jobs)
    run(folder)
    driven = (tmp_path / "journal").read_text().splitlines()
    run(folder)
    assert (tmp_path / "journal").read_text().splitlines() == driven
    curves, repetitions, starts = 4, 3, int(read_study_settings(folder).starts)
    assert sum(line.startswith("exam") for line in driven) == starts * repetitions * (curves * 3 - 1)
    assert len(list((folder / "teaching").glob("samples-*.npz"))) == repetitions * (curves * 2 + 3 * 4)


def test_an_expert_without_labels_where_the_learner_drives_is_one_line_with_the_proxys_name(make_study, tmp_path):
    folder = make_tightrope(make_study, tmp_path, domain={"silent": "true"})
    with pytest.raises(LearnerError, match=r"^none: an expert without labels on the learner's states: .*; have it"):
        run(folder)


@pytest.mark.parametrize("key", ["target_lessons", "proxy_lessons"])
def test_a_family_that_cannot_guide_is_refused_where_the_learner_is_to_drive(make_study, key):
    folder = make_taught(make_study, more=f'{key} = "learner"')
    assert complaint_of(load_setup, read_study_settings(folder)) == (
        f"{folder / 'study.toml'}: teaching.{key}: schoolroom:schoolroom cannot teach a learner that drives: "
        "it lacks guide; add it, or take 'expert'"
    )


POINT = CurvePoint("near", PROXY, 0, 20)
ALONE = CurvePoint("none", None, 0, 20)
LESSON = r"near: the expert's lesson in the proxy at trim = 0\.1\d+, start \d"
FIRST, EXAM = (f"none: the learner's examination in the target at start {start}" for start in (0, 2))


def room(*faults, kind=StuckRoom):
    return kind(Wobbly(theta=(("trim", 0.12), ("delay", 0.21)), faults=faults))


MOMENTS = {
    "a lesson": ({"proxy": room("lesson:*:raises")}, POINT, LESSON),
    "a training": ({"learner": trains("raises")}, ALONE, "none: the learner's training"),
    "an answer": ({"learner": acts("raises")}, ALONE, FIRST),
    "an examination": ({"target": room("exam:2:raises")}, ALONE, EXAM),
    "examinations at once": (
        {"target": room("together:2:raises", kind=StuckTogether)},
        ALONE,
        f"{FIRST} and the others beside it",
    ),
}


@pytest.mark.parametrize(("changes", "point", "named"), MOMENTS.values(), ids=MOMENTS)
def test_what_raises_is_named_with_its_start(tmp_path, changes, point, named):
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


@dataclass(frozen=True)
class Odd(Matrix):
    """Its weights are none."""

    weights: object = None

    def train(self, samples, start, seed):
        return self.weights


@pytest.mark.parametrize(
    "weights", [[1, 2], None, {"w": object()}, {3: np.zeros(2)}], ids=("a list", "none", "an object", "a number")
)
def test_weights_that_are_no_arrays_by_name_are_refused_by_the_learners_name(tmp_path, weights):
    one = setup(tmp_path, learner=Odd(weights=weights))
    told = f"none: train of '{one.settings.learner}' returned no arrays of numbers by name; return a dict of such"
    assert complaint_of(one.score, ALONE) == told
    assert not list(tmp_path.glob("weights-*"))


@pytest.mark.parametrize("name", ["file", "allow_pickle", "facts"])
def test_weights_under_a_name_that_they_cannot_be_kept_by_are_refused_by_that_name(tmp_path, name):
    one = setup(tmp_path, learner=Odd(weights={"matrix": np.zeros((3, 2)), name: np.zeros(2)}))
    told = f"none: train of '{one.settings.learner}' calls an array '{name}', which is taken; call it otherwise"
    assert complaint_of(one.score, ALONE) == told


class Silly(Schoolroom):
    """Its scores are none."""

    def examine(self, episode, policy):
        return "much"


def test_what_is_no_score_is_named(tmp_path):
    with pytest.raises(EpisodeError, match="none: an examination raised TypeError"):
        setup(tmp_path, target=Silly(Wobbly())).score(ALONE)


HANGING = {
    "a lesson": ({"proxy": room("lesson:*:hangs")}, POINT, LESSON),
    "a learner's answer": ({"learner": acts("hangs in C")}, ALONE, FIRST),
    "an examination": ({"target": room("exam:2:hangs")}, ALONE, EXAM),
    "one of several at once": ({"target": room("together:2:hangs", "exam:2:hangs", kind=StuckTogether)}, ALONE, EXAM),
}


@pytest.mark.slow
@pytest.mark.parametrize(("moment", "jobs"), list(zip(HANGING, (1, 2, 2, 1), strict=True)))
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
def test_examinations_that_hang_only_side_by_side_come_to_the_same_one_after_the_other(tmp_path):
    points = [POINT, ALONE]
    whole = make(setup(tmp_path / "whole", target=room()), points, 1)
    stuck = setup(tmp_path / "stuck", target=room("together:2:hangs", kind=StuckTogether), timeout_s=1.0)
    assert make(stuck, points, 2) == whole


@pytest.mark.slow
def test_a_limit_that_nothing_overruns_changes_no_score_and_is_none_for_trainings(tmp_path):
    points = [CurvePoint("near", PROXY, 0, count) for count in (0, 20, 40)]
    whole = make(setup(tmp_path / "whole"), points, jobs=1)
    found = make(setup(tmp_path / "slow", learner=trains("lingers"), timeout_s=1.0), points, jobs=2)
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
