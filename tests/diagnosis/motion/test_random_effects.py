"""Lost and jittering commands are found with their sizes, and clean drives have none."""

from dataclasses import replace

import numpy as np
import pytest
from own_times import own_times_log
from planted import TRUTH, drives_of, fitted, planted_drives

from proxytune.diagnosis import RANDOM_EFFECTS
from proxytune.diagnosis.motion import random_effects as drawing
from proxytune.diagnosis.motion.random_effects import _mixture, infer_size_indirectly, random_effects, responses

SHORT = {"episodes": 4, "seconds": 25.0}


def ratio(effect, size, pull, energy):
    """The log-likelihood ratio of each command, one command per second."""
    return _mixture(RANDOM_EFFECTS[effect].lateness(size, 1.0), pull, energy)


def weighed(theta, seed=1):
    effects = random_effects(fitted(planted_drives({**TRUTH, **theta}, seed=seed, **SHORT)), 1)
    return {effect.effect: effect for effect in effects}


@pytest.fixture(scope="module")
def lost():
    return weighed({"dropped_commands": 0.3})


@pytest.fixture(scope="module")
def late():
    return weighed({"delay_jitter": 0.15})


def test_lost_and_late_commands_are_found_with_their_sizes(lost, late):
    found = lost["dropped_commands"]
    assert found.gain > 30.0
    assert found.p_value <= 0.01
    assert found.gain > lost["delay_jitter"].gain
    assert 0.1 < found.value < 0.5
    found = late["delay_jitter"]
    assert found.gain > 15.0
    assert found.p_value <= 0.01
    assert 0.07 < found.value < 0.3
    assert lost["dropped_commands"].left < 1.5
    assert late["delay_jitter"].left < 1.5


@pytest.mark.parametrize("seed", [3, pytest.param(4, marks=pytest.mark.slow)])
def test_clean_drives_have_neither(seed):
    for found in weighed({}, seed).values():
        assert found.gain < 10.0


def answers(base):
    return responses(base, np.random.default_rng(1).standard_normal((len(base.innovations), 1)))


def test_commands_that_never_change_or_a_model_that_explains_all_show_no_random_effect():
    base = fitted(planted_drives(TRUTH, episodes=2, seconds=10.0, noise=None))
    found = answers(base)
    assert np.median(np.abs(found.gradient) / found.size) < 0.1
    drives = planted_drives(TRUTH, episodes=2, seconds=10.0)
    base = fitted(replace(drives, duties=np.full_like(drives.duties, 0.4), rest=np.full_like(drives.rest, 0.4)))
    assert len(answers(base).size) == 0
    assert random_effects(base, 1) == ()


@pytest.mark.parametrize(
    ("effect", "size"),
    [("dropped_commands", 0.05), ("dropped_commands", 0.2), ("delay_jitter", 0.3), ("delay_jitter", 2.0)],
)
def test_mean_lateness_speaks_for_nothing_since_the_delay_has_it_already(effect, size):
    said = ratio(effect, size, np.array([-1e-4, 0.0, 1e-4]), np.zeros(3))
    np.testing.assert_allclose(said - said[1], 0.0, atol=2e-6)
    assert said[1] == pytest.approx(0.0, abs=1e-3)


@pytest.mark.parametrize(("effect", "size"), [("dropped_commands", 0.2), ("delay_jitter", 1.5)])
def test_what_points_against_a_loss_of_no_consequence_costs(effect, size):
    gains = ratio(effect, size, np.array([-8.0, 0.0, 0.0]), np.array([8.0, 8.0, 1e-9]))
    assert gains[0] > 1.0
    assert gains[1] < 0.0
    assert gains[2] == pytest.approx(0.0, abs=1e-3)


def test_the_times_are_weighed_as_their_likelihoods_add_up_however_far_apart_they_are():
    late = RANDOM_EFFECTS["dropped_commands"].lateness(0.2, 1.0)
    pull, energy = np.array([-900.0, 0.3, 900.0]), np.array([1.0, 2.0, 40.0])
    each = [w - k * pull - 0.5 * k**2 * energy for k, w in zip(late.commands, late.log_weights, strict=True)]
    np.testing.assert_allclose(_mixture(late, pull, energy), np.logaddexp.reduce(each, axis=0), rtol=1e-12)


@pytest.mark.slow
@pytest.mark.parametrize("seed", [1, 2])
def test_commands_at_times_of_their_own_are_no_jitter_of_the_robot_but_on_a_grid_they_look_like_it(seed):
    gains = {}
    for gridded in (False, True):
        log = own_times_log(seed, episodes=4, seconds=30.0, gridded=gridded)
        found = {effect.effect: effect for effect in random_effects(fitted(drives_of(log)), 1)}
        gains[gridded] = found["delay_jitter"].gain
    assert gains[False] < 5.0
    assert gains[True] > 30.0


def told(effect, size, seed):
    """What is told of an effect at first, and in the end."""
    base = fitted(planted_drives({**TRUTH, effect: size}, seed=seed, episodes=6, seconds=30.0))
    (first,) = [one for one in random_effects(base, 1) if one.effect == effect]
    return first, infer_size_indirectly(base, first, 1)


@pytest.mark.slow
@pytest.mark.parametrize(("effect", "size"), [("dropped_commands", 0.3), ("delay_jitter", 0.15)])
def test_intervals_hold_the_true_size(effect, size):
    found = [told(effect, size, seed)[1] for seed in (1, 2, 3)]
    assert sum(one.interval[0] <= size <= one.interval[1] for one in found) >= 2
    for one in found:
        assert one.value == pytest.approx(size, rel=0.35)
        assert one.interval[0] < one.value < one.interval[1]
        assert one.interval[1] < 4.0 * one.interval[0]


def test_the_size_is_that_of_which_drives_say_what_is_measured_and_what_pulls_both_ways_is_left_over():
    sizes = np.array([0.1, 0.2, 0.4])
    said = np.log(0.5 * sizes) + np.array([[-0.05], [0.05]])
    value, low, high = drawing._invert(sizes, said, float(np.log(0.1)))
    assert value == pytest.approx(0.2)
    assert 0.1 < low < 0.2 < high < 0.4
    # All lost once leaves nothing; pulls of as much to either side leave those that are early.
    late, energy = RANDOM_EFFECTS["dropped_commands"].lateness(0.3, 10.0), np.full(50, 100.0)
    lost_once = -late.commands[1] * energy
    assert drawing._left(late, lost_once, energy) == pytest.approx(0.0, abs=1e-9)
    both = 8.0 * np.where(np.arange(50) % 2 == 0, lost_once, -lost_once)
    assert drawing._left(late, both, energy) > 2.0
    assert drawing._left(late, both, energy / 1000.0) == 0.0  # commands that nobody could see
