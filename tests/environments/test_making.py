"""What [domain] of an environment says is read strictly, and our effects round it do what they say."""

import numpy as np
import pytest
from hypothesis import given, strategies as st
from one_line import complaint_of
from toy_families import CART, PENDULUM, SCREEN, domain, family

from proxytune.domain import make_episode
from proxytune.effects import effects_from
from proxytune.environments.making import make_environment, read_domain
from proxytune.environments.signals import Actuators, Sensors, Spaces, figures
from proxytune.errors import InputError
from proxytune.extensions import load

pytest.importorskip("gymnasium")


MASS = "low = 0.5, high = 2.0, neutral = 1.0"


@pytest.mark.parametrize(
    ("text", "line"),
    [
        ("steps = 5", "domain.environment: is missing; add it"),
        (PENDULUM.replace("steps", "step"), "domain.step: unknown key; did you mean 'steps'?"),
        (CART + "[parameters]\nmass = 3", "domain.parameters.mass: must be a table"),
        (CART + f"[parameters]\ndelay = {{ argument = 'a', {MASS} }}", "is the name of an effect's parameter"),
        (CART + f"[parameters]\n'a:b' = {{ argument = 'a', {MASS} }}", "is the name of an effect's parameter"),
        (CART + f"[parameters]\nm = {{ {MASS} }}", "domain.parameters.m: give either argument"),
        (CART + f"[parameters]\nm = {{ argument = 'm', attribute = 'm', {MASS} }}", "m: give either argument"),
        (CART + f"[parameters]\nm = {{ attribute = 'a b', {MASS} }}", "m.attribute: 'a b' must be written unwrapped.m"),
        (CART + "[parameters]\nm = { argument = 'm', low = 2, high = 1, neutral = 1 }", "m.low: must be below high"),
        (CART + "[parameters]\nm = { argument = 'm', low = 0, high = 1, neutral = 2 }", "m.neutral: must be between 0"),
        (CART + "[parameters]\nm = { argument = 'm', low = 0, high = 1 }", "m.neutral: is missing; add it"),
        (
            CART + f"[arguments]\nspeed = 1.0\n[parameters]\nv = {{ argument = 'speed', {MASS} }}",
            "domain.parameters.v: argument 'speed' is fixed in [domain.arguments]",
        ),
        (CART + "[metrics]\nscore = 'retrun'", "domain.metrics.score: unknown value 'retrun'; did you mean 'return'?"),
        (CART + "[metrics]\nscore = 3", 'domain.metrics.score: must be "return", "length" or'),
        (CART + "[metrics]\nd = { info = 'drive', as = 'median' }", "metrics.d.as: unknown value 'median'"),
        (CART + "[metrics]\nd = { info = 'drive' }", "domain.metrics.d.as: is missing; add it"),
        (CART + "[state]\nx = 0\ny = 1", "domain.state.heading: is missing; add it"),
        (CART + "[state]\nx = 0\ny = 0\nheading = 1", "domain.state: names an entry of the observation twice"),
        (CART + "[state]\nx = 0\ny = 1\nheading = 4", "domain.state.heading: the observation has entries 0 to 3"),
        (SCREEN + "[state]\nx = 0\ny = 1\nheading = 2", "domain.state: the observations are Box"),
        ('environment = "toys:Cart"', "domain.steps: is missing, and the environment states no limit; add it"),
        ('environment = "Pendulm-v1"', "domain.environment: environment 'Pendulm-v1' raised"),
        ('environment = "toys:Cat"\nsteps = 3', "toys has no 'Cat'; did you mean 'Cart'?"),
        ('environment = "nowhere:Cart-v0"\nsteps = 3', "environment 'nowhere:Cart-v0' needs nowhere; install it"),
        ('environment = "toys:broken"\nsteps = 3', "environment 'toys:broken' raised ValueError: no such luck; cor"),
        ('environment = "toys:no_environment"\nsteps = 3', "is a dict; it must be a gymnasium.Env"),
        (CART + "[arguments]\nsped = 1.0", "domain.environment: environment 'toys:Cart' raised TypeError"),
        (
            CART + f"[parameters]\nm = {{ attribute = 'unwrapped.wait', {MASS} }}",
            "'unwrapped.wait' cannot be reached (AttributeError: 'Cart' object has no attribute 'wait'); correct it",
        ),
        (
            CART + f"[parameters]\nm = {{ attribute = 'weight', {MASS} }}",
            "domain.parameters.m: attribute 'weight' cannot be set (AttributeError: ",
        ),
        (
            PENDULUM.replace("unwrapped.m", "m"),
            "attribute 'm' cannot be reached (AttributeError: 'OrderEnforcing' object has no attribute 'm'); "
            "did you mean 'unwrapped.m'?",
        ),
        (CART + f"[parameters]\nm = {{ attribute = 'table[0, 5]', {MASS} }}", "attribute 'table[0, 5]' cannot be"),
        (CART + f"[parameters]\nm = {{ attribute = 'table', {MASS} }}", "attribute 'table' is array"),
        (CART + "[effects.dely]\ndelay = 0.1", "domain.effects.dely: no such effect; did you mean 'delay'?"),
    ],
)
def test_what_cannot_be_is_refused_in_one_line(tmp_path, text, line):
    told = complaint_of(family, tmp_path, text)
    assert line in told.replace("TimeLimit", "OrderEnforcing")
    assert told.startswith(f"{tmp_path / 'study.toml'}: domain.")


