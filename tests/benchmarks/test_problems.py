"""Problems that engines are compared on are what they say, and draw the same whenever they are asked."""

from dataclasses import replace

import numpy as np
import pytest
from calibrated import COMPARED, LONGEST, METRICS as OUTPUTS, Calibrated, course, replaced, simulated
from hypothesis import given, settings, strategies as st
from one_line import complaint_of
from problems import AGENTS, CEILING, METRICS, NOISE, STEP, Analytic, Ranking
from processes import ROOT
from study_problems import TruthObjective, lacking_families

from proxytune.errors import EpisodeError
from proxytune.running import Silent
from proxytune.search import from_unit, to_unit
from proxytune.search.engine import design_point
from proxytune.seeds import fresh_seed, target_seed
from proxytune.storage import Store
from proxytune.study import StudyRun, measure_agents, open_study, plan_episodes
from proxytune.usefulness import compare, prpv_of_means
from proxytune.usefulness.pairs import prpv

ANALYTIC, RANKING, CALIBRATED = Analytic(), Ranking(), Calibrated()


@pytest.mark.parametrize("problem", [ANALYTIC, RANKING, CALIBRATED], ids=lambda problem: problem.name)
def test_the_optimum_lies_in_the_middle_of_the_box_and_has_no_regret_and_no_error(problem):
    for seed in range(20):
        optimum = problem.truth(seed)
        assert problem.regret(optimum, seed) == problem.fresh_regret(optimum, seed) == 0.0
        assert problem.error(optimum, seed) == pytest.approx(0.0)
        assert all(0.1 <= unit <= 0.9 for unit in to_unit(problem.space, optimum))
        assert optimum != problem.truth(seed + 1)


@pytest.fixture
def opened(make_study, tmp_path):
    """Makes the objective on a study with these effects that the proxy lacks, and tells what has been simulated."""
    stores = []

    def make(models=(), **changes):
        study = open_study(make_study(domain={"journal": f'"{tmp_path / "journal"}"'}, **changes))
        context = Store.open(tmp_path)
        stores.append(context)
        return TruthObjective(StudyRun(study, context.__enter__()), lacking_families(study, models))

    yield make
    for context in stores:
        context.__exit__(None, None, None)


@pytest.fixture
def driven_so_far(tmp_path):
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


def test_every_seed_has_a_truth_of_its_own_and_error_is_the_mean_distance_in_widths_of_the_box(opened):
    objective = opened()
    truths = [objective.truth(seed) for seed in range(1, 40)]
    assert len(set(truths)) == 39
    unit = np.array([to_unit(objective.space, truth) for truth in truths])
    assert 0.1 <= unit.min() < 0.2
    assert 0.8 < unit.max() <= 0.9
    delay, trim = objective.truth(1)
    assert objective.error((delay, trim), 1) == 0.0
    assert objective.error((delay + 0.03, trim), 1) == pytest.approx(0.05)


def test_the_target_is_what_measure_makes_of_the_truth_under_seeds_that_the_study_does_not_use(opened, tmp_path):
    objective = opened()
    theta = objective.space.theta(objective.truth(2))
    truth = model(tmp_path, "".join(f"{name} = {value!r}\n" for name, value in theta.items()))
    expected = measure_agents(objective.run.study.settings, truth, target_seed(2), Silent())
    goal = objective.goal(2)
    chosen = expected.select(objective.run.study.target.metrics).means
    assert np.array_equal(goal.values.reshape(expected.means.shape), chosen)


def test_targets_are_driven_from_the_studys_starts_whose_own_target_is_not_looked_at(opened):
    objective = opened()
    other = replace(objective.run.study.target, values=objective.run.study.target.values[::-1])
    blind = replace(objective, run=objective.run.of(replace(objective.run.study, target=other)), objectives={})
    assert blind.identity == objective.identity
    assert blind.score(point(objective), 1) == objective.score(point(objective), 1)
    objective.score(point(objective), 1)
    theta = objective.space.theta(objective.truth(1))
    driven = objective.run.store.outcomes(objective.run.study.identity, theta)
    assert set(driven) == set(plan_episodes(objective.run.study.settings, theta, target_seed(1)))


def test_a_regret_above_the_truths_level_simulates_nothing_more(opened, driven_so_far):
    objective = opened()
    level = sum(own_and_fresh(objective, 1)) / 2
    worse = next(p for p in (point(objective, index) for index in range(20)) if objective.score(p, 1) > level)
    before = driven_so_far()
    assert objective.regret(worse, 1) == objective.score(worse, 1) - level
    assert driven_so_far() == before


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
def test_fresh_episodes_are_left_out_where_they_cannot_lower_the_lowest_regret(opened, driven_so_far):
    objective = opened()
    level = sum(own_and_fresh(objective, 1)) / 2
    found = [p for p in (point(objective, index) for index in range(300)) if objective.score(p, 1) <= level]
    before = driven_so_far()
    own = objective.score(found[0], 1) - level
    assert objective.regret(found[0], 1, own) == own
    assert driven_so_far() == before
    assert objective.regret(found[0], 1, own + 1.0) >= own
    assert driven_so_far() == before + 18


