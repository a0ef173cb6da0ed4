"""A learnt effect is named values of θ, and tables of a model.toml that read back as the same values."""

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from proxytune.driving.robot import read_robot
from proxytune.effects import Model, effects_from, model_text, read_model
from proxytune.effects.learnt.effect import Curve, Learnt, Seen
from proxytune.effects.learnt.features import GROUPS
from proxytune.effects.learnt.table import LABEL, learnt_effect, learnt_theta
from proxytune.errors import SettingsError

GOOD = """
format = 1
robot = "duckiebot"
[effects.learnt.range]
forward = [-0.3, 0.5]
yaw = [-3, 3.5]
[effects.learnt.turn_rate]
knots = [-2.0, -1.25, 1.0, 2]
forward = [0.1, 0.05, 0.04, 0.1]
yaw = [0.2, 0.1, -0.1, -0.3]
[effects.learnt.speed_and_turn]
knots = [[0.0, 1.0], [0.2, -1.0]]
sideways = [0.01, 0.02]
[effects.learnt.time]
knots = [10, 30]
left = [0.1, 0.2]
"""


def write(folder, text):
    path = folder / "model.toml"
    path.write_text(text, encoding="utf-8")
    return path


def test_weights_are_read_by_their_names_in_theta(tmp_path):
    theta = read_model(write(tmp_path, GOOD)).theta
    assert theta["learnt.turn_rate.yaw@-1.25"] == 0.1
    assert theta["learnt.speed_and_turn.sideways@0.2,-1.0"] == 0.02
    assert theta["learnt.range.yaw@high"] == 3.5
    assert len(theta) == 4 + 8 + 2 + 2
    assert [effect.name for effect in effects_from(theta, read_robot("duckiebot").figures)] == ["learnt"]


def test_what_was_learnt_is_labelled_as_no_physics(tmp_path):
    text = model_text(read_model(write(tmp_path, GOOD)))
    assert f"# {LABEL}" in text
    assert "not physics" in LABEL


NUMBERS = st.floats(-99.0, 99.0)


@st.composite
def learnt(draw):
    curves = []
    for group, kind in GROUPS.items():
        pairs = group == "speed_and_turn"
        low = kind.low if kind.low is not None else -20.0
        number = st.floats(low, 30.0).filter(bool)
        knot = st.tuples(NUMBERS, number) if pairs else number
        knots = tuple(sorted(draw(st.sets(knot, max_size=4))))
        channels = draw(st.sets(st.sampled_from(sorted(kind.channels)))) if knots else ()
        for channel in kind.channels:
            if channel in channels:
                curves.append(Curve(group, channel, knots, tuple(draw(NUMBERS) for _ in knots)))
    ends = [draw(st.floats(-9.0, -0.1)), draw(st.floats(0.1, 9.0))]
    return Learnt(Seen((ends[0], ends[1]), (2.0 * ends[0], 3.0 * ends[1])), tuple(curves))


@given(effect=learnt())
@settings(max_examples=60, derandomize=True, deadline=None)
def test_a_learnt_effect_reads_back_from_a_model_file_exactly(effect, tmp_path_factory):
    theta = {"trim": 0.05, **learnt_theta(effect)}
    path = write(tmp_path_factory.mktemp("model"), model_text(Model("duckiebot", None, theta, {})))
    assert read_model(path).theta == theta
    assert learnt_effect(read_model(path).theta) == effect


def test_a_theta_without_learnt_values_has_no_learnt_effect():
    assert learnt_effect({"trim": 0.1}) is None


