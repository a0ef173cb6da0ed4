"""What [domain] of an environment says is read strictly, and refused with file, key and remedy."""

import sys

import pytest

pytest.importorskip("gymnasium")

from toy_families import CART, PENDULUM, SCREEN, domain, family

from proxytune.environments.making import make_environment
from proxytune.environments.settings import read_domain
from proxytune.errors import InputError
from proxytune.extensions import load

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
        (
            CART + "[state]\nx = 0\ny = 1\nheading = 4",
            "domain.state.heading: the observation has entries 0 to 3, got 4",
        ),
        (SCREEN + "[state]\nx = 0\ny = 1\nheading = 2", "domain.state: the observations are Box"),
        ('environment = "toys:Cart"', "domain.steps: is missing, and the environment states no limit; add it"),
        ('environment = "Pendulm-v1"', "domain.environment: environment 'Pendulm-v1' raised"),
        ('environment = "toys:Cat"\nsteps = 3', "toys has no 'Cat'; did you mean 'Cart'?"),
        ('environment = "nowhere:Cart-v0"\nsteps = 3', "environment 'nowhere:Cart-v0' needs nowhere; install it"),
        (
            'environment = "toys:broken"\nsteps = 3',
            "environment 'toys:broken' raised ValueError: no such luck; correct",
        ),
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
        (
            CART + f"[parameters]\nm = {{ attribute = 'table[0, 5]', {MASS} }}",
            "attribute 'table[0, 5]' cannot be reached",
        ),
        (CART + f"[parameters]\nm = {{ attribute = 'table', {MASS} }}", "attribute 'table' is array"),
        (CART + "[effects.dely]\ndelay = 0.1", "domain.effects.dely: no such effect; did you mean 'delay'?"),
    ],
)
def test_what_cannot_be_is_refused_in_one_line(tmp_path, text, line):
    with pytest.raises(InputError) as refused:
        family(tmp_path, text)
    told = str(refused.value)
    assert line in told.replace("TimeLimit", "OrderEnforcing")
    assert told.startswith(f"{tmp_path / 'study.toml'}: domain.")
    assert "\n" not in told


def test_an_environment_with_an_unknown_attribute_is_closed(tmp_path):
    with pytest.raises(InputError):
        family(tmp_path, CART + f"[parameters]\nm = {{ attribute = 'wait', {MASS} }}")
    assert load("toys:Cart", kind="environment", beside=tmp_path).open == 0


def test_without_gymnasium_the_user_is_told_what_to_install(tmp_path, monkeypatch):
    table = domain(tmp_path, CART)
    monkeypatch.setitem(sys.modules, "gymnasium", None)
    with pytest.raises(InputError, match=r'Gymnasium is not installed; run pip install "proxytune\[gym\]"'):
        make_environment(read_domain(table), {})


def test_without_a_table_of_metrics_there_are_return_and_length(tmp_path):
    assert dict(family(tmp_path, CART).metrics) == {"return": "", "length": "steps"}


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


def test_a_rate_is_the_tables_or_that_of_the_environments_steps(tmp_path):
    assert family(tmp_path, CART).spaces.rate_hz == 10.0
    assert family(tmp_path, CART.replace("rate_hz = 10.0", "")).spaces.rate_hz is None
    assert family(tmp_path, PENDULUM).spaces.rate_hz == pytest.approx(20.0)
    assert family(tmp_path, PENDULUM.replace("steps", "rate_hz = 5.0\nsteps")).spaces.rate_hz == 5.0


def test_a_registered_environment_states_its_own_limit(tmp_path):
    assert family(tmp_path, 'environment = "toys:toys/Cart-v0"').spaces.steps == 12
    assert family(tmp_path, 'environment = "toys:toys/Cart-v0"\nsteps = 4').spaces.steps == 4
