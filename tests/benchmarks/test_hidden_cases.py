"""The robots with hidden effects move as worked out by hand."""

import ast
from dataclasses import replace
from pathlib import Path

import hidden_cases as hidden
import numpy as np
import pytest
import second_hidden_cases as second
from bullet_cases import BULLET, make_bullet_log
from hidden_cases import CLEAN, IN_FORM, OTHER_FORM, OUTSIDE, PAIRS, Case, make_log
from manoeuvres import Drives, make_drives

BENCHMARKS = Path(__file__).resolve().parents[2] / "benchmarks"
CASES = {case.name: case for case in (*IN_FORM, *OTHER_FORM, *PAIRS, *OUTSIDE)}
CATALOGUE = {
    *("delay_jitter", "dropped_commands", "command_quantisation"),
    *("wheel_gain", "dead_band", "saturation", "motor_lag", "battery_sag", "stiction", "backlash", "driver_map"),
    *("yaw_scrub", "turn_slip", "lateral_slip", "floor_slope"),
    *("marker_offset", "heading_offset"),
    *("slew_rate", "thermal_fade", "cross_coupling", "understeer", "yaw_lag", "wheel_ripple", "slippery_patch"),
}
PLAIN = Case("plain", (), "normal", 5, 0.0, 0.0)


def robot(*effects, **changes):
    return replace(PLAIN, effects=effects, **changes)


def held(left, right, seconds=4.0):
    return np.tile((left, right), (1, round(seconds * 20) + 1, 1)).astype(float)


def twists(duties, *effects, **changes):
    return hidden.wheel_twists(robot(*effects, **changes), duties)[0]


def driven(duties, *effects, start=(0.0, 0.0, 0.0), **changes):
    return hidden.true_poses(robot(*effects, **changes), Drives(duties, np.array([start])), 0.0)[0]


def poses(case, **short):
    return np.stack([episode.poses for episode in make_log(case, **short).episodes])


def over_two_seconds(rows):
    """Body-frame motion in windows of 2 s (E, windows, 3)."""
    before, moved = rows[:, :-40], rows[:, 40:] - rows[:, :-40]
    along = (moved[..., 0] + 1j * moved[..., 1]) * np.exp(-1j * before[..., 2])
    return np.stack((along.real, along.imag, moved[..., 2]), axis=-1)


@pytest.mark.parametrize(
    ("duty", "effects", "twist"),
    [
        ((1.0, 1.0), [], (0.6, 0.0, 0.0)),
        ((-0.5, -0.5), [], (-0.3, 0.0, 0.0)),
        ((0.0, 1.0), [], (0.3, 0.0, 3.75)),
        ((1.0, 0.0), [], (0.3, 0.0, -3.75)),
        ((0.5, 0.5), [("dead_band", {"width": 0.1})], (0.24, 0.0, 0.0)),
        ((-0.5, 0.05), [("dead_band", {"width": 0.1})], (-0.12, 0.0, 1.5)),
        ((0.5, 0.5), [("dead_band", {"width": 0.1, "left": 1.0, "right": 0.0})], (0.27, 0.0, 0.375)),
        ((0.5, 0.09), [("dead_zone_that_jumps", {"width": 0.1})], (0.15, 0.0, -1.875)),
        ((1.0, -1.0), [("saturation", {"limit": 0.4})], (0.0, 0.0, -3.0)),
        ((1.0, 1.0), [("smooth_saturation", {"limit": 0.5})], (0.3 * np.tanh(2.0), 0.0, 0.0)),
        ((0.5, -0.5), [("driver_map", {"offset": 0.2})], (0.0, 0.0, -4.5)),
        ((0.009, 0.009), [("driver_map", {"offset": 0.2})], (0.0, 0.0, 0.0)),
        ((0.25, 0.25), [("driver_curve", {"power": 0.5})], (0.3, 0.0, 0.0)),
        ((0.5, 0.5), [("wheel_gain", {"left": 0.8, "right": 1.0})], (0.27, 0.0, 0.375)),
        ((0.5, 0.0), [("battery_sag", {"load": 0.4})], (0.135, 0.0, -1.6875)),
        ((0.5, 0.5), [("sag_with_square_of_load", {"load": 0.4})], (0.27, 0.0, 0.0)),
        ((0.14, 0.16), [("stiction", {"breakaway": 0.15})], (0.048, 0.0, 0.6)),
        ((0.0, 1.0), [("yaw_scrub", {"baseline": 0.2})], (0.3, 0.0, 3.0)),
        ((1.0, 0.0), [("scrub_with_speed", {"gain": 1.0})], (0.3, 0.0, -3.75 / 1.3)),
        ((1.0, 0.0), [("turn_slip", {"gain": 0.1})], (0.1875, 0.0, -3.75)),
        ((0.0, 0.8), [("turn_slip_with_square", {"gain": 1 / 9})], (0.12, 0.0, 3.0)),
        ((0.0, 1.0), [("lateral_slip", {"gain": 0.1})], (0.3, -0.1125, 3.75)),
        ((0.0, -1.0), [("lateral_slip_with_square", {"gain": 0.1})], (-0.3, -0.03375, -3.75)),
        ((0.4, 0.6), [("yaw_friction", {"width": 0.25})], (0.3, 0.0, 0.5)),
        ((0.26, 0.26), [("command_quantisation", {"step": 0.2})], (0.12, 0.0, 0.0)),
        ((-0.38, -0.38), [("truncated_commands", {"step": 0.2})], (-0.12, 0.0, 0.0)),
        ((-0.5, 0.5), [("weak_reverse", {"factor": 0.8})], (0.03, 0.0, 3.375)),
        ((0.5, 0.5), [("motor_lag", {"time_constant": 0.35})], (0.3, 0.0, 0.0)),
        ((0.5, 0.5), [("second_order_motor", {"first": 0.25, "second": 0.12})], (0.3, 0.0, 0.0)),
        ((0.5, 0.5), [("backlash", {"gap": 0.6})], (0.3, 0.0, 0.0)),
    ],
    ids=lambda value: value[0][0] if isinstance(value, list) and value else None,
)
def test_a_held_duty_ends_in_the_twist_worked_out_by_hand(duty, effects, twist):
    np.testing.assert_allclose(twists(held(*duty, seconds=6.0), *effects)[-1], twist, atol=1e-6)


