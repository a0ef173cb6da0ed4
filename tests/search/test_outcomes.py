"""The engine that learns from every output finds the θ that made the target, and looks nowhere twice."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from steps import SPACE, WHOLE, goal, search

from proxytune.errors import InputError
from proxytune.search.design import design_point, from_unit, to_unit
from proxytune.search.engines.outcomes import Outcomes
from proxytune.search.engines.registry import make_proposer
from proxytune.search.proposer import Trial, propose_batch

FAKES = Path(__file__).parent.parent / "fakes"
AGENTS = np.random.default_rng(3).uniform(1.0, 5.0, (10, 2))


def outputs(values):
    return np.sin(AGENTS @ to_unit(SPACE, values))


def flips(values):
    """Pairs of agents that are ranked unlike what ranks them on the target."""
    return lambda found: np.sum(np.sign(found[..., :, None] - found[..., None, :]) != ranks(values), axis=(-1, -2))


def ranks(values):
    target = outputs(values)
    return np.sign(target[:, None] - target[None, :])


def searched(engine, seed, budget=14):
    truth = from_unit(SPACE, np.random.default_rng(seed).uniform(0.2, 0.8, 2))
    target = goal(flips(truth), outputs(truth), 1e-4)
    proposer, trials = make_proposer(engine, 6, target), []
    for _ in range(budget):
        values = proposer.propose(SPACE, trials, seed)
        trials.append(Trial(values, float(flips(truth)(outputs(values))), tuple(outputs(values).tolist())))
    away = [np.abs(to_unit(SPACE, t.values) - to_unit(SPACE, truth)).mean() for t in trials]
    return min(away[6:]), min(trial.score for trial in trials)


@pytest.mark.slow
def test_it_comes_nearer_to_the_truth_than_the_engine_of_the_score_alone():
    ours, other = (np.array([searched(engine, seed) for seed in range(8)]) for engine in ("outcomes", "gp"))
    assert np.median(ours[:, 0]) < 0.02 < np.median(other[:, 0])
    assert ours[:, 1].mean() <= other[:, 1].mean()


@pytest.mark.slow
def test_another_process_with_other_threads_proposes_the_same_to_the_last_bit():
    for count in (8, 9):  # a draw, and an expected improvement
        trials = search(make_proposer("outcomes", 5, WHOLE), count, seed=4)
        code = (
            f"import sys; sys.path.append({str(FAKES)!r})\n"
            "from steps import WHOLE\n"
            "from proxytune.search.engines.outcomes import Outcomes\n"
            "from proxytune.search.proposer import Trial\n"
            "from proxytune.space import Interval, Space\n"
            f"print(repr(Outcomes(WHOLE).propose({SPACE!r}, {trials!r}, 4)))"
        )
        environment = {**os.environ, "OMP_NUM_THREADS": "2", "OPENBLAS_NUM_THREADS": "2", "PYTHONHASHSEED": "7"}
        told = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=True)
        assert told.stdout.strip() == repr(Outcomes(WHOLE).propose(SPACE, trials, 4))


def test_what_is_proposed_together_is_spread():
    truth = (0.1, 0.1)
    target = goal(flips(truth), outputs(truth), 1e-4)
    points = [design_point(SPACE, index, 1) for index in range(8)]
    trials = [Trial(p, float(flips(truth)(outputs(p))), tuple(outputs(p).tolist())) for p in points]
    together = propose_batch(Outcomes(target), SPACE, trials, 1, 4)
    assert len(set(together)) == 4
    alone = [Outcomes(target).propose(SPACE, [*trials, *[trials[0]] * row], 1) for row in (0, 1)]
    assert together[0] == alone[0]


@pytest.mark.parametrize("count", [6, 7])
def test_a_trial_that_was_cut_off_tells_what_it_has(count):
    truth = (0.1, 0.1)
    target = goal(flips(truth), outputs(truth), 0.05)
    points = [design_point(SPACE, index, 1) for index in range(count)]
    trials = [Trial(p, 5.0, tuple(outputs(p).tolist())) for p in points]
    part = np.array(trials[-1].outcome)
    part[5:] = np.nan
    cut = [*trials[:-1], Trial(points[-1], 9.0, tuple(part.tolist()))]
    without = [*trials[:-1], Trial(points[-1], 9.0)]
    found = [[Outcomes(target).propose(SPACE, told, seed) for seed in range(6)] for told in (cut, without)]
    assert found[0] != found[1]


def test_where_a_score_has_no_parts_the_engine_is_refused():
    with pytest.raises(InputError, match="'outcomes' models what a score is computed from"):
        make_proposer("outcomes", 3)
