"""The learning experiment finds which proxy teaches, goes on where it was left, and says what cannot be used."""

from dataclasses import replace

import numpy as np
import pytest
from taught import GRID, make_taught
from telling import Telling

from proxytune.errors import EpisodeError, InputError, LearnerError, SettingsError
from proxytune.learning.costs import Costs
from proxytune.running.progress import Silent
from proxytune.study.settings import read_study_settings
from proxytune.teaching.experiment import judge_curves, load_setup, run_experiment


def run(folder):
    settings = read_study_settings(folder)
    return run_experiment(settings, load_setup(settings), Silent())


def figures(found):
    return {lesson.name: lesson.curve.scores.tolist() for lesson in found.teachers}


def test_the_right_proxy_saves_target_samples_and_the_wrong_one_harms(make_study):
    found = run(make_taught(make_study))
    worth = {lesson.name: lesson.worth for lesson in found.teachers}
    assert found.settled
    assert worth["right"].needed.value == 0.0
    assert worth["right"].plv.value == pytest.approx(worth["right"].without.value, rel=0.02)
    assert worth["right"].plv.low > 0.0
    assert worth["wrong"].plv.value < 0.0
    assert np.isnan(found.without.scores[:, 0]).all()
    assert np.isfinite(found.without.scores[:, 1:]).all()


@pytest.mark.slow
def test_every_point_of_a_learning_curve_is_told_with_its_score(make_study):
    telling = Telling()
    settings = read_study_settings(make_taught(make_study))
    found = run_experiment(settings, load_setup(settings), telling)
    assert len(telling.lines) == len(set(telling.lines)) == 4 * 3 * len(GRID)
    assert "none, repetition 1, 0 target samples: nothing learnt yet" in telling.lines
    last = found.without.scores[2, -1]
    assert f"none, repetition 3, {GRID[-1]} target samples: score {last:.3g}" in telling.lines


@pytest.mark.slow
def test_a_stated_level_is_what_counts_as_converged(make_study):
    strict = run(make_taught(make_study, more="level = 59.9"))
    assert (strict.when.level, strict.when.threshold) == (59.9, pytest.approx(53.9))


@pytest.mark.slow
@pytest.mark.parametrize("jobs", ["1", "2"])
def test_a_run_whose_cache_lost_any_of_its_pieces_comes_to_the_same(make_study, jobs):
    folder = make_taught(make_study, jobs=jobs)
    whole = run(folder)
    for lost in ("exam", "weights", "samples"):
        for path in sorted((folder / "teaching").glob(f"{lost}-*.npz"))[::3]:
            path.unlink()
        again = run(folder)
        assert figures(again) == figures(whole)
        assert [lesson.worth for lesson in again.teachers] == [lesson.worth for lesson in whole.teachers]


@pytest.mark.slow
def test_what_is_cached_is_neither_driven_nor_trained_again(make_study, tmp_path):
    journal = tmp_path / "journal"
    folder = make_taught(make_study, domain={"teaching_journal": f'"{journal}"'})
    run(folder)
    first = journal.read_text().splitlines()
    run(folder)
    assert journal.read_text().splitlines() == first
    examined = sum(line.startswith("exam") for line in first)
    assert examined == 3 * (4 * 3 * len(GRID) - 3)  # starts × (curves × seeds × counts, less those of no learner)


@pytest.mark.slow
def test_more_seeds_add_to_what_was_done(make_study, tmp_path):
    journal = tmp_path / "journal"
    folder = make_taught(make_study, domain={"teaching_journal": f'"{journal}"'})
    before = figures(run(folder))
    driven = len(journal.read_text().splitlines())
    path = folder / "study.toml"
    path.write_text(path.read_text().replace("seeds = 3", "seeds = 4"))
    after = figures(run(folder))
    assert {name: scores[:3] for name, scores in after.items()} == before
    assert len(journal.read_text().splitlines()) - driven < driven / 2