@pytest.mark.parametrize("trim", [0.1, -0.05])
def test_trim_curves_the_path_by_12_5_per_metre(trim):
    forward, _, yaw = twists(held(0.6, 0.6), trim=trim)[-1]
    assert yaw / forward == pytest.approx(12.5 * trim)


@pytest.mark.parametrize("delay", [0.0, 0.1, 0.2])
def test_nothing_moves_before_the_delay_and_63_percent_is_reached_0_2_seconds_after_it(delay):
    forward = twists(held(1.0, 1.0), delay=delay)[:, 0]
    assert np.flatnonzero(forward)[0] == round(delay * 240)
    reached = np.flatnonzero(forward >= 0.6 * (1.0 - np.exp(-1.0)))[0] / 240
    assert reached == pytest.approx(delay + 0.2, abs=1 / 240)


@pytest.mark.parametrize(("tau", "sides", "wheels"), [(0.05, {}, (1, 1)), (0.35, {"left": 1.0, "right": 0.0}, (1, 0))])
def test_motor_lag_is_the_time_constant_of_the_wheels_that_have_it(tau, sides, wheels):
    forward, _, yaw = twists(held(1.0, 1.0), ("motor_lag", {"time_constant": tau, **sides})).T
    for sign, slow in zip((-1.0, 1.0), wheels, strict=True):
        speed = forward + sign * yaw * 0.08
        reached = np.flatnonzero(speed >= 0.6 * (1.0 - np.exp(-1.0)))[0] / 240
        assert reached == pytest.approx(tau if slow else 0.2, abs=1 / 240)


def test_motors_lag_by_time_constants_of_their_own_and_break_away_or_wait_for_their_gap():
    duties = held(1.0, 1.0, seconds=8.0)
    duties[:, 80:] = 0.0
    forward = twists(duties, ("uneven_motor", {"rising": 0.4, "falling": 0.1}))[:, 0]
    assert forward[96] == pytest.approx(0.6 * (1.0 - np.exp(-1.0)), abs=2e-3)
    assert forward[960 + 24] == pytest.approx(0.6 * np.exp(-1.0), abs=5e-3)

    duties = np.repeat(np.array((0.1, 0.2, 0.1, 0.05, 0.1)), 60)[None, :, None] * np.ones(2)
    forward = twists(duties, ("stiction", {"breakaway": 0.15}))[::720, 0]
    ends = twists(duties, ("stiction", {"breakaway": 0.15}))[719::720, 0]
    assert forward[0] == 0.0
    np.testing.assert_allclose(ends, (0.0, 0.12, 0.06, 0.0), atol=1e-4)

    duties = held(0.5, 0.5, seconds=8.0)
    duties[:, 80:] = -0.5
    moved = driven(duties, ("backlash", {"gap": 0.6}))[:, 0] - driven(duties)[:, 0]
    np.testing.assert_allclose(moved[[79, 159]], (-0.3 * 0.0318, 0.3 * 0.0318), atol=1e-6)

    forward = twists(held(0.5, 0.5, seconds=60.0), ("battery_sag", {"fade": 0.5}))[-1, 0]
    assert forward == pytest.approx(0.3 * np.exp(-0.25), rel=1e-2)
    forward = twists(held(0.5, 0.5, seconds=60.0), ("sag_with_time", {"rate": 0.2}))[-1, 0]
    assert forward == pytest.approx(0.24, rel=1e-2)


