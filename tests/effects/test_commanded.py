"""Curves over commands: each sees what its group says, whatever a signal is cut into."""

import numpy as np
import pytest

from proxytune.driving import read_robot
from proxytune.effects import COMMAND_GROUPS, FilterContext, LearntCommands, LearntCurve
from proxytune.testing.effect import Subject, _claim_chunks, _claim_filter

ROBOT = read_robot("duckiebot")
RATE_HZ = 20.0
KNOTS = {
    "duty": (0.2, 0.5, 1.0),
    "drawn": (0.5, 1.0, 2.0),
    "held": (0.3, 1.0),
    "begun": (0.15, 0.4),
    "turned": (0.2, 0.5),
    "dragged": (0.05, 0.2),
    "ended": (0.1, 0.4),
    "ramped": ((0.0, 0.3), (0.6, 0.0), (0.6, 1.2)),
}


def effect_of(*groups):
    random = np.random.default_rng(3)
    return LearntCommands(
        tuple(
            LearntCurve(group, channel, KNOTS[group], tuple(random.uniform(0.1, 0.3, len(KNOTS[group]))))
            for group in groups
            for channel in COMMAND_GROUPS[group].channels
        )
    )


EFFECTS = [pytest.param(effect_of(group), id=group) for group in COMMAND_GROUPS]
EFFECTS.append(pytest.param(effect_of(*COMMAND_GROUPS), id="all"))


def commands(seed, length=90):
    """Held, reversed, ended and begun again."""
    return np.repeat(np.random.default_rng(seed).choice((-0.7, -0.3, 0.0, 0.0, 0.4, 0.9), (length // 9, 2)), 9, axis=0)


def run(effect, signal):
    return effect.apply(signal, effect.begin(FilterContext(RATE_HZ, np.zeros(2), ROBOT.figures)))[0]


def added(curve, signal):
    return run(LearntCommands((curve,)), signal) - signal


@pytest.mark.parametrize("effect", EFFECTS)
def test_every_group_changes_commands_but_leaves_a_robot_that_was_never_commanded_alone(effect):
    assert np.abs(run(effect, commands(1)) - commands(1)).max() > 1e-3
    np.testing.assert_array_equal(run(effect, np.zeros((200, 2))), 0.0)


class Commanded(Subject):
    """The robot that is told something here, for what every effect promises."""

    def signal(self, seed, length=90):
        return commands(seed, length)


@pytest.mark.parametrize("effect", EFFECTS)
def test_it_is_a_filter_like_any_other(effect):
    subject = Commanded(LearntCommands, ROBOT, "learnt")
    _claim_filter(subject, effect, "learnt")
    _claim_chunks(subject, effect, "learnt")


@pytest.mark.parametrize("group", [group for group in COMMAND_GROUPS if group != "dragged"])
def test_a_robot_that_is_to_stand_for_long_stands(group):
    signal = np.concatenate((commands(5), np.zeros((400, 2))))
    np.testing.assert_allclose(run(effect_of(group), signal)[-20:], 0.0, atol=1e-6)


@pytest.mark.parametrize("effect", EFFECTS)
def test_features_times_weights_are_what_is_added(effect):
    signal = commands(6)[None]
    memory = effect.begin(FilterContext(RATE_HZ, np.zeros((1, 2)), ROBOT.figures))
    features = effect.features(signal, memory)
    total = sum(basis @ np.array(curve.weights) for basis, curve in zip(features, effect.curves, strict=True))
    np.testing.assert_allclose(effect.apply(signal, memory)[0] - signal, total, rtol=0, atol=1e-12)


def test_commands_count_by_size_together_or_alone():
    curve = LearntCurve("duty", "duty", (0.4, 0.8), (0.1, -0.1))
    np.testing.assert_allclose(added(curve, np.array([[0.4, -0.4], [0.2, -0.8]])), [[0.1, -0.1], [0.05, 0.1]])
    curve = LearntCurve("drawn", "duty", (1.0,), (-0.5,))
    np.testing.assert_allclose(added(curve, np.array([[0.6, 0.4], [0.5, 0.0]])), [[-0.3, -0.2], [-0.125, 0.0]])


def test_times_of_commands_count_from_changes_starts_and_turns():
    signal = np.tile((0.5, 0.2), (20, 1))
    signal[6:, 1] = 0.3
    stopped = added(LearntCurve("held", "duty", (0.25,), (-1.0,)), signal)[:, 0] != 0.0
    np.testing.assert_array_equal(np.flatnonzero(stopped), [5, *range(11, 20)])

    signal = np.repeat([[0.0, 0.5], [-0.3, 0.5], [0.0, 0.5]], 10, axis=0)
    kicked = added(LearntCurve("begun", "push", (0.2,), (0.6,)), signal)
    np.testing.assert_allclose(kicked[10:13, 0], -0.6)
    assert not kicked[13:, 0].any()
    assert kicked[0, 1] == pytest.approx(0.6)
    assert not kicked[5:, 1].any()

    signal = np.repeat([[0.5, 0.5], [0.0, 0.4], [-0.5, 0.3]], 8, axis=0)
    braked = added(LearntCurve("turned", "duty", (0.2,), (-1.0,)), signal)
    np.testing.assert_allclose(braked[16:20, 0], 0.5)
    assert not braked[20:].any()
    assert not braked[:, 1].any()

    signal = np.repeat([[0.5, 0.5], [0.0, 0.5]], 40, axis=0)
    rolling = added(LearntCurve("ended", "duty", (0.5,), (1.0,)), signal)
    assert not rolling[:40].any()
    assert not rolling[:, 1].any()
    np.testing.assert_allclose(rolling[50, 0] / rolling[40, 0], np.exp(-1.0), rtol=1e-9)


def test_a_sticky_throttle_drags_along_a_command_grows_no_faster_than_its_ramp_and_one_sample_is_no_stop():
    signal = np.repeat([[0.5, 0.0], [0.0, 0.0]], 5, axis=0)
    stuck = added(LearntCurve("dragged", "duty", (0.1,), (1.0,)), signal)
    np.testing.assert_allclose(stuck[:, 0], [-0.1] * 5 + [0.1] * 5)
    assert not stuck[:, 1].any()
    signal = np.repeat([[0.4, 0.4], [0.1, -0.3]], 12, axis=0)
    held = signal + added(LearntCurve("ramped", "duty", ((0.5, 2.0),), (1.0,)), signal)
    np.testing.assert_allclose(held[:5], np.outer([0.1, 0.2, 0.3, 0.4, 0.4], [1.0, 1.0]))
    np.testing.assert_allclose(held[12:17], np.stack((0.4 - 0.025 * np.arange(1, 6), [0.375, 0.35, 0.325, 0.3, 0.2])).T)

    def pushed(between):
        signal = np.concatenate((np.full(9, 0.4), between, np.full(9, -0.4)))
        return added(LearntCurve("begun", "push", (0.3,), (1.0,)), np.stack((signal, signal), axis=1))[:, 0]

    assert not pushed([0.0])[9:].any()
    assert pushed([0.0, 0.0])[11:].any()
