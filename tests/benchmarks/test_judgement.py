"""Runs of engines, what their points are worth, and what many say together."""

import json
import math
from dataclasses import asdict, replace

import numpy as np
import pytest
import runs
from calibrated import Calibrated
from judgement import Judgement, Reading, judge, judgement_from, judging_code
from problems import Analytic
from runs import Run, RunKey, estimate, read_runs, run_document, run_engine, run_from, summarise

from proxytune.search import Trial, engine_of, fit_surrogate, from_unit, learn_theta, unit_points
from proxytune.search.engine import design_point

OBJECTIVE = Calibrated()
SEED = 3
VISITED = tuple(design_point(OBJECTIVE.space, index, SEED) for index in range(12))


@pytest.fixture(scope="module")
def judged():
    return judge(OBJECTIVE, VISITED, SEED, by_outputs=True)


@pytest.fixture(scope="module")
def trials():
    return [Trial(values, OBJECTIVE.score(values, SEED), OBJECTIVE.outcome(values, SEED)) for values in VISITED]


def test_the_answer_of_an_engine_is_what_a_study_reports_and_its_reading_whether_truth_is_held(judged, trials):
    known = learn_theta(OBJECTIVE.space, trials, OBJECTIVE.goal(SEED), SEED)
    assert judged.answer == known.answer
    assert judged.answer_score == OBJECTIVE.fresh_score(known.answer, SEED)
    found = judge(OBJECTIVE, VISITED, SEED, by_outputs=False)
    assert found.answer == fit_surrogate(OBJECTIVE.space, trials).incumbent()[0]
    assert found.reading == judged.reading, "what points tell does not depend on who chose them"
    known, truth = learn_theta(OBJECTIVE.space, trials, OBJECTIVE.goal(SEED), SEED), OBJECTIVE.truth(SEED)
    assert judged.reading.holds == known.holds(truth)
    assert judged.reading.share == known.posterior.share
    pairs = zip(truth, known.intervals.items(), strict=True)
    assert judged.reading.intervals_hold == {name: low <= value <= high for value, (name, (low, high)) in pairs}
    assert (judged.reading.p_value, judged.reading.fits) == (known.misfit.p_value, known.misfit.fits)


@pytest.mark.slow
def test_a_truth_far_from_all_that_fits_is_not_held():
    class Elsewhere(Calibrated):
        goal = staticmethod(OBJECTIVE.goal)

        def truth(self, seed):
            return from_unit(self.space, 1.0 - unit_points(4, 1, 9)[0])

    truths = [judge(Elsewhere(), VISITED, seed, by_outputs=True).reading for seed in (1, 2, 3)]
    assert not all(reading.holds for reading in truths)
    assert not all(all(reading.intervals_hold.values()) for reading in truths)


def test_without_parts_there_is_no_reading_and_without_a_truth_nothing_holds_it():
    class Unknown(Calibrated):
        regret, goal = staticmethod(OBJECTIVE.regret), staticmethod(OBJECTIVE.goal)
        score, fresh_score = staticmethod(OBJECTIVE.score), staticmethod(OBJECTIVE.fresh_score)

        def truth(self, seed):
            return None

        def error(self, values, seed):
            return None

    assert judge(Analytic(), VISITED, 1, by_outputs=False).reading is None
    reading = judge(Unknown(), VISITED, SEED, by_outputs=False).reading
    assert (reading.holds, reading.intervals_hold) == (None, None)
    assert 0.0 < reading.share < 1.0


def test_evaluations_are_counted_to_the_first_point_within_the_floor_of_an_objective_told_the_lowest():
    found = Judgement((None, 9.0, 4.0, 8.0, 0.0), (0.0,), 0.0, 0.0, None, None, "")
    assert found.best_regrets == (math.inf, 9.0, 4.0, 4.0, 0.0)
    assert found.evaluations_to(4.0) == 3
    assert found.evaluations_to(0.0) == 5
    assert found.evaluations_to(-1.0) is None
    told = []

    class Listening(Analytic):
        def regret(self, values, seed, lowest=math.inf):
            told.append(lowest)
            return Analytic().regret(values, seed)

    regrets = judge(Listening(), VISITED, 1, by_outputs=False).regrets
    # Scores are asked for first, and made of regrets here.
    assert told[len(VISITED) : 2 * len(VISITED)] == [min((math.inf, *regrets[:count])) for count in range(len(VISITED))]


