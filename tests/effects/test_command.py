"""Commands that come late by chance or get lost, against what their draws say by hand."""

import numpy as np
import pytest
from filtered import filtered

from proxytune.effects.command import DelayJitter, DroppedCommands, Messages

RATE_HZ = 60.0
EVERY = 3
NOMINAL = {"control_rate": RATE_HZ / EVERY}
SEED = 11


def run(effect, signal, rate_hz=RATE_HZ, seed=SEED):
    return filtered(effect, signal, rate_hz=rate_hz, rest=-1.0, nominal=NOMINAL, seed=seed)


def numbered(count, every=EVERY):
    """Message 0 says 0, message 1 says 1, …; before them the robot was told −1."""
    return np.repeat(np.arange(float(count))[:, None], every, axis=0) * np.ones(2)


def draws(count):
    return Messages(1 / EVERY, SEED).draws(0, count)


@pytest.mark.parametrize(("per_sample", "expected"), [(1 / 3, [0, 0, 0, 1]), (0.4, [0, 0, 0, 1]), (1.0, [0, 1, 2, 3])])
def test_samples_belong_to_the_message_that_was_sent_last(per_sample, expected):
    assert Messages(per_sample, 0).numbers(np.arange(4)).tolist() == expected


@pytest.mark.parametrize("per_sample", [1 / 3, 1 / 7, 1 / 49, 0.4, 20 / 66, 1.0])
def test_a_message_starts_with_the_first_sample_that_belongs_to_it(per_sample):
    sent = Messages(per_sample, 0)
    firsts = np.flatnonzero(np.diff(sent.numbers(np.arange(30000)), prepend=-1))
    np.testing.assert_array_equal(sent.starts(np.arange(len(firsts))), firsts)


def test_draws_do_not_depend_on_where_one_looks_jitter_is_continuous_and_a_lost_command_leaves_the_last():
    sent = Messages(1.0, SEED)
    np.testing.assert_array_equal(sent.draws(0, 1000)[200:900], sent.draws(200, 900))
    assert np.abs(np.sort(sent.draws(0, 1000)) - np.linspace(0, 1, 1000)).max() < 0.05
    coarse = run(DroppedCommands(0.4), numbered(200, 1), rate_hz=NOMINAL["control_rate"])
    np.testing.assert_array_equal(run(DroppedCommands(0.4), numbered(200))[::EVERY], coarse)
    signal = np.repeat(np.random.default_rng(0).uniform(-1, 1, (40, 2)), EVERY, axis=0)
    outputs = np.array([run(DelayJitter(value), signal) for value in np.linspace(0.0, 0.3, 601)])
    assert np.abs(np.diff(outputs, axis=0)).max() < 2 * 0.0005 * RATE_HZ + 1e-9
    probability, said, expected = 0.4, -1.0, []
    for number, draw in enumerate(draws(300)):
        said = said if draw < probability else float(number)
        expected += [said] * EVERY
    np.testing.assert_array_equal(run(DroppedCommands(probability), numbered(300))[:, 1], expected)


def by_hand(spread_s, count, fine=200):
    """Which message is in force, on a time grid so fine that its mean over a sample is good to 1/200 of a message."""
    times = (np.arange(count * EVERY * fine) + 0.5) / (RATE_HZ * fine)
    arrivals, latest = [], 0.0
    for number, draw in enumerate(draws(count)):
        latest = max(latest, number * EVERY / RATE_HZ + spread_s * draw)
        arrivals.append(latest)
    return (np.searchsorted(arrivals, times) - 1.0).reshape(-1, fine).mean(axis=1)


@pytest.mark.parametrize("spread", [0.01, 0.05, 0.12, 0.3])
def test_a_jittered_command_holds_from_its_arrival_to_the_next_ones(spread):
    jittered = run(DelayJitter(spread), numbered(60))
    np.testing.assert_allclose(jittered[:, 0], by_hand(spread, 60), atol=0.05)
    np.testing.assert_array_equal(jittered[:, 0], jittered[:, 1])