def test_a_target_budget_too_small_to_converge_is_no_plv(make_study):
    found = run(make_taught(make_study, grid=[0, 3, 6]))
    assert not found.settled
    assert all(lesson.worth is None for lesson in found.teachers)


@pytest.mark.slow
def test_plv_in_cost_is_plv_times_the_cost_where_every_sample_costs_the_same(make_study):
    costs = "[teaching.costs]\noff_policy = 2.0\non_policy = 2.0"
    for one in run(make_taught(make_study, more=costs)).teachers:
        doubled = [2.0 * end for end in (one.worth.plv.value, one.worth.plv.low, one.worth.plv.high)]
        assert [one.cost.value, one.cost.low, one.cost.high] == pytest.approx(doubled)


@pytest.mark.slow
def test_where_the_learner_drives_its_first_samples_without_a_proxy_cost_what_the_experts_do(make_study):
    settings = read_study_settings(make_taught(make_study))
    setup = load_setup(settings)
    curves = run_experiment(settings, setup, Silent()).needs.curves
    own = replace(setup.settings, target_lessons="learner", costs=Costs(off_policy=10.0, on_policy=1.0))
    for one in judge_curves(settings, replace(setup, settings=own), curves).teachers:
        assert one.cost.value == pytest.approx(one.worth.plv.value + 9.0 * GRID[1])


def test_where_plv_is_unknown_so_is_its_cost(make_study):
    assert all(one.cost is None for one in run(make_taught(make_study, grid=[0, 3, 6])).teachers)


def test_an_expert_that_cannot_drive_is_told_with_the_proxys_name(make_study):
    with pytest.raises(LearnerError, match="cannot drive here"):
        run(make_taught(make_study, domain={"blocked": "0.9"}))


def test_a_policy_that_gives_no_command_stops_the_run_and_keeps_the_rest(make_study):
    folder = make_taught(make_study)
    path = folder / "study.toml"
    (folder / "silly_learner.py").write_text(
        "import numpy as np\n\n\nclass Silly:\n"
        "    def train(self, samples, start, seed):\n        return {'nothing': np.zeros(1)}\n\n"
        "    def act(self, weights, observation):\n        return np.array([np.nan, 0.0])\n"
    )
    path.write_text(path.read_text().replace("schoolroom:Matrix", "silly_learner:Silly"))
    with pytest.raises(EpisodeError, match="no command"):
        run(folder)
    assert list((folder / "teaching").glob("samples-*.npz"))


@pytest.mark.parametrize(
    ("edit", "says"),
    [
        (
            ("schoolroom:Matrix", "schoolroom:Nothing"),
            "teaching.learner: learner 'schoolroom:Nothing': schoolroom has",
        ),
        (("schoolroom:Matrix", "wobbly:Wobbly"), "learner 'wobbly:Wobbly' "),
        (("schoolroom:schoolroom", "wobbly:wobbly"), "family: wobbly:wobbly cannot teach: it lacks best_score"),
        (("trim = -0.3\n", "trim = -0.4\n"), "teaching.proxies.wrong.trim: must lie within [-0.3, 0.3]"),
        (("trim = -0.3\n", "tilt = 1.0\n"), "teaching.proxies.wrong.tilt: unknown parameter; did you mean 'trim'?"),
    ],
)
def test_what_cannot_be_used_is_one_line_with_its_key(make_study, edit, says):
    folder = make_taught(make_study)
    path = folder / "study.toml"
    path.write_text(path.read_text().replace(*edit))
    with pytest.raises(InputError) as told:
        run(folder)
    assert says in str(told.value)


def test_a_study_without_the_table_cannot_teach(make_study):
    with pytest.raises(SettingsError, match="teaching: is missing; add the table"):
        load_setup(read_study_settings(make_study()))


def test_a_study_without_proxies_has_nothing_to_compare(make_study):
    folder = make_taught(make_study)
    path = folder / "study.toml"
    path.write_text(path.read_text().split("[teaching.proxies")[0])
    with pytest.raises(SettingsError, match=r"teaching\.proxies: is missing"):
        run(folder)
