"""What is learnt is an effect like any other, harmless where nothing was seen, and named values of θ."""

import math
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from one_line import complaint_of

from proxytune.driving import read_robot
from proxytune.effects import GROUPS, OF_PLACE, FilterContext, LearntCommands, LearntCurve, effects_from
from proxytune.effects.features import MOTION_GROUPS
from proxytune.effects.learnt import LABEL, FittedRange, Learnt, learnt_effect, learnt_theta
from proxytune.effects.model import Model, model_text, read_model
from proxytune.effects.motion import pose_after
from proxytune.errors import SettingsError
from proxytune.testing.effect import Subject, _claim_chunks, _claim_filter

ROBOT = read_robot("duckiebot")
RATE_HZ = 60.0
SEEN = FittedRange((-0.4, 0.5), (-4.0, 3.0))
KNOTS = {
    "level": (1.0,),
    "start": (0.1, 0.4),
    "ringing": (0.5, 2.0),
    "play": (0.02, 0.1),
    "wheel_speed": (-0.5, -0.2, 0.1, 0.3, 0.6),
    "turn_rate": (-3.0, -1.0, 0.5, 2.0),
    "speed_and_turn": ((-0.3, -1.0), (-0.3, 0.0), (0.0, 2.0), (0.2, -1.0), (0.4, 2.0)),
    "transients": (0.04, 0.2, 1.0),
    "reversal": (0.01, 0.05),
    "direction": (-1.0,),
    "time": (0.3, 0.8, 1.4),
    "use": (0.002, 0.006),
    "load": (0.5, 4.0),
    "heading": (1.0, 2.0),
    "other_wheel": (-0.3, 0.2, 0.5),
    "changes": (0.04, 0.2, 1.0),
    "place": ((-0.05, -0.05), (-0.05, 0.05), (0.05, -0.05), (0.05, 0.05), (0.15, 0.05)),
    "x": (-0.05, 0.05, 0.15),
    "y": (-0.05, 0.05),
    "tracker_x": (-0.05, 0.05),
    "tracker_y": (-0.05, 0.05, 0.15),
}


def effect_of(*groups, size=0.3, seed=3):
    random = np.random.default_rng(seed)
    curves = [
        LearntCurve(group, channel, KNOTS[group], tuple(size * random.uniform(0.5, 1.0, len(KNOTS[group]))))
        for group in groups
        for channel in GROUPS[group].channels
    ]
    return Learnt(SEEN, tuple(curves))


ALL = effect_of(*MOTION_GROUPS)
EFFECTS = [pytest.param(effect_of(group), id=group) for group in MOTION_GROUPS] + [
    pytest.param(ALL, id="all", marks=pytest.mark.slow)
]