def test_judgements_and_runs_come_back_from_json_as_they_were(judged):
    for one in (judged, replace(judged, reading=None)):
        assert judgement_from(json.loads(json.dumps(asdict(one)))) == one
    assert judged.code == judging_code()
    runs = [replace(run_engine(Analytic(), KEY, SOBOL), seconds=0.0) for _ in range(2)]
    assert runs[0] == runs[1] == run_from(json.loads(json.dumps(run_document(runs[0]))))
    assert len(runs[0].visited) == len(runs[0].judgement.regrets) == 12


def test_a_run_judged_again_proposes_nothing_and_forgets_the_old_judgement(monkeypatch):
    run = run_engine(Analytic(), KEY, SOBOL)
    stale = replace(run, judgement=replace(run.judgement, answer=(0.0,), code="old"))
    monkeypatch.setattr("runs.make_proposer", None)
    assert runs.judged_again(Analytic(), stale, SOBOL) == run


SOBOL = engine_of("sobol")
KEY = RunKey("analytic 1", "sobol", 1, 12, 4, "")


def made(engine, seed, regrets, answer_regret=0.0, error=0.1, reading=None):
    key, score = RunKey("o", engine, seed, len(regrets), 1, ""), None if answer_regret is None else answer_regret + 5.0
    found = Judgement(tuple(regrets), (0.0,), score, answer_regret, error, reading, "")
    return Run(key, ((0.0,),) * len(regrets), 0.5, found)


@pytest.mark.parametrize("engine", ["random", "gp"])
def test_runs_of_one_seed_share_the_design_and_no_more(engine):
    keys = (replace(KEY, engine=name, budget=7) for name in ("sobol", engine))
    one, other = (run_engine(Analytic(), key, engine_of(key.engine)) for key in keys)
    assert one.visited[:4] == other.visited[:4]
    assert one.visited != other.visited


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
    assert found.simulated is None
    assert summarise(rival, default, 4.0, 960.0).simulated.value == 3.5 * 960.0


def test_answers_are_measured_by_what_the_truth_scores_and_a_failed_one_as_the_worst_point():
    default = [made("gp", seed, [0.0], error=0.1) for seed in (1, 2)]
    found = summarise([made("tpe", 1, [0.0], 2.0, error=0.2), made("tpe", 2, [0.0], None, error=0.4)], default, 4.0)
    assert found.of_truth.value == 7.0 / 5.0, "of the answer that has a score; the truth's is 5"
    assert found.error_difference.value == pytest.approx(0.2)
    assert summarise(default, default, 4.0).error_difference is None
    unknown = [made("gp", seed, [0.0], error=None) for seed in (1, 2)]
    assert summarise(unknown, unknown, 4.0).of_truth is None
    runs = [made("gp", 1, [9.0, None, 3.0], answer_regret=None)] * 2
    assert summarise(runs, runs, 4.0).regret.value == 9.0


def test_readings_are_counted_only_where_the_truth_is_known():
    held = [{"delay": True, "trim": False}, {"delay": True, "trim": True}]
    readings = [Reading(share, share < 0.2, one, 0.5, share < 0.2) for share, one in zip((0.1, 0.3), held, strict=True)]
    runs = [made("gp", seed, [9.0, 0.0], reading=reading) for seed, reading in enumerate(readings)]
    region = summarise(runs, runs, 4.0).region
    assert (region.covered, region.misfits, region.intervals_covered) == (1, 1, {"delay": 2, "trim": 1})
    assert region.share.value == pytest.approx(0.2)
    runs = [made("gp", seed, [9.0, 0.0], reading=Reading(0.1, None, None, None, None)) for seed in (1, 2)]
    region = summarise(runs, runs, 4.0).region
    assert (region.covered, region.misfits, region.intervals_covered) == (None, 0, None)


def test_the_curve_is_the_median_of_the_lowest_so_far_and_an_interval_covers_as_often_as_it_says():
    three = [made("gp", seed, regrets) for seed, regrets in enumerate([[9.0, 1.0], [7.0, 8.0], [5.0, 2.0]])]
    middle, low, high = runs.median_curve(three)
    assert middle.tolist() == [7.0, 2.0]
    assert (low <= middle).all()
    assert (middle <= high).all()
    generator = np.random.default_rng(1)
    found = [estimate(generator.normal(5.0, 2.0, 30), np.mean) for _ in range(100)]
    assert 86 <= sum(one.low <= 5.0 <= one.high for one in found) < 100


@pytest.mark.parametrize("line", [b"\xff\xfe", b"[" * 20_000, b"[]", b"3", b"{}"])
def test_spoilt_lines_of_finished_runs_are_skipped(write_file, line):
    assert read_runs(write_file(line + b"\n", "runs.jsonl")) == {}