def test_the_answer_is_held_against_the_truth_under_the_same_fresh_placements(opened):
    objective = opened()
    answer, truth = point(objective), objective.truth(3)
    expected = objective.score(answer, fresh_seed(3, 1))
    # Against the target of the seed, not of the fresh one.
    assert objective.fresh_score(answer, 3) != expected or objective.truth(fresh_seed(3, 1)) != truth
    assert objective.fresh_regret(answer, 3) == objective.fresh_score(answer, 3) - objective.fresh_score(truth, 3)
    assert objective.fresh_regret(truth, 3) == 0.0


def test_nothing_is_simulated_twice_and_an_evaluation_takes_the_time_of_its_episodes(opened, driven_so_far, tmp_path):
    objective = opened()
    for _ in range(2):
        objective.score(point(objective), 1)
        objective.outcome(point(objective), 1)
        objective.goal(1)
    assert driven_so_far() == 2 * 18
    assert ANALYTIC.seconds is opened().seconds is None, "neither says how long it drives"
    with Store.open(tmp_path) as store:
        assert TruthObjective(StudyRun(open_study(ROOT / "benchmarks" / "truths"), store)).seconds == 12 * 4 * 20.0


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


def test_a_target_with_a_hole_or_another_model_is_none(opened, tmp_path, make_study):
    proxy = model(tmp_path, "delay = 0.1\n")
    assert "proxy: is given, and a target cannot have two models" in complaint_of(opened, [proxy], proxy=f'"{proxy}"')
    study = open_study(make_study(domain={"faults": '["agent2:1:raises"]'}))
    with Store.open(tmp_path) as store, pytest.raises(EpisodeError, match="target of seed 1: agent 'agent2' failed"):
        TruthObjective(StudyRun(study, store)).score((0.1, 0.1), 1)


SEEDS = st.integers(0, 1000)
UNITS = st.tuples(*[st.floats(0, 1)] * 4)


@settings(max_examples=50)
@given(seed=SEEDS, unit=UNITS)
def test_the_score_is_a_whole_number_within_its_noise_of_the_regret_and_the_same_when_asked_again(seed, unit):
    values = from_unit(ANALYTIC.space, np.array(unit))
    score, regret = ANALYTIC.score(values, seed), ANALYTIC.regret(values, seed)
    assert score == int(score) >= 0
    assert -NOISE <= score - regret - NOISE <= NOISE
    assert score == ANALYTIC.score(values, seed)
    assert 0 <= regret <= CEILING
    assert regret % STEP == 0


def test_noise_takes_all_its_values_anew_at_every_point_and_few_points_lie_within_the_floor():
    points = [design_point(ANALYTIC.space, index, 5) for index in range(500)]
    noise = [ANALYTIC.score(point, 3) - ANALYTIC.regret(point, 3) - NOISE for point in points]
    counts = [noise.count(float(value)) for value in range(-NOISE, NOISE + 1)]
    assert sum(counts) == 500
    assert min(counts) > 60
    one, other = ((0.05, 20.0, 0.1, trim) for trim in (0.1, 0.1 + 1e-12))
    noise = [RANKING.table(values, 1).means - RANKING.means(values, 1) for values in (one, other)]
    assert np.abs(noise[0] - noise[1]).min() > 0
    assert RANKING.truth(1) != RANKING.truth(2)
    seed = 4
    blur, pitch, delay, trim = to_unit(ANALYTIC.space, ANALYTIC.truth(seed))

    def moved(*unit):
        return ANALYTIC.regret(from_unit(ANALYTIC.space, np.array(unit)), seed)

    assert moved(blur, pitch, delay, trim + 0.01) == 0.0
    assert moved(blur, pitch, delay, trim + 0.2) > moved(blur - 0.2, pitch, delay, trim) > 0.0

    scores = [RANKING.score(RANKING.truth(seed), seed) for seed in range(60)]
    assert np.mean(scores) == pytest.approx(RANKING.tolerance, rel=0.3)

    regrets = [RANKING.regret(design_point(RANKING.space, index, 7), seed) for seed in (1, 2) for index in range(64)]
    assert np.mean(np.array(regrets) <= RANKING.tolerance) < 0.05
    assert AGENTS * (AGENTS - 1) / 6 < np.median(regrets) < AGENTS * (AGENTS - 1) / 2


