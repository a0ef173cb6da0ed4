import os
import subprocess
import sys

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from proxytune.search.design import design_point
from proxytune.search.gaussian_process import GaussianProcess
from proxytune.search.proposer import Trial
from proxytune.space import Interval, Space

SPACE = Space((Interval("delay", 0.0, 0.3), Interval("trim", -0.3, 0.3)))


def steps(values):
    """An integer score with its lowest step around (0.1, 0.1), like PRPV's."""
    return float(np.floor(40 * (abs(values[0] - 0.1) + abs(values[1] - 0.1))))


def search(proposer, budget, seed, score=steps):
    trials = []
    for _ in range(budget):
        values = proposer.propose(SPACE, trials, seed)
        trials.append(Trial(values, score(values)))
    return trials


def test_the_first_trials_are_the_design():
    trials = search(GaussianProcess(initial=4), 4, seed=9)
    assert [trial.values for trial in trials] == [design_point(SPACE, index, 9) for index in range(4)]


@settings(derandomize=True, max_examples=4, deadline=None)
@given(order=st.permutations(range(12)))
def test_a_proposal_does_not_depend_on_the_order_in_which_trials_are_told(order):
    trials = search(GaussianProcess(initial=6), 12, seed=2)
    shuffled = [trials[place] for place in order]
    assert GaussianProcess(6).propose(SPACE, shuffled, 2) == GaussianProcess(6).propose(SPACE, trials, 2)


def test_resuming_anywhere_proposes_what_an_uninterrupted_search_does():
    whole = search(GaussianProcess(initial=5), 12, seed=3)
    for stop in (0, 3, 5, 8, 11):
        assert GaussianProcess(5).propose(SPACE, whole[:stop], 3) == whole[stop].values


def test_another_process_with_other_threads_proposes_the_same_to_the_last_bit():
    trials = search(GaussianProcess(initial=5), 8, seed=4)
    code = (
        "from proxytune.search.gaussian_process import GaussianProcess as G\n"
        "from proxytune.search.proposer import Trial\n"
        "from proxytune.space import Interval, Space\n"
        f"print(repr(G(5).propose({SPACE!r}, {trials!r}, 4)))"
    )
    environment = {**os.environ, "OMP_NUM_THREADS": "2", "OPENBLAS_NUM_THREADS": "2", "PYTHONHASHSEED": "7"}
    told = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=True)
    assert told.stdout.strip() == repr(GaussianProcess(5).propose(SPACE, trials, 4))


def test_it_never_proposes_a_point_twice_even_on_a_flat_score():
    trials = search(GaussianProcess(initial=4), 25, seed=1, score=lambda values: 3.0)
    units = np.array([[v / 0.3 for v in trial.values] for trial in trials])
    distances = np.abs(units[:, None] - units[None]).max(axis=2) + np.eye(len(units))
    assert distances.min() > 1e-3


def test_it_finds_the_lowest_step_that_the_design_alone_misses():
    lowest = [min(trial.score for trial in search(GaussianProcess(initial=6), 18, seed=seed)) for seed in range(4)]
    design = [min(steps(design_point(SPACE, index, seed)) for index in range(18)) for seed in range(4)]
    assert np.mean(lowest) < np.mean(design)
    assert max(lowest) <= 1


def test_every_proposal_lies_in_the_box_also_where_the_best_is_at_its_edge():
    for trial in search(GaussianProcess(initial=4), 14, seed=1, score=lambda values: -100 * values[0] - values[1]):
        assert 0.0 <= trial.values[0] <= 0.3
        assert -0.3 <= trial.values[1] <= 0.3


def test_a_failed_trial_keeps_the_search_away():
    """Everything beyond 0.15 s fails; the search goes there less than the design would."""
    trials = search(GaussianProcess(initial=6), 20, seed=1, score=lambda v: None if v[0] > 0.15 else steps(v))
    beyond = [trial.values[0] > 0.15 for trial in trials]
    assert sum(beyond[6:]) < 14 / 3


def test_where_all_trials_failed_the_design_goes_on():
    failed = [Trial(design_point(SPACE, index, 1), None) for index in range(9)]
    assert GaussianProcess(initial=4).propose(SPACE, failed, 1) == design_point(SPACE, 9, 1)


@pytest.mark.parametrize("seed", [0, 2**53])
def test_any_seed_of_a_study_can_be_used(seed):
    assert search(GaussianProcess(initial=3), 5, seed)[4].score >= 0