@pytest.mark.parametrize(("effect", "seconds"), [("overtaking_jitter", 0.05), ("gaussian_jitter", 0.0798)])
def test_jitter_makes_messages_late_by_the_stated_mean(effect, seconds):
    arrival, scene = np.zeros((50, 1000)), hidden.Scene(np.random.default_rng(1), np.zeros(1), np.zeros(1))
    late = hidden.ARRIVAL[effect](arrival, scene, spread=0.1)
    assert late.mean() == pytest.approx(seconds, rel=0.02)
    assert late.min() >= 0.0


def test_messages_keep_their_order_however_late_they_are():
    duties = np.linspace(0.0, 1.0, 1200)[None, :, None] * np.ones(2)
    arrived = hidden._arrived(robot(("overtaking_jitter", {"spread": 0.3})), duties)[0, :, 0]
    assert np.all(np.diff(arrived) >= 0.0)
    assert np.any(np.diff(arrived) > 1.5 / 1199)
    issued = np.arange(2000)[None] / 20
    scene = hidden.Scene(np.random.default_rng(1), np.zeros(1), np.zeros(1))
    arrival = hidden.ARRIVAL["delay_jitter"](issued, scene, spread=0.2)
    assert np.all(np.diff(arrival) >= 0.0)
    assert 0.0 <= np.min(arrival - issued) < 0.1
    assert 0.19 < np.max(arrival - issued) <= 0.2


@pytest.mark.parametrize(
    ("effect", "figures", "share"),
    [("dropped_commands", {"probability": 0.3}, 0.3), ("dropped_bursts", {"rate": 0.06, "length": 4}, 1 - 0.94**4)],
)
def test_dropped_messages_leave_the_one_before_in_force(effect, figures, share):
    duties = np.linspace(0.0, 1.0, 6000)[None, :, None] * np.ones(2)
    scene = hidden.Scene(np.random.default_rng(1), duties, np.zeros(1))
    sent = hidden.MESSAGES[effect](duties, scene, **figures)[0, :, 0]
    assert np.mean(np.diff(sent) == 0.0) == pytest.approx(share, abs=0.02)
    assert np.all(np.isin(sent, duties))


@pytest.mark.parametrize(("heading", "speed"), [(0.0, 0.25), (np.pi, 0.35), (np.pi / 2, 0.28)])
def test_a_slope_takes_speed_uphill_and_gives_it_downhill(heading, speed):
    moved = driven(held(0.5, 0.5), ("floor_slope", {"x": 0.05, "y": 0.02}), start=(0.0, 0.0, heading))
    assert np.hypot(*(moved[-1] - moved[-21])[:2]) == pytest.approx(speed, abs=1e-6)


def test_floors_and_wheels_take_speed_where_they_say():
    assert not driven(held(0.0, 0.0), ("floor_slope", {"x": 0.05, "y": 0.02})).any()
    moved = np.diff(driven(held(0.5, 0.5, 8.0), ("carpet", {"factor": 0.8, "beyond": 1.0}))[:, 0]) * 20
    assert moved[40] == pytest.approx(0.3, rel=1e-3)
    assert moved[-1] == pytest.approx(0.24, rel=1e-3)
    moved = driven(held(0.5, 0.5, 2.0), ("bent_floor", {"gain": 0.1, "waves": 4.0}))
    assert moved[-1, 2] == pytest.approx(0.1 / 4.0 * (1.0 - np.cos(4.0 * moved[-1, 0])), abs=1e-4)
    forward = twists(held(0.5, 0.5), ("eccentric_wheel", {"ripple": 0.2}))[480:, 0]
    assert forward.max() == pytest.approx(0.33, abs=1e-3)
    assert forward.min() == pytest.approx(0.27, abs=1e-3)
    yaw = twists(held(0.5, 0.5, 8.0), ("slipping_hub", {"factor": 0.8, "after": 4.0}))[:, 2]
    assert not yaw[:959].any()
    assert yaw[-1] == pytest.approx(0.375)


