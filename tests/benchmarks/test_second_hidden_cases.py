"""The robots of the second generator move as worked out by hand, and by more than its noise."""

from dataclasses import replace

import hidden_cases as hidden
import numpy as np
import pytest
import second_hidden_cases as second
from second_hidden_cases import CLEAN, IN_FORM, LEVELS, NOISES, OTHER_FORM, OUTSIDE, PAIRS, Case, make_log

CASES = {case.name: case for case in (*IN_FORM, *OTHER_FORM, *PAIRS, *OUTSIDE)}
MOTION_EFFECTS = {name for case in hidden.IN_FORM for names in case.right for name in names}
PLAIN = Case("plain", (), "normal heavy", 5, 0.0, 0.0)
NOISE_M = 0.0125
"""What two seconds of normal noise move a robot, at most; a test below says so."""


def robot(*effects, **changes):
    return replace(PLAIN, effects=effects, **changes)


def held(left, right, seconds=4.0):
    return np.tile((left, right), (1, round(seconds * 20) + 1, 1)).astype(float)


def twists(duties, *effects, **changes):
    return second.twists_of(robot(*effects, **changes), duties)[0][0]


def moved(duties, *effects, start=(0.0, 0.0, 0.0), **more):
    return second.driven(robot(*effects, **more), second.Course(duties, np.array([start])), 0.0)[0]


def poses(case, **short):
    return np.stack([episode.poses for episode in make_log(case, **short).episodes])


def apart_m(first, other):
    """How differently two robots move in two seconds, seen from the robot: RMS [m]."""
    ways = []
    for rows in (first, other):
        step = rows[:, 40:] - rows[:, :-40]
        ways.append((step[..., 0] + 1j * step[..., 1]) * np.exp(-1j * rows[:, :-40, 2]))
    return float(np.sqrt(np.mean(np.abs(ways[0] - ways[1]) ** 2)))


