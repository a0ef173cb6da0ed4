"""Who drives in lessons, in which rounds, and what each round depends on."""

from dataclasses import replace

import numpy as np
import pytest
from taught import make_taught
from tightrope import Cells, Tightrope
from wobbly import Wobbly

from proxytune.errors import LearnerError, SettingsError
from proxytune.learning.cache import Cache
from proxytune.learning.lessons import Distribution
from proxytune.learning.settings import TeachingSettings
from proxytune.running.progress import Silent
from proxytune.study.settings import read_study_settings
from proxytune.teaching.experiment import load_setup, run_experiment
from proxytune.teaching.points import Point, TeachingSetup
from proxytune.teaching.stages import equal_rounds

GRID = (0, 20, 40, 80, 160, 320, 640)
NEAR = Distribution({})
ON_POLICY = 'target_lessons = "learner"\nproxy_lessons = "learner"'


def setup(folder, **changes):
    """An experiment on the tightrope; the target's deviations grow faster than the proxy's."""
    settings = TeachingSettings(
        target=folder / "twin.toml",
        learner="tightrope:Cells",
        proxy_samples=40,
        target_samples=GRID,
        seeds=4,
        lesson_s=2.0,
        level=None,
        tolerance=5.0,
        budget=1,
        narrow=False,
        widths={},
        proxies={"near": NEAR},
    )
    folder.mkdir(exist_ok=True)
    return TeachingSetup(
        proxy=Tightrope(Wobbly()),
        target=Tightrope(Wobbly(theta=(("trim", 0.1),)), journal=str(folder / "journal")),
        learner=Cells(),
        learner_identity="cells",
        settings=replace(settings, **changes),
        seed=1,
        starts=5,
        cache=Cache(folder / "cache"),
    )


def mean_scores(made, proxy):
    """Of four repetitions, at each count of the grid."""
    points = [[Point("near", proxy, repetition, count) for count in GRID] for repetition in range(4)]
    return np.mean([[made.score(point) for point in row] for row in points], axis=0)


def first_within(scores, tolerance):
    """The first count from which on scores are within a tolerance of the best there is."""
    below = np.flatnonzero(~(scores >= 60.0 - tolerance))
    return GRID[below[-1] + 1 if len(below) else 0]


@pytest.mark.parametrize("proxy", [None, NEAR], ids=["without a proxy", "after a proxy"])
def test_a_learner_that_errs_to_where_the_expert_never_is_needs_fewer_samples_of_its_own_driving(tmp_path, proxy):
    off, on = (mean_scores(setup(tmp_path / by, target_lessons=by), proxy) for by in ("expert", "learner"))
    assert 0 < first_within(on, 5.0) <= first_within(off, 5.0) / 4


def test_a_proxy_teaches_better_where_the_learner_drives_in_it(tmp_path):
    off, on = (mean_scores(setup(tmp_path / by, proxy_lessons=by), NEAR) for by in ("expert", "learner"))
    assert on[0] > off[0] + 20.0


def samples(made, count, proxy=None):
    return made._stage(Point("near", proxy, 0, count)).samples(count)


@pytest.mark.parametrize("by", ["expert", "learner"])
@pytest.mark.parametrize("proxy", [None, NEAR], ids=["without a proxy", "after a proxy"])
@pytest.mark.parametrize("count", [1, 20, 21, 71, 283])
def test_more_samples_begin_with_the_same_ones_whatever_the_count(tmp_path, by, proxy, count):
    whole = samples(setup(tmp_path / "whole", target_lessons=by), 320, proxy)
    first = samples(setup(tmp_path / "first", target_lessons=by), count, proxy)
    assert len(first.commands) == count
    np.testing.assert_array_equal(first.observations, whole.observations[:count])
    np.testing.assert_array_equal(first.commands, whole.commands[:count])


def test_no_samples_are_those_of_no_round(tmp_path):
    made = setup(tmp_path, target_lessons="learner")
    assert np.isnan(made.score(Point("none", None, 0, 0)))
    assert made.score(Point("near", NEAR, 0, 0)) > 0.0
    assert not any(line.startswith("guided") for line in (tmp_path / "journal").read_text().splitlines())