def test_an_environment_with_an_unknown_attribute_is_closed(tmp_path):
    with pytest.raises(InputError):
        family(tmp_path, CART + f"[parameters]\nm = {{ attribute = 'wait', {MASS} }}")
    assert load("toys:Cart", kind="environment", beside=tmp_path).open == 0


def test_arguments_and_attributes_have_their_values_and_are_neutral_where_not_named(tmp_path):
    text = CART + (
        "[arguments]\nnoise = 0.5\n[parameters]\n"
        f"v = {{ argument = 'speed', {MASS} }}\nm = {{ attribute = 'unwrapped.mass', {MASS} }}\n"
        f"t = {{ attribute = 'table[1, 0]', low = 0, high = 9, neutral = 3 }}\n"
    )
    settings = read_domain(domain(tmp_path, text))
    cart = make_environment(settings, {"v": 0.7, "t": 8.0})
    assert (cart.speed, cart.noise, cart.mass) == (0.7, 0.5, 1.0)
    assert cart.table.tolist() == [[1.0, 2.0], [8.0, 4.0]]
    assert make_environment(settings, {"m": 1.5}).mass == 1.5


def test_a_rate_and_a_limit_are_the_tables_or_the_environments(tmp_path):
    assert family(tmp_path, CART).spaces.rate_hz == 10.0
    assert family(tmp_path, CART.replace("rate_hz = 10.0", "")).spaces.rate_hz is None
    assert family(tmp_path, PENDULUM).spaces.rate_hz == pytest.approx(20.0)
    assert family(tmp_path, PENDULUM.replace("steps", "rate_hz = 5.0\nsteps")).spaces.rate_hz == 5.0
    assert family(tmp_path, 'environment = "toys:toys/Cart-v0"').spaces.steps == 12
    assert family(tmp_path, 'environment = "toys:toys/Cart-v0"\nsteps = 4').spaces.steps == 4
    assert dict(family(tmp_path, CART).metrics) == {"return": "", "length": "steps"}


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


def test_effects_bend_each_action_by_its_own_largest_the_left_wheel_s_first_and_keep_type_and_bounds():
    known = spaces((-2.0, 0.0, -1.0), (2.0, 0.5, 4.0))
    bent = passed_on(known, {"dead_band.width": 0.1}, [[1.0, 0.04, -1.0], [-2.0, 0.5, 4.0]])
    assert bent == pytest.approx(np.array([[0.8, 0.0, -0.6], [-1.8, 0.45, 3.6]]))
    bent = passed_on(spaces(), {"trim": 0.1, "dead_band.width": 0.1, "dead_band.imbalance": 1.0}, [[0.5, 0.5]])
    assert bent == pytest.approx(np.array([[0.5 * 0.9, 0.3 * 1.1]]))
    bent = passed_on(spaces(), {"wheel_gain.left": 1.5}, [[1.0, 0.2]], np.float32)
    assert bent.dtype == np.float32
    assert bent.tolist() == [[1.0, np.float32(0.2)]]
    known = spaces(low=(-10, -10), high=(10, 10))
    bent = passed_on(known, {"trim": 0.04}, [np.array([10, 10]), np.array([-7, -7])], np.int64)
    exact = passed_on(known, {"trim": 0.04}, [np.array([10, 10]), np.array([-7, -7])])
    assert np.array_equal(bent, np.rint(exact))
    assert not np.array_equal(bent, np.trunc(exact))
    action = np.array([0.1, 0.2], np.float32)
    assert Actuators((), spaces(), 1).pass_on(action) is action


def test_a_picture_is_blurred_over_its_past_and_a_heading_offset_turns_the_stated_entry_of_a_copy():
    known = spaces(picture=(4, 5))
    sensors = Sensors(effects_from({"blur": 0.1}, figures(known)), known, None, 1)
    dark, light = np.zeros((4, 5, 3), np.uint8), np.full((4, 5, 3), 200, np.uint8)
    assert (sensors.show(dark) == 0).all()
    seen = sensors.show(light)
    assert seen.dtype == np.uint8
    assert (seen == 100).all()
    assert (sensors.show(light) == 200).all()
    sensors = Sensors(effects_from({"heading_offset": 90.0 / 2}, {}), spaces(), (1, 2, 0), 1)
    observation = np.array([0.1, 2.0, 3.0, 7.0], np.float32)
    seen = sensors.show(observation)
    assert seen == pytest.approx([0.1 + np.pi / 4, 2.0, 3.0, 7.0])
    assert seen.dtype == np.float32
    assert observation[0] == np.float32(0.1)


def test_effects_change_what_an_agent_sees_and_not_what_it_is_scored_on(tmp_path):
    kin = family(tmp_path, SCREEN)

    def score(**theta):
        return kin.run(make_episode(theta, agent="toys:left_of_middle", start=0, seed=1))["return"]

    assert score() >= 4.0
    assert score(camera_latency=0.3) < score(), "it steers by where the stripe was"
    kin = family(tmp_path, CART + "[state]\nx = 1\ny = 2\nheading = 0\n")

    def score(agent, **theta):
        return kin.run(make_episode(theta, agent=agent, start=0, seed=1))

    assert score("toys:ahead", heading_offset=30.0) == score("toys:ahead")
    assert score("toys:homeward", heading_offset=30.0) != score("toys:homeward")