@pytest.mark.parametrize("integration", ["exact", "coarse"])
@pytest.mark.parametrize(
    ("duty", "effects", "twist"),
    [
        ((1.0, 1.0), [], (0.6, 0.0, 0.0)),
        ((-0.4, -0.4), [], (-0.24, 0.0, 0.0)),
        ((0.2, 0.6), [], (0.24, 0.0, 1.5)),
        ((0.5, 0.5), [("dead_band", {"width": 0.1, "wheel": "right"})], (0.27, 0.0, -0.375)),
        ((0.5, 0.5), [("soft_dead_band", {"width": 0.5})], (0.3 * (1.0 - np.exp(-1.0)), 0.0, 0.0)),
        ((0.16, 0.2), [("stiction", {"breakaway": 0.18})], (0.06, 0.0, 0.75)),
        ((0.8, 0.8), [("saturation", {"limit": 0.4, "wheel": "left"})], (0.36, 0.0, 1.5)),
        ((0.5, 0.5), [("rounded_saturation", {"limit": 0.5})], (0.3 / 2.0 ** (1 / 6), 0.0, 0.0)),
        ((0.5, 0.5), [("driver_map", {"offset": 0.2})], (0.36, 0.0, 0.0)),
        ((0.04, 0.5), [("gated_driver", {"offset": 0.2, "least": 0.05})], (0.18, 0.0, 2.25)),
        ((0.5, 0.5), [("slew_rate", {"rise": 1.2})], (0.3, 0.0, 0.0)),
        ((0.3, 0.3), [("command_quantisation", {"step": 0.22})], (0.132, 0.0, 0.0)),
        ((0.3, 0.3), [("square_levels", {"levels": 4})], (0.15, 0.0, 0.0)),
        ((0.5, 0.5), [("wheel_gain", {"left": 0.8})], (0.27, 0.0, 0.375)),
        ((0.5, 0.5), [("battery_sag", {"load": 0.4})], (0.24, 0.0, 0.0)),
        ((0.5, 0.5), [("thermal_fade", {"loss": 0.4, "tau": 0.5})], (0.24, 0.0, 0.0)),
        ((0.5, 0.5), [("case_and_winding", {"loss": 0.4, "fast": 0.3, "slow": 0.5})], (0.24, 0.0, 0.0)),
        ((0.5, 0.5), [("backlash", {"gap": 0.8})], (0.3, 0.0, 0.0)),
        ((0.5, 0.5), [("rubber_backlash", {"gap": 0.8})], (0.3, 0.0, 0.0)),
        ((0.0, 0.8), [("yaw_scrub", {"baseline": 0.2})], (0.24, 0.0, 2.4)),
        ((0.3, 0.7), [("scrub_when_slow", {"share": 0.5})], (0.3, 0.0, 1.5 * (1.0 - 0.5 * np.exp(-1.0)))),
        ((0.0, 1.0), [("understeer", {"gain": 1.0})], (0.3, 0.0, 3.75 / 1.3)),
        ((0.0, 1.0), [("understeer_with_square", {"gain": 1.0})], (0.3, 0.0, 3.75 / 1.09)),
        ((0.0, 1.0), [("yaw_lag", {"tau": 0.3})], (0.3, 0.0, 3.75)),
        ((0.0, 1.0), [("turn_slip", {"loss": 0.1})], (0.1875, 0.0, 3.75)),
        ((0.6, -0.2), [("turn_slip_with_root", {"loss": 0.1})], (0.12 * (1.0 - 0.1 * np.sqrt(3.0)), 0.0, -3.0)),
        ((0.0, 1.0), [("lateral_slip", {"slip": 0.1})], (0.3, -0.1125, 3.75)),
        ((0.0, 1.0), [("slip_angle", {"slip": 0.1, "most": 0.15})], (0.3, -0.045 * np.tanh(2.5), 3.75)),
        ((0.0, 0.8), [("cross_coupling", {"ahead": 0.01, "turn": -0.5})], (0.33, 0.0, 2.88)),
        ((0.5, 0.5), [("watchdog", {"hold": 0.8})], (0.0, 0.0, 0.0)),
        ((0.5, -0.3), [("sticky_throttle", {"play": 0.1})], (0.06, 0.0, -2.25)),
        ((0.6, 0.2), [("shared_current", {"limit": 0.4})], (0.12, 0.0, -0.75)),
        ((0.5, 0.5), [("biased_driver", {"bias": 0.1})], (0.33, 0.0, -0.375)),
        ((0.5, 0.4), [("leaking_voltage", {"share": 0.25})], (0.24, 0.0, 0.0)),
        ((0.5, 0.5), [("warm_trim", {"gain": 0.2, "tau": 0.5})], (0.3, 0.0, 0.375)),
        ((0.5, 0.5), [("overshooting_motor", {"hz": 2.0, "damping": 0.5})], (0.3, 0.0, 0.0)),
        ((0.5, 0.5), [("coasting", {"tau": 0.9})], (0.3, 0.0, 0.0)),
        ((0.5, 0.5), [("wheelspin", {"gain": 0.25})], (0.3, 0.0, 0.0)),
        ((0.0, 0.8), [("grip_limit", {"most": 0.24})], (0.24, 0.0, 1.0)),
        ((0.8, 0.0), [("turn_limit", {"most": 0.9})], (0.24, 0.0, -0.9)),
        ((0.0, 0.8), [("weak_left_turns", {"factor": 0.8})], (0.24, 0.0, 2.4)),
        ((0.8, 0.0), [("weak_left_turns", {"factor": 0.8})], (0.24, 0.0, -3.0)),
        ((0.5, 0.5), [("caster_flip", {"kick": 4.0, "metres": 0.15})], (0.3, 0.0, 0.0)),
        ((0.5, 0.5), [("tail_swing", {"gain": 0.1})], (0.3, 0.0, 0.0)),
    ],
    ids=lambda value: value[0][0] if isinstance(value, list) and value else None,
)
def test_a_held_duty_ends_in_the_twist_worked_out_by_hand(duty, effects, twist, integration):
    ended = twists(held(*duty, seconds=7.0), *effects, integration=integration)[-1]
    np.testing.assert_allclose(ended, twist, atol=1e-5)


