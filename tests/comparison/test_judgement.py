import json
import math
from dataclasses import asdict, replace

import pytest

from proxytune.comparison.analytic import Analytic
from proxytune.comparison.calibrated import Calibrated
from proxytune.comparison.judgement import Judgement, judge, judgement_from, judging_code
from proxytune.search import Trial, fit_surrogate, from_unit, learn, unit_points
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


def test_the_answer_of_an_engine_that_learns_from_outputs_is_what_a_study_would_report(judged, trials):
    known = learn(OBJECTIVE.space, trials, OBJECTIVE.goal(SEED), SEED)
    assert judged.answer == known.answer
    assert judged.answer_score == OBJECTIVE.fresh_score(known.answer, SEED)


def test_that_of_any_other_engine_is_where_the_model_of_the_score_is_lowest(judged, trials):
    found = judge(OBJECTIVE, VISITED, SEED, by_outputs=False)
    assert found.answer == fit_surrogate(OBJECTIVE.space, trials).incumbent()[0]
    assert found.reading == judged.reading, "what points tell does not depend on who chose them"


def test_the_reading_says_whether_region_and_intervals_hold_the_truth(judged, trials):
    known, truth = learn(OBJECTIVE.space, trials, OBJECTIVE.goal(SEED), SEED), OBJECTIVE.truth(SEED)
    assert judged.reading.holds == known.holds(truth)
    assert judged.reading.share == known.posterior.share
    held = {
        name: low <= value <= high for value, (name, (low, high)) in zip(truth, known.intervals.items(), strict=True)
    }
    assert judged.reading.intervals_hold == held
    assert (judged.reading.p_value, judged.reading.fits) == (known.misfit.p_value, known.misfit.fits)


def test_a_truth_far_from_all_that_fits_is_not_held():
    class Elsewhere(Calibrated):
        def truth(self, seed):
            return from_unit(self.space, 1.0 - unit_points(4, 1, 9)[0])

        def goal(self, seed):
            return Calibrated().goal(seed)

    apart = Elsewhere()
    truths = [judge(apart, VISITED, seed, by_outputs=True).reading for seed in (1, 2, 3)]
    assert not all(reading.holds for reading in truths)
    assert not all(all(reading.intervals_hold.values()) for reading in truths)


def test_without_parts_there_is_no_reading_and_without_a_truth_nothing_holds_it():
    class Unknown(Calibrated):
        def truth(self, seed):
            return Calibrated().truth(seed) if self.name == "inner" else None

        def regret(self, values, seed, lowest=math.inf):
            return Calibrated().regret(values, seed)

        def goal(self, seed):
            return Calibrated().goal(seed)

        def score(self, values, seed):
            return Calibrated().score(values, seed)

        def fresh_score(self, values, seed):
            return Calibrated().fresh_score(values, seed)

        def error(self, values, seed):
            return None

    assert judge(Analytic(), VISITED, 1, by_outputs=False).reading is None
    reading = judge(Unknown(), VISITED, SEED, by_outputs=False).reading
    assert (reading.holds, reading.intervals_hold) == (None, None)
    assert 0.0 < reading.share < 1.0


def test_an_objective_is_told_the_lowest_regret_so_far():
    told = []

    class Listening(Analytic):
        def regret(self, values, seed, lowest=math.inf):
            told.append(lowest)
            return Analytic().regret(values, seed)

    regrets = judge(Listening(), VISITED, 1, by_outputs=False).regrets
    # Scores are asked for first, and made of regrets here.
    assert told[len(VISITED) : 2 * len(VISITED)] == [min((math.inf, *regrets[:count])) for count in range(len(VISITED))]


def test_evaluations_are_counted_to_the_first_point_within_the_floor():
    found = Judgement((None, 9.0, 4.0, 8.0, 0.0), (0.0,), 0.0, 0.0, None, None, "")
    assert found.best_regrets == (math.inf, 9.0, 4.0, 4.0, 0.0)
    assert found.evaluations_to(4.0) == 3
    assert found.evaluations_to(0.0) == 5
    assert found.evaluations_to(-1.0) is None


def test_a_judgement_comes_back_from_json_as_it_was(judged):
    for one in (judged, replace(judged, reading=None)):
        assert judgement_from(json.loads(json.dumps(asdict(one)))) == one
    assert judged.code == judging_code()