@pytest.mark.parametrize(
    ("before", "after", "says"),
    [
        ("learnt.turn_rate]", "learnt.turnrate]", "effects.learnt.turnrate: unknown key; did you mean 'turn_rate'?"),
        ("yaw = [0.2,", "jaw = [0.2,", "effects.learnt.turn_rate.jaw: unknown key; did you mean 'yaw'?"),
        ("yaw = [0.2, ", "yaw = [", "turn_rate.yaw: must have one weight for each of 4 knots, got 3"),
        ("yaw = [0.2,", "yaw = [nan,", "turn_rate.yaw: weights must be between -100 and 100, got nan"),
        ("yaw = [0.2,", "yaw = [1e3,", "turn_rate.yaw: weights must be between -100 and 100, got 1000"),
        ("yaw = [0.2,", 'yaw = ["x",', "turn_rate.yaw: must be a list of numbers, got 'x' in it"),
        ("left = [0.1, 0.2]", "left = 0.1", "time.left: must be a list of numbers, got 0.1"),
        ("left = [0.1, 0.2]", "", "time.knots: is alone; add weights for left or right"),
        ("knots = [10, 30]", "", "time.knots: must be a list of numbers, got None"),
        ("knots = [10, 30]", "knots = [30, 10]", "time.knots: must be in ascending order"),
        ("knots = [10, 30]", "knots = [10, 10]", "time.knots: must be in ascending order, each once"),
        ("knots = [10, 30]", "knots = [-1, 10]", "time.knots: must be at least 0.001 s, got -1"),
        ("knots = [10, 30]", "knots = [0, 10]", "time.knots: 0 is no knot"),
        ("knots = [10, 30]", "knots = [10, inf]", "time.knots: must be finite"),
        ("knots = [10, 30]", "knots = [[1, 2], [3, 4]]", "time.knots: must be numbers [s], got [1.0, 2.0]"),
        ("[[0.0, 1.0], [0.2", "[0.0, [0.2", "speed_and_turn.knots: must be pairs [m/s, rad/s], got [0.0]"),
        ("yaw = [-3, 3.5]", "", "effects.learnt.range.yaw: is missing; add it"),
        ("yaw = [-3, 3.5]", "yaw = [1, 3.5]", "range.yaw: must be finite with 0 in it, got [1, 3.5]"),
        (
            "[effects.learnt.time]",
            "[effects.learnt]\nturn = 1\n[effects.learnt.time]",
            "effects.learnt.turn: unknown key",
        ),
        (
            "[effects.learnt.range]",
            "[effects.learned.range]",
            "effects.learned: no such effect; did you mean 'learnt'?",
        ),
    ],
)
def test_a_mistake_is_one_line_with_file_and_key(tmp_path, before, after, says):
    assert before in GOOD
    path = write(tmp_path, GOOD.replace(before, after))
    with pytest.raises(SettingsError) as caught:
        read_model(path)
    assert says in str(caught.value)
    assert str(path) in str(caught.value)
    assert "\n" not in str(caught.value)


WHOLE = {
    **{f"learnt.range.{channel}@{end}": value for channel in Seen._fields for end, value in (("low", -1), ("high", 1))},
    "learnt.turn_rate.yaw@1.0": 0.1,
}


@pytest.mark.parametrize(
    ("changes", "says"),
    [
        ({"learnt.turnrate.yaw@1.0": 0.1}, "learnt.turnrate.yaw@1.0: no group of the learnt effect has this name"),
        ({"learnt.turn_rate.jaw@1.0": 0.1}, "did you mean 'learnt.turn_rate.yaw@KNOT'?"),
        ({"learnt.turn_rate.yaw": 0.1}, "learnt.turn_rate.yaw: no group of the learnt effect has this name"),
        ({"learnt.turn_rate.yaw@x": 0.1}, "'x' is no knot"),
        ({"learnt.turn_rate.yaw@2.0": math.inf}, "learnt.turn_rate.yaw: weights must be between -100 and 100"),
        ({"learnt.turn_rate.forward@2.0": 0.1}, "must have the same knots as turn_rate.yaw"),
        ({"learnt.range.yaw@low": math.nan}, "learnt.range.yaw: must be finite with 0 in it"),
    ],
)
def test_a_wrong_name_in_theta_is_refused_in_one_line(changes, says):
    with pytest.raises(SettingsError) as caught:
        effects_from({**WHOLE, **changes}, read_robot("duckiebot").figures)
    assert says in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_learnt_curve_without_a_range_is_refused():
    with pytest.raises(SettingsError, match=r"learnt.range.forward: must be finite"):
        learnt_effect({"learnt.turn_rate.yaw@1.0": 0.1})