@pytest.mark.parametrize(("proxy", "first"), [(None, "lesson"), (NEAR, "guided")])
def test_the_expert_drives_where_nothing_has_been_learnt_and_the_learner_ever_after(tmp_path, proxy, first):
    made = setup(tmp_path, target_lessons="learner")
    for count, kind in ((20, first), (71, "guided"), (160, "guided")):
        samples(made, count, proxy)
        journal = (tmp_path / "journal").read_text().splitlines()
        assert {line.split()[0] for line in journal} == {kind}
        (tmp_path / "journal").unlink()


def test_each_round_has_lessons_of_its_own(tmp_path):
    samples(setup(tmp_path, target_lessons="learner"), 640)
    seeds = [line.split()[1] for line in (tmp_path / "journal").read_text().splitlines()]
    assert len(seeds) > 30
    assert len(set(seeds)) == len(seeds)


def test_a_round_is_another_by_another_learner_proxy_or_repetition_and_not_by_what_comes_after_it(tmp_path):
    made = setup(tmp_path, target_lessons="learner")
    facts = made._stage(Point("near", NEAR, 0, 0)).round_facts(2)
    others = [
        replace(made, learner_identity="others")._stage(Point("near", NEAR, 0, 0)),
        made._stage(Point("far", Distribution({"trim": (0.2, 0.2)}), 0, 0)),
        made._stage(Point("near", NEAR, 1, 0)),
        made._stage(Point("none", None, 0, 0)),
        setup(tmp_path, target_lessons="learner", rehearsal=0.5)._stage(Point("near", NEAR, 0, 0)),
        setup(tmp_path, target_lessons="learner", proxy_lessons="learner")._stage(Point("near", NEAR, 0, 0)),
        setup(tmp_path, target_lessons="learner", target_samples=(0, 20, 60, 80))._stage(Point("near", NEAR, 0, 0)),
    ]
    assert all(other.round_facts(2) != facts for other in others)
    longer = setup(tmp_path, target_lessons="learner", target_samples=(*GRID, 2000))
    assert longer._stage(Point("near", NEAR, 0, 0)).round_facts(2) == facts


@pytest.mark.parametrize(
    ("count", "rounds", "ends"),
    [(4000, 4, (1000, 2000, 3000, 4000)), (10, 4, (2, 5, 8, 10)), (2, 4, (1, 2)), (1, 4, (1,)), (7, 1, (7,))],
)
def test_equal_rounds_end_with_the_last_sample(count, rounds, ends):
    assert equal_rounds(count, rounds) == ends


def run(folder):
    settings = read_study_settings(folder)
    found = run_experiment(settings, load_setup(settings), Silent())
    return np.stack([found.without.scores, *(one.curve.scores for one in found.teachers)])


def make_tightrope(make_study, tmp_path, *, more=ON_POLICY, grid=GRID, **changes):
    domain = {"teaching_journal": f'"{tmp_path / "journal"}"', **changes.pop("domain", {})}
    family = {"family": '"tightrope:tightrope"', "domain": domain}
    folder = make_taught(make_study, more=more, grid=list(grid), **family, **changes)
    path = folder / "study.toml"
    path.write_text(path.read_text().replace("schoolroom:Matrix", "tightrope:Cells"))
    return folder


@pytest.mark.slow
@pytest.mark.parametrize("jobs", ["1", "2"])
@pytest.mark.parametrize("lost", ["exam", "weights", "samples"])
def test_a_run_of_learners_that_drive_comes_to_the_same_whatever_its_cache_has_lost(make_study, tmp_path, jobs, lost):
    folder = make_tightrope(make_study, tmp_path, jobs=jobs)
    whole = run(folder)
    for path in sorted((folder / "teaching").glob(f"{lost}-*.npz"))[::2]:
        path.unlink()
    for path in sorted((folder / "teaching").glob("exam-*.npz"))[::3]:
        path.unlink()
    np.testing.assert_array_equal(run(folder), whole)


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
    with pytest.raises(SettingsError) as told:
        load_setup(read_study_settings(folder))
    assert str(told.value) == (
        f"{folder / 'study.toml'}: teaching.{key}: schoolroom:schoolroom cannot teach a learner that drives: "
        "it lacks guide; add it, or take 'expert'"
    )
