import os
import subprocess
import sys

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from steps import SPACE, search, steps

from proxytune.search.design import design_point
from proxytune.search.engines.gaussian_process import GaussianProcess
from proxytune.search.engines.registry import make_proposer


@settings(derandomize=True, max_examples=4, deadline=None)
@given(order=st.permutations(range(12)))
def test_a_proposal_does_not_depend_on_the_order_in_which_trials_are_told(order):
    trials = search(make_proposer("gp", 6), 12, seed=2)
    shuffled = [trials[place] for place in order]
    assert GaussianProcess().propose(SPACE, shuffled, 2) == GaussianProcess().propose(SPACE, trials, 2)


@pytest.mark.slow
def test_another_process_with_other_threads_proposes_the_same_to_the_last_bit():
    trials = search(make_proposer("gp", 5), 8, seed=4)
    code = (
        "from proxytune.search.engines.gaussian_process import GaussianProcess as G\n"
        "from proxytune.search.proposer import Trial\n"
        "from proxytune.space import Interval, Space\n"
        f"print(repr(G().propose({SPACE!r}, {trials!r}, 4)))"
    )
    environment = {**os.environ, "OMP_NUM_THREADS": "2", "OPENBLAS_NUM_THREADS": "2", "PYTHONHASHSEED": "7"}
    told = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=True)
    assert told.stdout.strip() == repr(GaussianProcess().propose(SPACE, trials, 4))


def test_it_never_proposes_a_point_twice_even_on_a_flat_score():
    trials = search(make_proposer("gp", 4), 25, seed=1, score=lambda values: 3.0)
    units = np.array([[v / 0.3 for v in trial.values] for trial in trials])
    distances = np.abs(units[:, None] - units[None]).max(axis=2) + np.eye(len(units))
    assert distances.min() > 1e-3


@pytest.mark.slow
def test_it_finds_the_lowest_step_that_the_design_alone_misses():
    lowest = [min(trial.score for trial in search(make_proposer("gp", 6), 18, seed=seed)) for seed in range(4)]
    design = [min(steps(design_point(SPACE, index, seed)) for index in range(18)) for seed in range(4)]
    assert np.mean(lowest) < np.mean(design)
    assert max(lowest) <= 1


def test_a_failed_trial_keeps_the_search_away():
    """Everything beyond 0.15 s fails; the search goes there less than the design would."""
    trials = search(make_proposer("gp", 6), 20, seed=1, score=lambda v: None if v[0] > 0.15 else steps(v))
    beyond = [trial.values[0] > 0.15 for trial in trials]
    assert sum(beyond[6:]) < 14 / 3


@pytest.mark.parametrize("seed", [0, 2**53])
def test_any_seed_of_a_study_can_be_used(seed):
    assert search(make_proposer("gp", 3), 5, seed)[4].score >= 0
