"""The engine that learns from every output finds the θ that made the target, and looks nowhere twice."""

import numpy as np
import pytest
from steps import SPACE, WHOLE, goal, search, whole

from proxytune.search import Trial, from_unit, make_proposer, propose_batch, to_unit, with_failures_as_worst
from proxytune.search.engine import design_point
from proxytune.search.likelihood import fit_outputs
from proxytune.search.outcomes import Composite, Outcomes, composed_scores
from proxytune.space import Interval, Space


def needle(outcomes):
    """0 within a small box around (0.1, 0.1), 10 everywhere else: a score alone does not tell where to look."""
    return np.where(np.abs(outcomes - 0.1).max(axis=-1) < 0.01, 0.0, 10.0)


def told(values):
    """A trial whose outcome is smooth: the parameters themselves."""
    return Trial(values, float(needle(np.array(values))), values)


def test_it_finds_what_the_score_alone_does_not_show_by_draws_that_agree_with_outcomes_and_failed_ones():
    for seed in range(3):
        trials = [told(design_point(SPACE, index, seed)) for index in range(10)]
        assert {trial.score for trial in trials} == {10.0}
        for _ in range(3):
            trials.append(told(Composite(goal(needle, (0.1, 0.1))).propose(SPACE, trials, seed)))
        assert min(trial.score for trial in trials) == 0.0
    trials = [Trial((0.1, 0.0), 3.0, (1.0,)), Trial((0.2, 0.0), None), Trial((0.3, 0.0), 8.0, (2.0,))]
    counted = [(trial.score, trial.outcome) for trial in with_failures_as_worst(trials)]
    assert counted == [(3.0, (1.0,)), (8.0, (2.0,)), (8.0, (2.0,))]
    trials = search(make_proposer("sobol", 6), 6, 1)
    more = [Trial(trial.values, trial.score, (*trial.outcome, 60.0)) for trial in trials]
    plain, with_constant = Composite(WHOLE), Composite(goal(whole, (0.0, 60.0)))
    assert with_constant.propose(SPACE, more, 1) == pytest.approx(plain.propose(SPACE, trials, 1), abs=0.1)
    visited = np.random.default_rng(1).uniform(0.0, 0.4, (30, 2))
    box = Space((Interval("delay", 0.0, 1.0), Interval("trim", 0.0, 1.0)))
    known = [Trial((a, b), 0.0, (100.0 + a, b)) for a, b in visited.tolist()]
    scores = composed_scores(fit_outputs(box, known), goal(whole, (100.0, 0.0)), 1)
    assert np.allclose(scores(visited).mean(axis=0), 100.0 + visited[:, 0], atol=0.02)
    near, far = scores(np.array([[0.2, 0.2], [1.0, 1.0]])).std(axis=0)
    assert 5 * near < far


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
    proposer, trials = make_proposer(engine, 6, goal(flips(truth), outputs(truth), 1e-4)), []
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
def test_what_is_proposed_together_is_spread():
    truth = (0.1, 0.1)
    target = goal(flips(truth), outputs(truth), 1e-4)
    points = [design_point(SPACE, index, 1) for index in range(8)]
    trials = [Trial(p, float(flips(truth)(outputs(p))), tuple(outputs(p).tolist())) for p in points]
    together = propose_batch(Outcomes(target), SPACE, trials, 1, 4)
    assert len(set(together)) == 4
    alone = [Outcomes(target).propose(SPACE, [*trials, *[trials[0]] * row], 1) for row in (0, 1)]
    assert together[0] == alone[0]


@pytest.mark.parametrize("count", [6, pytest.param(7, marks=pytest.mark.slow)])
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
