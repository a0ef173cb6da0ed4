from dataclasses import replace

import numpy as np
import pytest

from proxytune.comparison.of_truths import TruthObjective, lacking_families
from proxytune.errors import EpisodeError, InputError
from proxytune.running import Silent
from proxytune.search import to_unit
from proxytune.search.engine import design_point
from proxytune.seeds import fresh_seed, target_seed
from proxytune.storage import Store
from proxytune.study import StudyRun, measure, open_study, plan


@pytest.fixture
def opened(make_study, tmp_path):
    """Makes the objective on a study with these effects that the proxy lacks, and tells what has been simulated."""
    stores = []

    def make(models=(), **changes):
        folder = make_study(domain={"journal": f'"{tmp_path / "journal"}"'}, **changes)
        study = open_study(folder)
        context = Store.open(tmp_path)
        stores.append(context)
        return TruthObjective(StudyRun(study, context.__enter__()), lacking_families(study, models))

    yield make
    for context in stores:
        context.__exit__(None, None, None)


@pytest.fixture
def simulated(tmp_path):
    path = tmp_path / "journal"
    return lambda: len(path.read_text().splitlines()) if path.exists() else 0


def point(objective, index=0):
    return design_point(objective.space, index, 5)


def own_and_fresh(objective, seed):
    """PRPV of the truth, twice."""
    truth = objective.truth(seed)
    return objective.score(truth, seed), objective.fresh_score(truth, seed)


def model(folder, text):
    path = folder / f"lacks{len(list(folder.glob('lacks*')))}.toml"
    path.write_text(text, encoding="utf-8")
    return path


def test_every_seed_has_a_truth_of_its_own_in_the_middle_of_the_box(opened):
    objective = opened()
    truths = [objective.truth(seed) for seed in range(1, 40)]
    assert len(set(truths)) == 39
    unit = np.array([to_unit(objective.space, truth) for truth in truths])
    assert 0.1 <= unit.min() < 0.2
    assert 0.8 < unit.max() <= 0.9


def test_the_target_is_what_measure_makes_of_the_truth_under_seeds_that_the_study_does_not_use(opened, tmp_path):
    objective = opened()
    theta = objective.space.theta(objective.truth(2))
    truth = model(tmp_path, "".join(f"{name} = {value!r}\n" for name, value in theta.items()))
    expected = measure(objective.run.study.settings, truth, target_seed(2), Silent())
    goal = objective.goal(2)
    assert np.array_equal(
        goal.values.reshape(expected.means.shape), expected.select(objective.run.study.target.metrics).means
    )


def test_the_studys_own_target_is_not_looked_at(opened):
    objective = opened()
    other = replace(objective.run.study.target, values=objective.run.study.target.values[::-1])
    blind = replace(objective, run=objective.run.of(replace(objective.run.study, target=other)), objectives={})
    assert blind.identity == objective.identity
    assert blind.score(point(objective), 1) == objective.score(point(objective), 1)


def test_a_regret_above_the_truths_level_simulates_nothing_more(opened, simulated):
    objective = opened()
    level = sum(own_and_fresh(objective, 1)) / 2
    worse = next(p for p in (point(objective, index) for index in range(20)) if objective.score(p, 1) > level)
    before = simulated()
    assert objective.regret(worse, 1) == objective.score(worse, 1) - level
    assert simulated() == before


def test_a_point_that_seems_no_worse_than_the_truth_has_the_regret_of_the_worse_of_two_tries(opened):
    objective = opened()

    class Told(TruthObjective):
        def score(self, values, seed):
            return {objective.truth(1): 4.0, (0.1, 0.1): 3.0, (0.2, 0.1): 6.0}[values]

        def fresh_score(self, values, seed):
            return {objective.truth(1): 6.0, (0.1, 0.1): 9.0}[values]

    told = Told(objective.run)
    assert told.regret((0.1, 0.1), 1) == 4.0
    assert told.regret((0.2, 0.1), 1) == 1.0
    assert told.regret(objective.truth(1), 1) == 1.0
    assert told.fresh_regret((0.1, 0.1), 1) == 3.0


@pytest.mark.slow
def test_fresh_episodes_are_left_out_where_they_cannot_lower_the_lowest_regret(opened, simulated):
    objective = opened()
    level = sum(own_and_fresh(objective, 1)) / 2
    found = [p for p in (point(objective, index) for index in range(300)) if objective.score(p, 1) <= level]
    before = simulated()
    own = objective.score(found[0], 1) - level
    assert objective.regret(found[0], 1, own) == own
    assert simulated() == before
    assert objective.regret(found[0], 1, own + 1.0) >= own
    assert simulated() == before + 18


def test_the_answer_is_held_against_the_truth_under_the_same_fresh_placements(opened):
    objective = opened()
    answer, truth = point(objective), objective.truth(3)
    expected = objective.score(answer, fresh_seed(3, 1))
    # Against the target of the seed, not of the fresh one.
    assert objective.fresh_score(answer, 3) != expected or objective.truth(fresh_seed(3, 1)) != truth
    assert objective.fresh_regret(answer, 3) == objective.fresh_score(answer, 3) - objective.fresh_score(truth, 3)
    assert objective.fresh_regret(truth, 3) == 0.0


def test_nothing_is_simulated_twice(opened, simulated):
    objective = opened()
    for _ in range(2):
        objective.score(point(objective), 1)
        objective.outcome(point(objective), 1)
        objective.goal(1)
    assert simulated() == 2 * 18


def test_error_is_the_mean_distance_from_the_truth_in_widths_of_the_box(opened):
    objective = opened()
    delay, trim = objective.truth(1)
    assert objective.error((delay, trim), 1) == 0.0
    assert objective.error((delay + 0.03, trim), 1) == pytest.approx(0.05)


def test_targets_have_the_effects_that_the_proxy_lacks_by_turns(opened, tmp_path):
    """The family has one parameter that is not in the box here: delay."""
    models = [model(tmp_path, f"delay = {delay}\n") for delay in (0.0, 0.3)]
    box = {"parameters": {"trim": "[-0.3, 0.3]"}}
    lacking, fitting = opened(models, **box), opened((), **box)
    values = {seed: (lacking.goal(seed).values, fitting.goal(seed).values) for seed in (1, 2)}
    assert np.array_equal(*values[2]), "the first file is what the proxy has anyway"
    assert not np.array_equal(*values[1])
    assert lacking.score(point(lacking), 1) != fitting.score(point(fitting), 1)
    assert lacking.identity != fitting.identity


def test_a_proxy_with_a_model_and_targets_with_another_are_refused(opened, tmp_path):
    proxy = model(tmp_path, "delay = 0.1\n")
    with pytest.raises(InputError, match="proxy: is given, and a target cannot have two models"):
        opened([proxy], proxy=f'"{proxy}"')


def test_a_target_with_a_hole_is_no_target(make_study, tmp_path):
    study = open_study(make_study(domain={"faults": '["agent2:1:raises"]'}))
    with Store.open(tmp_path) as store, pytest.raises(EpisodeError, match="target of seed 1: agent 'agent2' failed"):
        TruthObjective(StudyRun(study, store)).score((0.1, 0.1), 1)


def test_targets_are_driven_from_the_studys_starts(opened):
    objective = opened()
    objective.score(point(objective), 1)
    theta = objective.space.theta(objective.truth(1))
    driven = objective.run.store.outcomes(objective.run.study.identity, theta)
    assert set(driven) == set(plan(objective.run.study.settings, theta, target_seed(1)))
