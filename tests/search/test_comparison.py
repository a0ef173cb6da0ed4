import json
import math
from dataclasses import replace

import numpy as np
import pytest

from proxytune.search.analytic import Analytic
from proxytune.search.comparison import Run, RunKey, run_document, run_engine, run_from
from proxytune.search.summary import estimate, median_curve, summarise

KEY = RunKey("analytic 1", "sobol", 1, 12, 4, "")


def made(engine, seed, regrets, answer_regret=0.0, error=0.1):
    key = RunKey("o", engine, seed, len(regrets), 1, "")
    return Run(key, tuple(regrets), (0.0,), answer_regret, error, 0.5)


def test_a_run_is_a_function_of_its_key_but_for_the_time_it_took():
    runs = [replace(run_engine(Analytic(), KEY), seconds=0.0) for _ in range(2)]
    assert runs[0] == runs[1]
    assert len(runs[0].regrets) == 12


@pytest.mark.parametrize("engine", ["random", "gp"])
def test_runs_of_one_seed_share_the_design_and_no_more(engine):
    one, other = (run_engine(Analytic(), replace(KEY, engine=name, budget=7)) for name in ("sobol", engine))
    assert one.regrets[:4] == other.regrets[:4]
    assert one.regrets != other.regrets


def test_the_answer_is_a_visited_point_and_judged_without_noise():
    run = run_engine(Analytic(), KEY)
    assert run.answer_regret in run.regrets
    assert run.error == Analytic().error(run.answer, 1)


def test_a_run_comes_back_from_json_as_it_was():
    run = run_engine(Analytic(), KEY)
    assert run_from(json.loads(json.dumps(run_document(run)))) == run


def test_evaluations_are_counted_to_the_first_point_within_the_floor():
    run = made("gp", 1, [None, 9.0, 4.0, 8.0, 0.0])
    assert run.best_regrets == (math.inf, 9.0, 4.0, 4.0, 0.0)
    assert run.evaluations_to(4.0) == 3
    assert run.evaluations_to(0.0) == 5
    assert run.evaluations_to(-1.0) is None


def test_the_saving_is_paired_by_seed_and_a_run_beyond_the_budget_counts_as_one_more():
    default = [made("gp", seed, [9.0, 0.0, 0.0]) for seed in (1, 2)]
    rival = [made("tpe", 1, [9.0, 9.0, 0.0], 2.0), made("tpe", 2, [9.0, 9.0, 9.0], 9.0)]
    found = summarise(rival, default, 4.0)
    assert (found.seeds, found.reached) == (2, 1)
    assert found.saved.value == 1.5
    assert (found.saved.low, found.saved.high) == (1.0, 2.0)
    assert found.evaluations.value == 3.5
    assert found.regret_difference.value == 5.5


def test_the_default_is_not_compared_with_itself():
    default = [made("gp", seed, [9.0, 0.0]) for seed in (1, 2)]
    found = summarise(default, default, 4.0)
    assert found.saved is None
    assert found.regret_difference is None


def test_where_truth_is_not_known_there_is_no_error():
    runs = [made("gp", seed, [9.0, 0.0], error=None) for seed in (1, 2)]
    assert summarise(runs, runs, 4.0).error is None


def test_an_answer_that_failed_counts_as_the_worst_point_of_its_run():
    runs = [made("gp", 1, [9.0, None, 3.0], answer_regret=None)] * 2
    assert summarise(runs, runs, 4.0).regret.value == 9.0


def test_an_interval_covers_the_truth_about_as_often_as_it_says():
    generator = np.random.default_rng(1)
    hits = [
        abs(found.value - 5.0) >= 0 and found.low <= 5.0 <= found.high
        for found in (estimate(generator.normal(5.0, 2.0, 30), np.mean) for _ in range(100))
    ]
    assert 86 <= sum(hits) <= 100


def test_the_curve_is_the_median_of_the_lowest_so_far_within_its_band():
    runs = [made("gp", seed, regrets) for seed, regrets in enumerate([[9.0, 1.0], [7.0, 8.0], [5.0, 2.0]])]
    middle, low, high = median_curve(runs)
    assert middle.tolist() == [7.0, 2.0]
    assert (low <= middle).all()
    assert (middle <= high).all()