def test_an_exact_motor_covers_the_way_of_the_formula_and_an_exact_circle_closes():
    ahead = np.cumsum(twists(held(1.0, 1.0))[:, 0])[399] / 400
    assert ahead == pytest.approx(0.6 * (1.0 - 0.2 * (1.0 - np.exp(-5.0))), abs=1e-12)
    turn_s = 2.0 * np.pi / 1.5
    turned = moved(held(0.2, 0.6, seconds=8.0))[[60, 120], 2]
    assert turned[1] - turned[0] == pytest.approx(2.0 * np.pi * 3.0 / turn_s, abs=1e-6)
    before, after = moved(held(0.2, 0.6, seconds=8.0))[[60, 80]]
    assert np.hypot(*(after - before)[:2]) == pytest.approx(2.0 * 0.16 * np.sin(0.75), abs=1e-6)


@pytest.mark.parametrize(("tau", "wheel", "reached"), [(0.5, "both", (0.5, 0.5)), (0.4, "left", (0.4, 0.2))])
def test_motor_lag_is_the_time_constant_of_its_wheels(tau, wheel, reached):
    forward, _, yaw = twists(held(1.0, 1.0), ("motor_lag", {"tau": tau, "wheel": wheel})).T
    for side, seconds in zip((-1.0, 1.0), reached, strict=True):
        speed = forward + side * 0.08 * yaw
        assert np.flatnonzero(speed > 0.6 * (1.0 - np.exp(-1.0)))[0] / 400 == pytest.approx(seconds, abs=0.003)


def test_motors_overshoot_and_coast_and_a_driver_brakes_before_reversing_and_kicks_after_a_rest():
    forward = twists(held(1.0, 1.0), ("overshooting_motor", {"hz": 0.9, "damping": 0.25}))[:, 0]
    assert forward.max() == pytest.approx(0.6 * (1.0 + np.exp(-np.pi * 0.25 / np.sqrt(1.0 - 0.25**2))), abs=1e-4)
    duties = held(1.0, 1.0, 8.0)
    duties[:, 80:] = 0.0
    forward = twists(duties, ("coasting", {"tau": 0.9}))[:, 0]
    assert forward[1600 + 360] == pytest.approx(0.6 * np.exp(-1.0), rel=5e-3)
    forward, _, yaw = twists(held(0.5, 0.5, 6.0), trim=0.1)[-1]
    assert yaw / forward == pytest.approx(1.25)
    assert np.flatnonzero(twists(held(0.5, 0.5), delay=0.135)[:, 0])[0] == 54
    duties = held(0.5, 0.5, 8.0)
    duties[:, 80:] = -0.5
    plain, braked = (twists(duties, *effects)[:, 0] for effects in ([], [("brake_before_reversing", {"pause": 0.5})]))
    np.testing.assert_allclose(braked[:1600], plain[:1600])
    assert braked[1600:1800].min() > 0.0
    kicked = twists(duties, ("kick_start", {"kick": 0.9, "pulse": 0.15}))[:, 0]
    assert kicked[60] == pytest.approx(0.54 * (1.0 - np.exp(-0.75)), rel=0.02)
    np.testing.assert_allclose(kicked[2400:], plain[2400:], atol=2e-3)


def test_casters_and_tails_turn_the_robot_after_changes_only():
    duties = held(0.5, 0.5, 8.0)
    duties[:, 80:] = -0.5
    heading = moved(duties, ("caster_flip", {"kick": 4.0, "metres": 0.15}))[:, 2]
    assert not heading[:80].any()
    assert heading[-1] == pytest.approx(-4.0 * 0.15, rel=0.02)
    assert moved(held(0.5, 0.5), ("tail_swing", {"gain": 0.1}))[-1, 1] == pytest.approx(0.03, rel=1e-3)


def test_messages_are_dropped_polled_and_averaged_as_said():
    ramp = np.linspace(0.0, 1.0, 4001)[None, :, None] * np.ones(2)
    dropped = second._passed(second.SENT, robot(("dropped_commands", {"probability": 0.3})), ramp, _run(ramp))
    assert np.mean(np.diff(dropped[0, :, 0]) == 0.0) == pytest.approx(0.3, abs=0.03)
    late = second.ARRIVED["polled_commands"](np.arange(4000)[None] * 0.05, _run(ramp), period=0.23)
    assert np.mean(late - np.arange(4000) * 0.05) == pytest.approx(0.115, abs=0.01)
    np.testing.assert_allclose(second.SENT["moving_average"](ramp, _run(ramp), rows=5)[0, 4:, 0], ramp[0, 2:-2, 0])


