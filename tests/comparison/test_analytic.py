import numpy as np
from hypothesis import given, settings, strategies as st

from proxytune.comparison.analytic import CEILING, NOISE, STEP, Analytic
from proxytune.search import from_unit, to_unit
from proxytune.search.engine import design_point

OBJECTIVE = Analytic()
SEEDS = st.integers(0, 1000)
UNITS = st.tuples(*[st.floats(0, 1)] * 4)


@settings(derandomize=True, max_examples=50, deadline=None)
@given(seed=SEEDS, unit=UNITS)
def test_the_score_is_a_whole_number_within_its_noise_of_the_regret_and_the_same_when_asked_again(seed, unit):
    values = from_unit(OBJECTIVE.space, np.array(unit))
    score, regret = OBJECTIVE.score(values, seed), OBJECTIVE.regret(values, seed)
    assert score == int(score) >= 0
    assert -NOISE <= score - regret - NOISE <= NOISE
    assert score == OBJECTIVE.score(values, seed)
    assert 0 <= regret <= CEILING
    assert regret % STEP == 0


@settings(derandomize=True, max_examples=50, deadline=None)
@given(seed=SEEDS)
def test_the_optimum_lies_in_the_box_and_has_no_regret_and_no_error(seed):
    optimum = OBJECTIVE.truth(seed)
    assert OBJECTIVE.regret(optimum, seed) == OBJECTIVE.fresh_regret(optimum, seed) == 0.0
    assert OBJECTIVE.error(optimum, seed) == 0.0
    assert all(0.2 <= unit <= 0.8 for unit in to_unit(OBJECTIVE.space, optimum))


def test_the_noise_takes_all_its_values_alike():
    points = [design_point(OBJECTIVE.space, index, 5) for index in range(500)]
    noise = [OBJECTIVE.score(point, 3) - OBJECTIVE.regret(point, 3) - NOISE for point in points]
    counts = [noise.count(float(value)) for value in range(-NOISE, NOISE + 1)]
    assert sum(counts) == 500
    assert min(counts) > 60


def test_the_noise_is_drawn_anew_wherever_one_parameter_alone_is_moved():
    seed = 4
    for column in range(4):
        unit = to_unit(OBJECTIVE.space, OBJECTIVE.truth(seed))
        noise = set()
        for step in range(12):
            unit[column] = 0.5 + 1e-3 * step
            values = from_unit(OBJECTIVE.space, unit)
            noise.add(OBJECTIVE.score(values, seed) - OBJECTIVE.regret(values, seed))
        assert len(noise) > 2, column


def test_there_are_plateaus_and_blur_is_hardly_seen_while_trim_is():
    seed = 4
    blur, pitch, delay, trim = to_unit(OBJECTIVE.space, OBJECTIVE.truth(seed))

    def moved(*unit):
        return OBJECTIVE.regret(from_unit(OBJECTIVE.space, np.array(unit)), seed)

    assert moved(blur, pitch, delay, trim + 0.01) == 0.0
    assert moved(blur, pitch, delay, trim + 0.2) > moved(blur - 0.2, pitch, delay, trim) > 0.0


def test_other_seeds_are_other_problems():
    assert OBJECTIVE.truth(1) != OBJECTIVE.truth(2)
