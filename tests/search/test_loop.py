"""Several points proposed together, while none of them is finished."""

import pytest
from hypothesis import given, strategies as st
from steps import SPACE, WHOLE, search, steps

from proxytune.search import ENGINE_NAMES, Trial, batch_at, propose_batch, with_failures_as_worst
from proxytune.search.engine import design_point
from proxytune.search.registry import AfterDesign, make_proposer, why_not
from proxytune.search.surrogate import GaussianProcess

HERE = [name for name in ENGINE_NAMES if not why_not(name, composed=True)]


@given(st.integers(0, 200), st.integers(1, 20), st.integers(1, 30))
def test_batches_are_whole_but_for_the_last_of_the_design_and_none_is_of_both(index, size, initial):
    batch = batch_at(index, size, initial)
    assert index in batch
    assert all(batch_at(other, size, initial) == batch for other in batch)
    assert len(batch) == size or (batch.stop == initial and len(batch) == initial % size)
    assert batch.stop <= initial or batch.start >= initial
    assert batch.start == 0 or batch_at(batch.start - 1, size, initial).stop == batch.start


def test_the_design_makes_batches_of_its_own_and_pending_trials_have_not_failed():
    assert [list(batch_at(index, 3, 5)) for index in (0, 4, 5, 8)] == [[0, 1, 2], [3, 4], [5, 6, 7], [8, 9, 10]]
    assert [list(batch_at(index, 1, 5)) for index in range(7)] == [[index] for index in range(7)]
    trials = [Trial((0.1, 0.0), 3.0), Trial((0.2, 0.0), None), Trial((0.3, 0.0), None, pending=True)]
    assert [trial.score for trial in with_failures_as_worst(trials)] == [3.0, 3.0, None]


@pytest.mark.parametrize("engine", HERE)
def test_the_points_of_a_batch_all_differ_and_a_smaller_batch_begins_as_a_larger_one(engine):
    proposer = make_proposer(engine, 3, WHOLE)
    finished = search(proposer, 6, seed=2)
    batch = propose_batch(proposer, SPACE, finished, 2, 4)
    assert len({*batch, *(trial.values for trial in finished)}) == 4 + 6
    assert batch[:2] == propose_batch(proposer, SPACE, finished, 2, 2)
    assert batch[0] == proposer.propose(SPACE, finished, 2)


@pytest.mark.parametrize("engine", HERE)
def test_a_batch_of_the_design_is_the_design_also_while_all_has_failed(engine):
    proposer = make_proposer(engine, 6, WHOLE)
    assert propose_batch(proposer, SPACE, [], 4, 6) == tuple(design_point(SPACE, index, 4) for index in range(6))
    failed = [Trial(design_point(SPACE, index, 4), None) for index in range(6)]
    assert propose_batch(proposer, SPACE, failed, 4, 2) == tuple(design_point(SPACE, 6 + more, 4) for more in range(2))


def test_an_engine_that_says_the_same_again_has_the_design_go_on_in_its_place():
    class Stubborn:
        def propose(self, space, trials, seed):
            return (0.1, 0.1)

    batch = propose_batch(AfterDesign(Stubborn(), 1), SPACE, [Trial((0.2, 0.2), 1.0)], 3, 3)
    assert batch == ((0.1, 0.1), design_point(SPACE, 2, 3), design_point(SPACE, 3, 3))
    visited = [Trial((0.1, 0.1), 1.0)]
    assert propose_batch(AfterDesign(Stubborn(), 1), SPACE, visited, 3, 1) == ((0.1, 0.1),), "what is finished may be"


@pytest.mark.parametrize("engine", [name for name in ("gp", "tpe") if name in HERE])
def test_an_engine_that_learns_looks_elsewhere_than_at_what_is_pending(engine):
    """What it draws is the same whatever is pending, so it would propose the same again if it did not mind."""
    inner = make_proposer(engine, 4).inner
    finished = search(make_proposer(engine, 4), 8, seed=5)
    there = Trial(inner.propose(SPACE, [*finished, Trial((0.29, -0.29), None, pending=True)], 5), None, pending=True)
    assert inner.propose(SPACE, [*finished, there], 5) != there.values


def test_the_gaussian_process_believes_the_posterior_mean_whatever_the_order_of_what_is_pending():
    finished = [Trial(design_point(SPACE, index, 3), steps(design_point(SPACE, index, 3))) for index in range(8)]
    pending = [Trial(values, None, pending=True) for values in ((0.1, 0.1), (0.12, 0.08), (0.2, -0.1))]
    forth, back = ([*finished, *more] for more in (pending, pending[::-1]))
    assert GaussianProcess().propose(SPACE, forth, 3) == GaussianProcess().propose(SPACE, back, 3)