def _run(duties):
    return second.Run(np.random.default_rng(1), 0.05, True, duties)


@pytest.mark.parametrize(("heading", "speed"), [(0.0, 0.27), (np.pi, 0.33), (np.pi / 2, 0.28)])
def test_a_slope_takes_speed_uphill(heading, speed):
    slope = ("floor_slope", {"x": 0.03, "y": 0.02})
    way = moved(held(0.5, 0.5), slope, start=(0.0, 0.0, heading), integration="coarse")
    assert np.hypot(*(way[-1] - way[-21])[:2]) == pytest.approx(speed, abs=1e-6)


@pytest.mark.parametrize("integration", ["exact", "coarse"])
def test_going_step_by_step_leads_along_the_same_path(integration):
    course = second.plan(3, 2, 100)
    level = second.driven(robot(("floor_slope", {"x": 0.0, "y": 0.0}), integration=integration), course, 1.0)
    np.testing.assert_allclose(level, second.driven(robot(integration=integration), course, 1.0), atol=1e-9)


def test_wind_moves_a_robot_at_rest_a_tilt_one_that_heads_north_and_noise_walks_with_the_way_alone():
    blown = moved(held(0.0, 0.0), ("gusts", {"speed": 0.04, "period": 8.0}), start=(0.0, 0.0, 2.0))
    np.testing.assert_allclose(blown[-1, :2], (0.04 * 8.0 / np.pi, 0.0), atol=1e-3)
    turned = moved(held(0.5, 0.5, 2.0), ("turning_tilt", {"gain": 0.01}), start=(0.0, 0.0, np.pi / 2))[-1]
    assert turned[2] - np.pi / 2 == pytest.approx(0.01 * turned[1], rel=1e-3)
    walked = second._walk(PLAIN, np.tile((0.4, 0.0, 0.0), (200, 4000, 1))).sum(axis=1) / 400
    np.testing.assert_allclose(walked.std(axis=0), 2.0 * np.array(second.PER_METRE), rtol=0.15)
    assert not second._walk(PLAIN, np.zeros((2, 400, 3))).any()


@pytest.mark.parametrize(
    ("effect", "figures", "seen"),
    [
        ("marker_offset", {"ahead": 0.04, "left": 0.01}, (0.99, 2.04, np.pi / 2)),
        ("heading_offset", {"degrees": -2.0}, (1.0, 2.0, np.pi / 2 - np.pi / 90)),
        ("stretched_axis", {"factor": 0.85}, (1.0, 1.7, np.pi / 2)),
        ("skewed_headings", {"size": 0.12}, (1.0, 2.0, np.pi / 2)),
        ("warped_tracker", {"size": 0.06, "metres": 0.5}, (1 + 0.06 * np.sin(2), 2 + 0.06 * np.sin(4), np.pi / 2)),
        ("smoothed_poses", {"tau": 0.15}, (1.0, 2.0, np.pi / 2)),
    ],
)
def test_a_tracker_reports_what_was_worked_out_by_hand(effect, figures, seen):
    poses = np.array([[(1.0, 2.0, np.pi / 2)]])
    np.testing.assert_allclose(second._passed(second.TRACKED, robot((effect, figures)), poses)[0, 0], seen, atol=1e-12)


@pytest.mark.slow
@pytest.mark.parametrize("case", CASES.values(), ids=CASES)
def test_what_is_hidden_moves_the_robot_by_more_than_the_noise(case):
    seconds = 12.0 if any(name in second.PLACES for name, _ in case.effects) else 30.0
    short = {"episodes": 3, "seconds": seconds, "noiseless": True}
    quick = replace(case, integration="coarse")
    level = LEVELS[case.noise.split()[0]]
    assert apart_m(poses(quick, **short), poses(replace(quick, effects=()), **short)) > 0.9 * level * NOISE_M


