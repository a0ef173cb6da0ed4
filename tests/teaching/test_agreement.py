"""Two rankings agree as far as their draws do, and pairs count as contrary only where both orders are sure."""

import numpy as np
import pytest

from proxytune.teaching.agreement import agreement

NAMES = ("low", "middle", "high")
SURE = np.tile([1.0, 2.0, 3.0], (200, 1))


def noisy(spread, seed):
    return SURE + spread * np.random.default_rng(seed).normal(size=SURE.shape)


def test_the_same_ranking_is_1_and_its_reverse_minus_1():
    assert agreement(NAMES, SURE, 10.0 * SURE).tau == 1.0
    assert agreement(NAMES, SURE, -SURE).tau == -1.0


def test_a_pair_of_contrary_order_is_named_with_who_is_ahead_by_the_second_figure_first():
    found = agreement(NAMES, SURE, np.tile([1.0, 3.0, 2.0], (200, 1)))
    assert found.reversed == (("middle", "high"),)
    assert found.tau == pytest.approx(1.0 / 3.0)


def test_where_an_order_is_open_no_pair_is_contrary_and_the_interval_is_wide():
    found = agreement(NAMES, noisy(3.0, 1), -noisy(3.0, 2))
    assert found.reversed == ()
    assert found.low < found.tau < found.high
    assert found.high - found.low > 1.0


def test_tied_proxies_count_for_neither_order():
    found = agreement(NAMES, SURE, np.tile([1.0, 2.0, 2.0], (200, 1)))
    assert found.tau == pytest.approx(2.0 / np.sqrt(3.0 * 2.0))
    assert agreement(NAMES, SURE, np.full_like(SURE, -np.inf)).tau == 0.0


def test_what_was_not_reached_is_behind_all_that_was():
    unreached = SURE.copy()
    unreached[:, 2] = -np.inf
    assert agreement(NAMES, SURE, unreached).reversed == (("low", "high"), ("middle", "high"))
