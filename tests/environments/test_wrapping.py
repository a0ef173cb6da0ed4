"""Our effects round an environment: what they do to actions and observations, and that neutral ones do nothing."""

import numpy as np
import pytest

pytest.importorskip("gymnasium")

from hypothesis import given
from hypothesis import strategies as st
from toy_families import CART, SCREEN, family

from proxytune.domain import make_episode
from proxytune.effects import effects_from
from proxytune.environments.actuators import Actuators
from proxytune.environments.sensors import Sensors
from proxytune.environments.signals import figures
from proxytune.environments.spaces import Spaces


def spaces(low=(-1.0, -1.0), high=(1.0, 1.0), picture=None):
    return Spaces(low, high, "", picture, "", "", 10.0, 5, ())


def passed_on(known, theta, actions, dtype=np.float64):
    actuators = Actuators(effects_from(theta, figures(known)), known, 1)
    return np.array([actuators.pass_on(np.array(action, dtype)) for action in actions])


@given(st.integers(1, 4), st.integers(0, 2**32 - 1))
def test_a_delay_of_whole_steps_shifts_any_number_of_actions(count, seed):
    actions = np.random.default_rng(seed).uniform(-2.0, 2.0, (6, count))
    late = passed_on(spaces((-2.0,) * count, (2.0,) * count), {"delay": 0.2}, actions)
    assert (late[:2] == 0.0).all()
    assert late[2:] == pytest.approx(actions[:-2])


@given(st.integers(1, 4), st.integers(0, 2**32 - 1))
def test_effects_at_neutral_pass_actions_on(count, seed):
    actions = np.random.default_rng(seed).uniform(-2.0, 2.0, (6, count))
    neutral = {"delay": 0.0, "dead_band.width": 0.0, "motor_lag.time_constant": 0.0, "saturation.limit": 1.0}
    assert passed_on(spaces((-2.0,) * count, (2.0,) * count), neutral, actions) == pytest.approx(actions)


def test_a_dead_band_is_a_share_of_the_largest_action_each_by_itself():
    known = spaces((-2.0, 0.0, -1.0), (2.0, 0.5, 4.0))
    bent = passed_on(known, {"dead_band.width": 0.1}, [[1.0, 0.04, -1.0], [-2.0, 0.5, 4.0]])
    assert bent == pytest.approx(np.array([[0.8, 0.0, -0.6], [-1.8, 0.45, 3.6]]))


def test_of_two_actions_the_first_is_the_left_wheel_s():
    bent = passed_on(spaces(), {"trim": 0.1, "dead_band.width": 0.1, "dead_band.imbalance": 1.0}, [[0.5, 0.5]])
    assert bent == pytest.approx(np.array([[0.5 * 0.9, 0.3 * 1.1]]))


def test_actions_keep_their_type_and_bounds():
    bent = passed_on(spaces(), {"wheel_gain.left": 1.5}, [[1.0, 0.2]], np.float32)
    assert bent.dtype == np.float32
    assert bent.tolist() == [[1.0, np.float32(0.2)]]


def test_whole_actions_are_rounded_to_the_nearest_ones():
    known = spaces(low=(-10, -10), high=(10, 10))
    bent = passed_on(known, {"trim": 0.04}, [np.array([10, 10]), np.array([-7, -7])], np.int64)
    exact = passed_on(known, {"trim": 0.04}, [np.array([10, 10]), np.array([-7, -7])])
    assert np.array_equal(bent, np.rint(exact))
    assert not np.array_equal(bent, np.trunc(exact))


def test_without_effects_an_action_goes_through_untouched():
    action = np.array([0.1, 0.2], np.float32)
    assert Actuators((), spaces(), 1).pass_on(action) is action


def test_a_picture_is_blurred_over_its_past_and_stays_a_picture():
    known = spaces(picture=(4, 5))
    sensors = Sensors(effects_from({"blur": 0.1}, figures(known)), known, None, 1)
    dark, light = np.zeros((4, 5, 3), np.uint8), np.full((4, 5, 3), 200, np.uint8)
    assert (sensors.show(dark) == 0).all()
    seen = sensors.show(light)
    assert seen.dtype == np.uint8
    assert (seen == 100).all()
    assert (sensors.show(light) == 200).all()


def test_a_heading_offset_turns_the_stated_entry_alone_and_copies_the_observation():
    sensors = Sensors(effects_from({"heading_offset": 90.0 / 2}, {}), spaces(), (1, 2, 0), 1)
    observation = np.array([0.1, 2.0, 3.0, 7.0], np.float32)
    seen = sensors.show(observation)
    assert seen == pytest.approx([0.1 + np.pi / 4, 2.0, 3.0, 7.0])
    assert seen.dtype == np.float32
    assert observation[0] == np.float32(0.1)


def test_an_agent_sees_what_the_effects_make_of_a_picture(tmp_path):
    kin = family(tmp_path, SCREEN)

    def score(**theta):
        return kin.run(make_episode(theta, agent="toys:left_of_middle", start=0, seed=1))["return"]

    assert score() >= 4.0
    assert score(camera_latency=0.3) < score(), "it steers by where the stripe was"


def test_measurement_effects_change_what_the_agent_sees_and_not_what_it_is_scored_on(tmp_path):
    kin = family(tmp_path, CART + "[state]\nx = 1\ny = 2\nheading = 0\n")

    def score(agent, **theta):
        return kin.run(make_episode(theta, agent=agent, start=0, seed=1))

    assert score("toys:ahead", heading_offset=30.0) == score("toys:ahead")
    assert score("toys:homeward", heading_offset=30.0) != score("toys:homeward")