def a_signal(seed, length=90):
    return np.repeat(np.random.default_rng(seed).uniform(-1.0, 1.0, (length // 3, 3)), 3, axis=0) * (0.6, 0.0, 5.0)


def integrate_twists(twists, tick_s, heading):
    """Places before each sample and after the last, in the little steps that effects take."""
    pose = np.array((0.0, 0.0, heading))
    poses = [pose]
    for twist in twists:
        pose = pose_after(pose, twist * tick_s)
        poses.append(pose)
    return np.array(poses)


def run(effect, signal):
    setting = FilterContext(RATE_HZ, np.zeros(3), ROBOT.figures, headings=np.array([0.4]))
    return effect.apply(signal, effect.begin(setting))[0]


@pytest.mark.parametrize("effect", EFFECTS)
def test_every_group_changes_the_motion_but_not_of_a_robot_that_has_not_moved_or_stands_for_long(effect):
    signal = a_signal(2)
    assert np.abs(run(effect, signal) - signal).max() > 1e-3
    signal = np.concatenate((a_signal(5), np.zeros((1800, 3))))
    np.testing.assert_allclose(run(effect, signal)[-60:], 0.0, atol=1e-9)
    np.testing.assert_array_equal(run(effect, np.zeros((600, 3))), 0.0)


class Driven(Subject):
    """The robot that is driven here, for what every effect promises."""

    def signal(self, seed, length=90):
        return a_signal(seed, length)

    def context(self, rest, seed=7):
        return FilterContext(RATE_HZ, rest, ROBOT.figures, headings=np.array([0.4]))


@pytest.mark.parametrize("effect", EFFECTS)
def test_it_is_a_filter_like_any_other(effect):
    subject = Driven(Learnt, ROBOT, "learnt")
    _claim_filter(subject, effect, "learnt")
    _claim_chunks(subject, effect, "learnt")


@pytest.mark.parametrize("group", [group for group in MOTION_GROUPS if group not in ("heading", *OF_PLACE)])
def test_beyond_what_was_seen_what_is_added_is_what_it_was_at_the_edge(group):
    effect, edge = effect_of(group), np.tile((SEEN.forward[1], 0.0, SEEN.yaw[0]), (90, 1))
    beyond = edge * (3.0, 0.0, 2.0)
    np.testing.assert_allclose(run(effect, beyond) - beyond, run(effect, edge) - edge, rtol=0, atol=1e-12)


@pytest.mark.parametrize("group", ["time", "use"])
def test_beyond_the_last_knot_of_time_or_use_a_curve_is_level(group):
    steady = np.tile((0.3, 0.0, 0.5), (6000, 1))
    added = run(effect_of(group), steady) - steady
    np.testing.assert_allclose(added[3000:], added[-1:].repeat(3000, axis=0), rtol=0, atol=1e-12)
    assert np.abs(added[5] - added[-1]).max() > 1e-3


@pytest.mark.parametrize("effect", EFFECTS)
def test_features_times_weights_are_what_is_added_where_headings_are_known(effect):
    signal = a_signal(6)[None]
    known = np.linspace(0.0, 3.0, 91)
    places = np.stack((0.1 * np.cos(known), 0.1 * np.sin(known)), axis=-1)
    memory = effect.begin(FilterContext(RATE_HZ, np.zeros((1, 3)), ROBOT.figures, headings=known, places=places))
    parts = effect.features(signal, memory)
    total = sum(
        (basis @ np.array(curve.weights))[..., None] * unit
        for (basis, unit), curve in zip(parts, effect.curves, strict=True)
    )
    np.testing.assert_allclose(effect.apply(signal, memory)[0] - signal, total, rtol=0, atol=1e-12)


def test_curves_over_commands_are_an_effect_of_their_own_which_motion_passes_by():
    both = Learnt(SEEN, (*effect_of("time").curves, LearntCurve("duty", "duty", (0.5,), (0.1,))))
    effects = effects_from(learnt_theta(both), ROBOT.figures)
    assert [type(effect) for effect in effects] == [LearntCommands, Learnt]
    assert [curve.group for curve in effects[0].curves] == ["duty"]
    np.testing.assert_array_equal(run(effects[1], a_signal(2)), run(effect_of("time"), a_signal(2)))
    alone = effects_from(learnt_theta(Learnt(SEEN, both.curves[-1:])), ROBOT.figures)
    assert [type(effect) for effect in alone] == [LearntCommands]


@pytest.mark.parametrize("effect", EFFECTS)
@pytest.mark.parametrize("sample", [0, 1, 40])
def test_a_window_amid_a_drive_goes_on_as_the_drive_does(effect, sample):
    drives = np.stack([a_signal(seed) for seed in (7, 8)])
    drives[..., 1] = 0.0
    row, samples = np.array([1, 0, 1]), np.full(3, sample)
    whole = [run(effect, drive) for drive in drives]
    so_far = [0.4 + np.concatenate(([0.0], np.cumsum(one[:, 2]))) / RATE_HZ for one in whole]
    turned = np.array([so_far[r][sample] for r in row])
    walked = [integrate_twists(one, 1.0 / RATE_HZ, 0.4) for one in whole]
    places = np.array([walked[r][sample, :2] for r in row])[:, None]
    context = FilterContext(RATE_HZ, np.zeros((3, 3)), ROBOT.figures, headings=turned[:, None], places=places)
    driven = FilterContext(RATE_HZ, np.zeros((2, 3)), ROBOT.figures)
    moved, _ = effect.apply(drives[row][:, sample:], effect.recall(context, driven, drives, row, samples))
    np.testing.assert_allclose(moved, np.stack([whole[r][sample:] for r in row]), rtol=0, atol=1e-9)


def test_curves_add_to_their_wheels_and_fade_and_a_veer_follows_the_heading_it_leads_to():
    baseline = ROBOT.figures["effective_baseline"]
    effect = Learnt(SEEN, (LearntCurve("wheel_speed", "right", (0.2, 0.4), (0.05, 0.01)),))
    straight = np.tile((0.3, 0.0, 0.0), (5, 1))
    added = run(effect, straight) - straight
    np.testing.assert_allclose(added[-1], (0.015, 0.0, 0.03 / baseline))
    effect = Learnt(SEEN, tuple(LearntCurve("transients", side, (0.5,), (1.0,)) for side in ("left", "right")))
    step = np.tile((0.2, 0.0, 0.0), (120, 1))
    added = (run(effect, step) - step)[:, 0]
    np.testing.assert_allclose(added, 0.2 * np.exp(-np.arange(1, 121) / (0.5 * RATE_HZ)), rtol=1e-9)
    assert all(later < earlier for earlier, later in pairwise(added))
    names = [effect.name for effect in effects_from({**WHOLE, "floor_slope.x": 0.1, "trim": 0.0}, ROBOT.figures)]
    assert names == ["trim", "floor_slope", "learnt"]
    moved = run(Learnt(SEEN, (LearntCurve("heading", "veer_sin", (1.0,), (3.0,)),)), np.tile((0.4, 0.0, 0.0), (600, 1)))
    heading = 0.4 + np.concatenate(((0.0,), np.cumsum(moved[:-1, 2]) / RATE_HZ))
    np.testing.assert_allclose(moved[:, 2], 3.0 * 0.4 * np.sin(heading), atol=1e-12)
    assert heading[-1] == pytest.approx(np.pi, abs=0.01)


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


def test_weights_are_read_by_their_names_and_labelled_as_no_physics(tmp_path):
    theta = read_model(write(tmp_path, GOOD)).theta
    assert theta["learnt.turn_rate.yaw@-1.25"] == 0.1
    assert theta["learnt.speed_and_turn.sideways@0.2,-1.0"] == 0.02
    assert theta["learnt.range.yaw@high"] == 3.5
    assert len(theta) == 4 + 8 + 2 + 2
    assert [effect.name for effect in effects_from(theta, read_robot("duckiebot").figures)] == ["learnt"]
    assert f"# {LABEL}" in model_text(read_model(write(tmp_path, GOOD)))
    assert "not physics" in LABEL


NUMBERS = st.floats(-99.0, 99.0)


@st.composite
def learnt(draw):
    curves = []
    for group, kind in GROUPS.items():
        low = kind.low if kind.low is not None else -20.0
        number = st.floats(low, 30.0).filter(bool)
        knot = st.tuples(NUMBERS if kind.low is None else number, number) if "," in kind.unit else number
        drawn = tuple(sorted(draw(st.sets(knot, max_size=4))))
        knots = next((one.knots for one in curves if (one.group, group) == ("transients", "changes")), drawn)
        channels = draw(st.sets(st.sampled_from(sorted(kind.channels)))) if knots else ()
        for channel in kind.channels:
            if channel in channels:
                curves.append(LearntCurve(group, channel, knots, tuple(draw(NUMBERS) for _ in knots)))
    ends = [draw(st.floats(-9.0, -0.1)), draw(st.floats(0.1, 9.0))]
    return Learnt(FittedRange((ends[0], ends[1]), (2.0 * ends[0], 3.0 * ends[1])), tuple(curves))


@pytest.mark.slow
@given(effect=learnt())
@settings(max_examples=60)
def test_a_learnt_effect_reads_back_from_a_model_file_exactly(effect, tmp_path_factory):
    theta = {"trim": 0.05, **learnt_theta(effect)}
    path = write(tmp_path_factory.mktemp("model"), model_text(Model("duckiebot", None, theta, {})))
    assert read_model(path).theta == theta
    assert learnt_effect(read_model(path).theta) == effect


def test_a_theta_without_learnt_values_has_no_learnt_effect_and_a_curve_without_a_range_is_refused():
    assert learnt_effect({"trim": 0.1}) is None
    with pytest.raises(SettingsError, match=r"learnt.range.forward: must be finite"):
        learnt_effect({"learnt.turn_rate.yaw@1.0": 0.1})


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
        ("[effects.learnt.time]", "[effects.learnt]\nturn = 1\n[effects.learnt.time]", "effects.learnt.turn: unknown"),
        ("effects.learnt.range]", "effects.learned.range]", "effects.learned: no such effect; did you mean 'learnt'?"),
    ],
)
def test_a_mistake_is_one_line_with_file_and_key(tmp_path, before, after, says):
    assert before in GOOD
    path = write(tmp_path, GOOD.replace(before, after))
    told = complaint_of(read_model, path)
    assert says in told
    assert str(path) in told


WHOLE = learnt_theta(Learnt(FittedRange((-1.0, 1.0), (-1.0, 1.0)), (LearntCurve("turn_rate", "yaw", (1.0,), (0.1,)),)))


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
    assert says in complaint_of(effects_from, {**WHOLE, **changes}, ROBOT.figures)