@pytest.mark.parametrize(
    ("effect", "offset", "seen"),
    [
        ("marker_offset", {"forward": 0.05}, (1.0, 2.05, np.pi / 2)),
        ("marker_offset", {"left": 0.03}, (0.97, 2.0, np.pi / 2)),
        ("heading_offset", {"degrees": 6.0}, (1.0, 2.0, np.pi / 2 + np.pi / 30)),
    ],
)
def test_a_marker_is_seen_ahead_and_to_the_left_of_the_axle_and_an_offset_turns_its_heading(effect, offset, seen):
    there = hidden.measured(np.array([[[1.0, 2.0, np.pi / 2]]]), robot((effect, offset)), 0.0)[0, 0]
    np.testing.assert_allclose(there, seen, atol=1e-12)


@pytest.mark.slow
@pytest.mark.parametrize("case", CASES.values(), ids=CASES)
def test_what_is_hidden_moves_the_robot_by_more_than_a_millimetre_in_two_seconds(case):
    short = {"episodes": 6, "seconds": 40.0, "noiseless": True}
    apart = over_two_seconds(poses(case, **short)) - over_two_seconds(poses(replace(case, effects=()), **short))
    assert np.sqrt(np.mean(np.sum(apart[..., :2] ** 2, axis=-1))) > 1e-3


@pytest.mark.parametrize("case", CASES.values(), ids=CASES)
def test_a_case_says_which_names_of_the_catalogue_are_right_or_what_its_effect_depends_on(case):
    assert {name for names in case.right for name in names} <= CATALOGUE
    assert len(case.right) == (0 if case.depends_on else len(case.effects))


def test_every_effect_of_motion_is_hidden_in_sizes_and_no_two_cases_share_a_name_or_a_seed():
    counts = {name: sum(name in case.right[0] for case in IN_FORM) for name in CATALOGUE}
    assert all(2 <= count <= 8 for count in counts.values()), counts
    cases = (*CASES.values(), *CLEAN)
    assert len({case.seed for case in cases}) == len({case.name for case in cases}) == len(cases)
    assert len(cases) == len(IN_FORM) + len(OTHER_FORM) + len(PAIRS) + len(OUTSIDE) + 40


@pytest.mark.parametrize("generator", [hidden, second])
def test_a_log_is_twelve_minutes_of_20_rows_a_second_from_rest(generator):
    log = generator.make_log(generator.CLEAN[0], noiseless=True)
    assert (log.robot, log.command, log.rate_hz, log.geometry, len(log.episodes)) == ("duckiebot", "duty", 20.0, {}, 12)
    for episode in log.episodes:
        np.testing.assert_allclose(episode.times, np.arange(1200) / 20)
        assert episode.commands.shape == (1200, 2)
        assert episode.poses.shape == (1200, 3)
        np.testing.assert_array_equal(episode.poses[0], episode.poses[1])


@pytest.mark.parametrize("name", ["gaussian_jitter", "dropped_commands probability 0.2", "floor_slope x 0.01"])
def test_the_same_seed_gives_the_same_log_and_another_seed_another(name):
    short = {"episodes": 2, "seconds": 5.0}
    np.testing.assert_array_equal(poses(CASES[name], **short), poses(CASES[name], **short))
    assert not np.array_equal(poses(CASES[name], **short), poses(replace(CASES[name], seed=1), **short))


@pytest.mark.parametrize(("noise", "times"), [("normal", 1.0), ("double", 2.0)])
def test_a_pose_has_2_millimetres_and_5_milliradians_of_white_noise(noise, times):
    seen = hidden.measured(np.zeros((20, 1000, 3)), PLAIN, hidden.LEVELS[noise])
    np.testing.assert_allclose(seen.std(axis=(0, 1)) / times, (0.002, 0.002, 0.005), rtol=0.03)
    assert abs(np.mean(seen[:, 1:] * seen[:, :-1]) / np.mean(seen**2)) < 0.03
    assert not np.array_equal(seen, hidden.measured(np.zeros((20, 1000, 3)), replace(PLAIN, seed=6), 1.0))


