"""Engines that are only compared keep what engines promise, where their library is installed."""

import numpy as np
import pytest
from compared_engines import NAMES, PEERS, engine_of, why_not
from emulator import log_likelihood, most_probable
from one_line import complaint_of
from steps import SPACE, WHOLE, goal, search, steps

from proxytune.search import ENGINE_NAMES as STUDY_ENGINES, Trial, engine_code, make_proposer, to_unit, unit_points
from proxytune.testing import check_engine

pytestmark = pytest.mark.slow
HERE = [
    pytest.param(engine, id=engine.name, marks=pytest.mark.skipif(bool(why), reason=f"{why} "))
    for engine in PEERS
    for why in [why_not(engine.name, composed=True)]
]
FROM_SCORES, FROM_OUTPUTS = ([e for e in HERE if engine_of(e.id).learns_from == what] for what in ("scores", "outputs"))


@pytest.mark.parametrize("engine", HERE)
def test_a_peer_keeps_what_engines_promise(engine):
    check_engine(engine)


@pytest.mark.parametrize("engine", FROM_SCORES)
def test_a_peer_learns_from_the_scores_and_says_nothing(engine, capfd):
    low, high = (search(make_proposer(engine, 4), 10, 1, score) for score in (steps, lambda v: -steps(v)))
    assert sum(steps(trial.values) for trial in low[4:]) < sum(steps(trial.values) for trial in high[4:])
    assert capfd.readouterr() == ("", "")


TRUE = (0.2, -0.1)


def reached(values):
    """An output for each parameter, one that no score depends on, and one that the first trials do not know."""
    return (10.0 * values[0], values[1] ** 3, values[0] - values[1], values[0] if values[1] < 0.0 else np.nan)


def far(outcomes):
    """A score with steps of the first two outputs, lowest where they are the target's."""
    away = np.abs(outcomes[..., :2] - np.array(reached(TRUE))[:2]) * np.array([1.0, 100.0])
    return np.floor(5.0 * away.sum(axis=-1))


@pytest.mark.parametrize("engine", FROM_OUTPUTS)
def test_a_peer_that_learns_from_outputs_comes_to_where_they_are_the_targets_and_says_nothing(engine, capfd):
    proposer, trials = make_proposer(engine, 5, goal(far, reached(TRUE), 1e-6)), []
    for _ in range(11):
        values = proposer.propose(SPACE, trials, 1)
        trials.append(Trial(values, float(far(np.array(reached(values)))), reached(values)))
    errors = [np.abs(to_unit(SPACE, trial.values) - to_unit(SPACE, TRUE)).max() for trial in trials]
    assert min(errors[5:]) < 0.06 < min(errors[:5])
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize("engine", FROM_OUTPUTS)
def test_a_peer_that_learns_from_outputs_is_refused_where_a_score_has_no_parts(engine):
    assert "models what a score is computed from" in why_not(engine.name, composed=False)


def test_the_chains_of_the_emulator_find_a_narrow_peak_and_stay_in_the_box():
    for peak in (np.array([0.31, 0.77]), np.array([0.0, 1.0])):
        found = most_probable(lambda points, peak=peak: -1e4 * ((points - peak) ** 2).sum(axis=1), 2, 3)
        assert np.abs(found - peak).max() < 0.005
        assert ((found >= 0.0) & (found <= 1.0)).all()


def test_the_emulator_counts_outputs_that_err_together_once():
    unit = unit_points(1, 12, 1)
    output = np.sin(9.0 * unit) + 0.2 * np.random.default_rng(1).normal(size=unit.shape)
    points, several = np.array([[0.2], [0.5]]), np.tile(output, 6)
    one, six = (
        np.ptp(log_likelihood(unit, outputs, goal(far, [0.3] * outputs.shape[1], 0.01))(points))
        for outputs in (output, several)
    )
    assert six == pytest.approx(one, rel=0.2)


@pytest.mark.parametrize("engine", [one for one in HERE if one.id not in ("skopt", "emulator")])
def test_a_peer_leaves_the_threads_and_the_random_numbers_of_pytorch_as_they_were(engine):
    import torch

    before = torch.get_num_threads(), torch.random.get_rng_state()
    search(make_proposer(engine, 3, WHOLE), 4, 1)
    assert torch.get_num_threads() == before[0]
    if engine.name != "gpsampler":
        assert torch.equal(torch.random.get_rng_state(), before[1])


def test_no_study_may_name_a_peer_and_each_is_found_by_its_name_and_digested():
    names = [engine.name for engine in PEERS]
    assert not set(names) & set(STUDY_ENGINES)
    assert [engine_of(name) for name in names] == list(PEERS)
    assert not any(engine.in_studies for engine in PEERS)
    assert all(engine_code(engine) != engine_code("gp") for engine in PEERS)
    assert set(NAMES) == {*names, *STUDY_ENGINES}
    assert "unknown engine 'skop'" in complaint_of(engine_of, "skop")