@pytest.mark.parametrize("noise", NOISES)
def test_the_noise_of_two_seconds_is_about_a_centimetre_or_half_of_it(noise):
    case = replace(CLEAN[0], noise=noise)
    short = {"episodes": 12, "seconds": 20.0}
    share = apart_m(poses(case, **short), poses(case, **short, noiseless=True)) / LEVELS[noise.split()[0]]
    assert 0.7 * NOISE_M < share < NOISE_M


@pytest.mark.parametrize(("noise", "kurtosis", "kept"), [("normal heavy", 9.0, 0.0), ("normal coloured", 3.0, 0.358)])
def test_a_pose_has_the_stated_noise(noise, kurtosis, kept):
    seen = second.noisy(replace(PLAIN, noise=noise), (40, 4000, 3))
    np.testing.assert_allclose(seen.std(axis=(0, 1)), (0.002, 0.002, 0.005), rtol=0.03)
    unit = seen / seen.std(axis=(0, 1))
    assert np.mean(unit**4) == pytest.approx(kurtosis, rel=0.25)
    assert np.mean(unit[:, 1:] * unit[:, :-1]) == pytest.approx(kept, abs=0.02)


def test_there_are_enough_cases_of_every_kind_hiding_every_effect_and_no_name_or_seed_is_twice():
    for cases, least in ((IN_FORM, 45), (OTHER_FORM, 10), (PAIRS, 10), (OUTSIDE, 20), (CLEAN, 12)):
        assert len(cases) >= least
    counts = {name: sum(name in case.right[0] for case in IN_FORM) for name in MOTION_EFFECTS}
    assert all(count >= 2 for count in counts.values()), counts
    assert sum("wheel" in dict(case.effects[0][1]) for case in IN_FORM) >= 6
    cases = (*CASES.values(), *CLEAN)
    assert len({case.seed for case in cases}) == len({case.name for case in cases}) == len(cases)
    first = (*hidden.IN_FORM, *hidden.OTHER_FORM, *hidden.PAIRS, *hidden.OUTSIDE, *hidden.CLEAN)
    assert not {case.name for case in cases} & {case.name for case in first}
    tables = (hidden.MESSAGES, hidden.ARRIVAL, hidden.DUTY, hidden.TARGET, hidden.MOTORS, hidden.WHEELS)
    known = {name for table in (*tables, hidden.TWIST, hidden.PLACES, hidden.MEASURED) for name in table}
    assert not known & {case.effects[0][0] for case in (*OUTSIDE, *OTHER_FORM)}


def test_every_case_says_what_is_right_or_what_its_effect_depends_on_and_half_are_coarse():
    for case in CASES.values():
        assert {name for names in case.right for name in names} <= MOTION_EFFECTS | {"inertia", "reversal_pause"}
        assert len(case.right) == (0 if case.depends_on else len(case.effects))
    for kind in (IN_FORM, OTHER_FORM, PAIRS, OUTSIDE, CLEAN):
        assert 0.4 < np.mean([case.integration == "coarse" for case in kind]) < 0.6
    assert {case.noise for case in CASES.values()} == set(NOISES)


@pytest.mark.parametrize("name", ["second exponential_jitter mean 0.06", "second gusts", "second clean 3"])
def test_the_same_seed_gives_the_same_log_and_another_seed_another(name):
    case, short = {**CASES, **{case.name: case for case in CLEAN}}[name], {"episodes": 2, "seconds": 5.0}
    np.testing.assert_array_equal(poses(case, **short), poses(case, **short))
    assert not np.array_equal(poses(case, **short), poses(replace(case, seed=1), **short))
    loud, quiet = make_log(case, **short), make_log(case, **short, noiseless=True)
    for one, other in zip(loud.episodes, quiet.episodes, strict=True):
        np.testing.assert_array_equal(one.commands, other.commands)
        np.testing.assert_allclose(one.poses[0], other.poses[0], atol=0.06)


def test_two_of_twelve_drives_are_driven_again_from_nearly_the_same_pose():
    duties, starts = second.plan(3, 12, 1200)
    assert np.abs(duties).max() <= 1.0
    flat = duties.reshape(12, -1)
    again = [(a, b) for a in range(12) for b in range(a) if np.array_equal(flat[a], flat[b])]
    assert [a for a, _ in again] == [5, 11]
    assert all(np.abs(starts[a] - starts[b]).max() < 0.1 for a, b in again)