def test_noise_of_motion_has_its_size_and_correlation_and_is_three_percent_in_two_seconds():
    steady = np.tile((0.4, 0.0, 1.0), (100, 4800, 1))
    noise = hidden.disturbed(steady, PLAIN, 2.0) - steady
    np.testing.assert_allclose(noise.std(axis=(0, 1)), (0.02, 0.0048, 2 * (0.025 + 0.04)), rtol=0.05)
    kept = np.mean(noise[:, 60:] * noise[:, :-60], axis=(0, 1)) / np.mean(noise**2, axis=(0, 1))
    np.testing.assert_allclose(kept, np.exp(-1.0), atol=0.05)
    np.testing.assert_allclose(noise[:, 0].std(axis=0), noise.std(axis=(0, 1)), rtol=0.25)
    assert not hidden.disturbed(np.zeros((2, 240, 3)), PLAIN, 2.0).any()
    quiet, loud = (over_two_seconds(poses(CLEAN[0], noiseless=flag)) for flag in (True, False))
    assert 0.02 < np.sqrt(np.mean((loud - quiet)[..., :2] ** 2) / np.mean(quiet[..., :2] ** 2)) < 0.045


def test_paths_are_circles_of_their_radius_stepped_or_integrated():
    before, after = driven(held(0.0, 1.0))[[40, 50]]
    chord, turned = complex(*(after - before)[:2]), after[2] - before[2]
    assert abs(chord) == pytest.approx(2.0 * 0.08 * np.sin(turned / 2.0), rel=1e-3)
    assert np.angle(chord * np.exp(-0.5j * (before[2] + after[2]))) == pytest.approx(0.0, abs=1e-3)
    drives = make_drives(3, 2, 100)
    level_floor = robot(("floor_slope", {"x": 0.0, "y": 0.0}), delay=0.1)
    level, plain = (hidden.true_poses(one, drives, 1.0) for one in (level_floor, robot(delay=0.1)))
    np.testing.assert_allclose(level, plain, atol=1e-12)


def test_duties_stay_within_one_differ_between_episodes_and_stop_creep_reverse_and_spin_in_every_log():
    duties, starts = make_drives(7, 12, 1200)
    assert np.abs(duties).max() <= 1.0
    assert len(np.unique(duties[:10].reshape(10, -1), axis=0)) == 10
    np.testing.assert_array_equal(duties[10:], duties[:2])
    np.testing.assert_array_equal(starts[10:], starts[:2])
    for seed in range(10):
        left, right = np.moveaxis(make_drives(seed, 6, 1200).duties, -1, 0)
        base, turn = (left + right) / 2.0, (right - left) / 2.0
        seen = (
            (left == 0.0) & (right == 0.0),
            (np.abs(left) < 0.1) & (np.abs(right) < 0.1) & (left != 0.0),
            (base < -0.2) & (np.abs(turn) < 0.1),
            (np.abs(base) < 1e-9) & (np.abs(turn) > 0.2),
            np.maximum(np.abs(left), np.abs(right)) > 0.95,
        )
        assert all(mask.sum() > 20 for mask in seen), (seed, [int(mask.sum()) for mask in seen])


SECOND = sorted(path.name for path in BENCHMARKS.glob("second_hidden_*.py"))
OTHERS = ["hidden_cases.py", "manoeuvres.py", "third_hidden_cases.py", "gym_dynamics_cases.py"]


@pytest.mark.parametrize("module", [*OTHERS, *SECOND])
def test_the_generator_knows_nothing_of_proxytune_but_the_log(module):
    tree = ast.parse((BENCHMARKS / module).read_text(encoding="utf-8"))
    names = {node.module for node in ast.walk(tree) if isinstance(node, ast.ImportFrom)}
    names |= {alias.name for node in ast.walk(tree) if isinstance(node, ast.Import) for alias in node.names}
    assert {name for name in names if name.startswith("proxytune")} <= {"proxytune.logs"}
    first = {"hidden_cases", "manoeuvres", "planted", "bullet_cases", "learnt_truth"}
    assert module not in SECOND or not names & first


def bullet_motion(case):
    log = make_bullet_log(case, episodes=2, seconds=10.0, noiseless=True)
    return over_two_seconds(np.stack([episode.poses for episode in log.episodes]))


def test_the_nominal_bullet_plant_and_this_robot_agree_within_a_centimetre_in_two_seconds():
    nominal = BULLET[0]
    case = replace(PLAIN, seed=nominal.seed, trim=nominal.trim, delay=nominal.delay)
    apart = bullet_motion(nominal) - over_two_seconds(poses(case, episodes=2, seconds=10.0, noiseless=True))
    assert np.sqrt(np.mean(np.sum(apart[..., :2] ** 2, axis=-1))) < 0.01


@pytest.mark.slow
@pytest.mark.parametrize("case", BULLET[1:], ids=lambda case: case.name)
def test_changed_physics_moves_the_bullet_robot_by_more_than_2_millimetres_in_two_seconds(case):
    apart = bullet_motion(case) - bullet_motion(replace(case, changes={}))
    assert np.sqrt(np.mean(np.sum(apart[..., :2] ** 2, axis=-1))) > 0.002
