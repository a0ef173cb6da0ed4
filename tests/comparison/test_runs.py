import json
from dataclasses import replace

import numpy as np
import pytest

from proxytune.comparison.analytic import Analytic
from proxytune.comparison.judgement import Judgement, Reading
from proxytune.comparison.runs import Run, RunKey, judged_again, run_document, run_engine, run_from
from proxytune.comparison.summary import estimate, median_curve, summarise
from proxytune.search import engine_of

SOBOL = engine_of("sobol")
KEY = RunKey("analytic 1", "sobol", 1, 12, 4, "")


def made(engine, seed, regrets, answer_regret=0.0, error=0.1, reading=None):
    key, score = RunKey("o", engine, seed, len(regrets), 1, ""), None if answer_regret is None else answer_regret + 5.0
    found = Judgement(tuple(regrets), (0.0,), score, answer_regret, error, reading, "")
    return Run(key, ((0.0,),) * len(regrets), 0.5, found)


def test_a_run_is_a_function_of_its_key_but_for_the_time_it_took():
    runs = [replace(run_engine(Analytic(), KEY, SOBOL), seconds=0.0) for _ in range(2)]
    assert runs[0] == runs[1]
    assert len(runs[0].visited) == len(runs[0].judgement.regrets) == 12


@pytest.mark.parametrize("engine", ["random", "gp"])
def test_runs_of_one_seed_share_the_design_and_no_more(engine):
    one, other = (
        run_engine(Analytic(), replace(KEY, engine=name, budget=7), engine_of(name)) for name in ("sobol", engine)
    )
    assert one.visited[:4] == other.visited[:4]
    assert one.visited != other.visited


def test_the_answer_is_a_visited_point_and_judged_without_noise():
    found = run_engine(Analytic(), KEY, SOBOL).judgement
    assert found.answer_score == found.answer_regret
    assert found.answer_regret in found.regrets
    assert found.error == Analytic().error(found.answer, 1)


def test_a_run_judged_again_proposes_nothing_and_forgets_the_old_judgement(monkeypatch):
    run = run_engine(Analytic(), KEY, SOBOL)
    stale = replace(run, judgement=replace(run.judgement, answer=(0.0,), code="old"))
    monkeypatch.setattr("proxytune.comparison.runs.make_proposer", None)
    assert judged_again(Analytic(), stale, SOBOL) == run


def test_a_run_comes_back_from_json_as_it_was():
    run = run_engine(Analytic(), KEY, SOBOL)
    assert run_from(json.loads(json.dumps(run_document(run)))) == run


def test_the_saving_is_paired_by_seed_and_a_run_beyond_the_budget_counts_as_one_more():
    default = [made("gp", seed, [9.0, 0.0, 0.0]) for seed in (1, 2)]
    rival = [made("tpe", 1, [9.0, 9.0, 0.0], 2.0), made("tpe", 2, [9.0, 9.0, 9.0], 9.0)]
    found = summarise(rival, default, 4.0)
    assert (found.seeds, found.reached) == (2, 1)
    assert found.saved.value == 1.5
    assert (found.saved.low, found.saved.high) == (1.0, 2.0)
    assert found.evaluations.value == 3.5
    assert found.regret_difference.value == 5.5
    assert found.score.value == 10.5
    assert found.ratio.value == 2.0 / 3.5
    assert (found.ratio.low, found.ratio.high) == (0.5, 2.0 / 3.0)


def test_the_default_is_not_compared_with_itself():
    default = [made("gp", seed, [9.0, 0.0]) for seed in (1, 2)]
    found = summarise(default, default, 4.0)
    assert found.saved is None
    assert found.regret_difference is None
    assert found.ratio is None


def test_where_truth_is_not_known_there_is_no_error():
    runs = [made("gp", seed, [9.0, 0.0], error=None) for seed in (1, 2)]
    assert summarise(runs, runs, 4.0).error is None


def test_an_answer_that_failed_counts_as_the_worst_point_of_its_run():
    runs = [made("gp", 1, [9.0, None, 3.0], answer_regret=None)] * 2
    assert summarise(runs, runs, 4.0).regret.value == 9.0


def test_where_every_answer_failed_there_is_no_score():
    runs = [made("gp", seed, [9.0, None, 3.0], answer_regret=None) for seed in (1, 2)]
    assert summarise(runs, runs, 4.0).score is None


def test_readings_are_counted_over_seeds_and_parameters():
    held = [{"delay": True, "trim": False}, {"delay": True, "trim": True}]
    readings = [Reading(share, share < 0.2, one, 0.5, share < 0.2) for share, one in zip((0.1, 0.3), held, strict=True)]
    runs = [made("gp", seed, [9.0, 0.0], reading=reading) for seed, reading in enumerate(readings)]
    region = summarise(runs, runs, 4.0).region
    assert (region.covered, region.misfits, region.intervals_covered) == (1, 1, {"delay": 2, "trim": 1})
    assert region.share.value == pytest.approx(0.2)


def test_where_truth_is_not_known_nothing_is_said_to_hold_it():
    runs = [made("gp", seed, [9.0, 0.0], reading=Reading(0.1, None, None, None, None)) for seed in (1, 2)]
    region = summarise(runs, runs, 4.0).region
    assert (region.covered, region.misfits, region.intervals_covered) == (None, 0, None)


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