@settings(max_examples=20)
@given(seed=SEEDS, unit=UNITS)
def test_the_score_is_prpv_of_its_episodes_and_what_is_composed_of_its_outcome(seed, unit):
    values = from_unit(RANKING.space, np.array(unit))
    score = RANKING.score(values, seed)
    tables = {"proxy": RANKING.table(values, seed), "target": RANKING.target(seed)}
    assert score == prpv(compare(**tables, metrics=METRICS)).value == RANKING.score(values, seed)
    outcomes = np.array([RANKING.outcome(values, seed)] * 3).reshape(3, 1, -1)
    assert np.array_equal(RANKING.goal(seed).compose(outcomes), np.full((3, 1), score))


BOX_POINTS = [design_point(CALIBRATED.space, index, 7) for index in range(64)]


@settings(max_examples=15)
@given(seed=SEEDS, unit=UNITS)
def test_the_score_is_what_its_outcome_is_composed_to_and_prpv_of_two_metrics(seed, unit):
    values = from_unit(CALIBRATED.space, np.array(unit))
    outcome, goal = np.array(CALIBRATED.outcome(values, seed)), CALIBRATED.goal(seed)
    means = [outputs.reshape(12, len(OUTPUTS))[:, :2] for outputs in (outcome, goal.values)]
    assert CALIBRATED.score(values, seed) == goal.compose(outcome) == prpv_of_means(*means, COMPARED)


def test_the_goal_has_every_agents_metrics_with_measured_noise_and_courses_pass_the_simulated_points():
    goal = CALIBRATED.goal(1)
    assert len(goal.outputs) == 12 * len(OUTPUTS) == len(CALIBRATED.outcome(BOX_POINTS[0], 1))
    assert goal.outputs[:2] == (("stroller", "distance"), ("stroller", "survival_time"))
    assert np.array_equal(goal.noise, (simulated().placements ** 2).mean(axis=0))
    assert (goal.noise >= 0.0).all()
    assert np.median(goal.noise) > 0.0
    known = simulated()
    for seed in (1, 2):
        apart = [course(seed)(point) - row for point, row in zip(known.points, known.standardised, strict=True)]
        assert 0.5 < np.std(apart) / np.sqrt(known.roughness) < 1.5
    away = np.std([course(seed)(np.full(4, 0.5)) for seed in range(30)], axis=0)
    assert away[known.smooth > 0.0].min() > 0.0, "between the points seeds differ"


@pytest.mark.slow
def test_the_truth_scores_about_what_it_does_in_the_simulator_and_few_other_points_do():
    """There the proxy at 24 θ, against other placements of itself, scored 6.2 on average."""
    assert 4.0 < np.mean([CALIBRATED.score(CALIBRATED.truth(seed), seed) for seed in range(40)]) < 9.0
    regrets = [CALIBRATED.regret(values, seed) for seed in (1, 2) for values in BOX_POINTS]
    assert np.mean(np.array(regrets) <= CALIBRATED.tolerance) < 0.05
    assert np.median(regrets) > 20.0


def test_outcomes_follow_from_seed_and_point_with_as_many_agents_tied_as_in_the_simulator():
    survival = np.array([CALIBRATED.outcome(values, 1) for values in BOX_POINTS]).reshape(-1, 12, len(OUTPUTS))[:, :, 1]
    there = simulated().means.reshape(-1, 12, len(OUTPUTS))[:, :, 1]
    assert survival.max() == LONGEST
    assert abs((survival == LONGEST).mean() - (there == LONGEST).mean()) < 0.1
    one, other = BOX_POINTS[:2]
    assert CALIBRATED.outcome(one, 1) == Calibrated().outcome(one, 1)
    assert CALIBRATED.fresh_score(one, 1) == Calibrated().fresh_score(one, 1)
    assert CALIBRATED.outcome(one, 1) != CALIBRATED.outcome(one, 2)
    assert CALIBRATED.outcome(one, 1) != CALIBRATED.outcome(other, 1)
    assert CALIBRATED.truth(1) != CALIBRATED.truth(2)


def test_another_placement_stops_nobody_who_is_not_stopped_and_changes_the_others_as_simulated():
    means = np.array(CALIBRATED.outcome(BOX_POINTS[3], 1))
    fresh = replaced(means, 50, np.random.default_rng(0)).reshape(50, 12, len(OUTPUTS))
    tied = means.reshape(12, len(OUTPUTS))[:, 1] == LONGEST
    assert tied.any()
    assert not tied.all()
    assert (fresh[:, tied, 1] == LONGEST).all()
    assert (fresh[:, ~tied, 1].std(axis=0) > 0.0).all()
