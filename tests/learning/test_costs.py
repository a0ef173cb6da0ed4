"""Target samples cost what the expert's driving, the learner's and labels cost; PLV in cost is equation 6."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from proxytune.learning.costs import Costs, cost_saved, split_samples
from proxytune.learning.plv import plv

COSTS = Costs(off_policy=3.0, on_policy=0.5, label=0.25)
counts = st.floats(0.0, 1e6)


@given(counts, counts)
def test_on_policy_and_off_policy_samples_are_all_there_are(count, expert_drives):
    on, off = split_samples(count, expert_drives)
    assert on >= 0.0
    assert 0.0 <= off <= expert_drives
    assert on + off == count or abs(on + off - count) < 1e-9 * count


def test_the_expert_drives_for_the_first_samples():
    on, off = split_samples(np.array([0.0, 10.0, 25.0]), 10.0)
    assert (on.tolist(), off.tolist()) == ([0.0, 0.0, 15.0], [0.0, 10.0, 10.0])


def test_what_is_never_reached_costs_without_end():
    assert split_samples(np.inf, np.inf) == (0.0, np.inf)
    nothing = (0.0, 0.0)
    assert cost_saved(COSTS, without=split_samples(np.array([np.inf, 4.0]), np.inf), with_proxy=nothing).tolist() == [
        np.inf,
        13.0,
    ]
    assert cost_saved(COSTS, without=split_samples(np.inf, 10.0), with_proxy=nothing) == np.inf


def test_what_costs_nothing_adds_nothing_however_many_samples_it_takes():
    free = Costs(off_policy=2.0, on_policy=0.0)
    assert cost_saved(free, without=split_samples(np.inf, 10.0), with_proxy=split_samples(5.0, 0.0)) == 20.0


@given(counts, counts, st.floats(0.0, 1e3))
def test_more_samples_never_cost_less(count, more, expert_drives):
    splits = (split_samples(count + more, expert_drives), split_samples(count, expert_drives))
    assert cost_saved(COSTS, without=splits[0], with_proxy=splits[1]) >= 0.0


def test_a_sample_costs_its_driving_and_its_label():
    assert cost_saved(COSTS, without=split_samples(25.0, 10.0), with_proxy=(0.0, 0.0)) == 10 * 3.25 + 15 * 0.75


@given(counts, counts)
def test_at_equal_costs_without_labels_the_saving_is_plv_itself(without, needed):
    splits = {"without": split_samples(without, 50.0), "with_proxy": split_samples(needed, 0.0)}
    assert abs(cost_saved(Costs(), **splits) - plv(without=without, with_proxy=needed)) < 1e-6


def test_the_saving_is_told_apart_by_who_drove():
    saved = cost_saved(COSTS, without=(np.array(50.0), np.array(400.0)), with_proxy=(np.array(10.0), np.array(100.0)))
    assert saved == 40 * 0.75 + 300 * 3.25
