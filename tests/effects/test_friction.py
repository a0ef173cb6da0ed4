"""Effects on the wheels, from dead band to battery sag, against what they should do by hand."""

import numpy as np
import pytest
from filtered import filtered

from proxytune.effects import FilterContext, effect
from proxytune.effects.command import ReversalPause
from proxytune.effects.friction import Backlash, DeadBand, Stiction, WheelRipple
from proxytune.effects.motors import BatterySag, Saturation, SlewRate, ThermalFade

NOMINAL = {"full_speed": 0.6, "wheel_radius": 0.03}
FULL_RAD_S = 20.0
RATE_HZ = 10.0


def run(effect, left, right=None, rest=0.0):
    signal = np.stack((left, left if right is None else right), axis=-1).astype(float)
    return filtered(effect, signal, rate_hz=RATE_HZ, rest=rest, nominal=NOMINAL)


def test_a_dead_band_swallows_small_duties_and_stiction_is_the_trigger_written_as_a_loop():
    duties = [0.0, 0.05, 0.1, 0.3, -0.05, -0.1, -1.0]
    np.testing.assert_allclose(run(DeadBand(0.1, 0.0), duties)[:, 0], [0, 0, 0, 0.2, 0, 0, -0.9], atol=1e-12)
    np.testing.assert_allclose(run(DeadBand(0.1, -0.5), [0.5]), [[0.35, 0.45]])
    duties = np.repeat(np.random.default_rng(3).normal(0.0, 0.3, (400, 2)), 2, axis=0)
    expected = np.stack([schmitt(duties[:, side], width) for side, width in ((0, 0.12), (1, 0.36))], axis=-1)
    np.testing.assert_array_equal(run(Stiction(0.24, 0.5, 0.5, 1.0), *duties.T), expected)


@pytest.mark.parametrize(
    ("duties", "expected"),
    [
        ([0.1, 0.19, 0.2, 0.19, 0.1, 0.09, 0.19], [0, 0, 0.2, 0.19, 0.1, 0, 0]),  # starts at 0.2, stops below 0.1
        ([0.3, -0.15, -0.15, 0.15], [0.3, 0, 0, 0]),  # reversed below breakaway: rests until broken away
        ([0.3, -0.25, -0.15, -0.05], [0.3, -0.25, -0.15, 0]),  # reversed at breakaway: goes on
        ([-0.2, -0.1, -0.09], [-0.2, -0.1, 0]),
        ([0.15, 0.0, 0.15], [0, 0, 0]),
    ],
)
def test_a_resting_wheel_breaks_away_and_a_moving_one_goes_on_to_half_of_it(duties, expected):
    np.testing.assert_array_equal(run(Stiction(0.2, 0.0, 0.5, 1.0), duties)[:, 0], expected)


@pytest.mark.parametrize(("reversal", "turned"), [(0.0, -0.15), (0.4, -0.15), (0.6, 0.0), (1.0, 0.0)])
def test_a_wheel_with_momentum_runs_through_its_reversal(reversal, turned):
    np.testing.assert_array_equal(run(Stiction(0.2, 0.0, 0.5, reversal), [0.3, -0.15, -0.09])[:, 0], [0.3, turned, 0.0])


@pytest.mark.parametrize(("rest", "first"), [(0.3, 0.15), (0.12, 0.15), (-0.3, 0.0), (0.05, 0.0)])
def test_a_wheel_that_turned_before_the_start_goes_on(rest, first):
    assert run(Stiction(0.2, 0.0, 0.5, 1.0), [0.15], rest=rest)[0, 0] == first


def schmitt(duties, breakaway):
    moving, before, out = False, 0.0, []
    for duty in duties:
        if abs(duty) >= breakaway:
            moving = True
        elif abs(duty) < breakaway / 2 or duty * before < 0:
            moving = False
        out.append(duty if moving else 0.0)
        before = duty
    return out


@pytest.mark.parametrize("batch", [(), (3,), (2, 3)])
@pytest.mark.parametrize("reversal", [0.0, 0.5, 1.0])
def test_stiction_is_to_the_last_bit_the_same_compiled(monkeypatch, batch, reversal):
    signal = np.random.default_rng(4).normal(0.0, 0.3, (*batch, 300, 2)).round(1)
    context = FilterContext(RATE_HZ, np.linspace(-0.4, 0.4, 2 * int(np.prod(batch))).reshape(*batch, 2), NOMINAL)
    stiction = Stiction(0.3, 0.2, 0.5, reversal)
    ways = []
    for used in (-np.inf, effect.PAYS_OFF):
        monkeypatch.setattr(effect, "_filtered", [used])
        passed, state = stiction.apply(signal, stiction.begin(context))
        ways.append([(one.shape, one.tobytes()) for one in (passed, *state)])
    assert ways[0] == ways[1]
    assert 0.1 < np.mean(passed == 0.0) < 0.9


def test_a_gear_turns_half_its_gap_before_the_wheel_starts_and_all_of_it_when_it_reverses():
    # 0.05 of full speed for 0.1 s is 0.1 rad
    turned = run(Backlash(0.4, 0.0), np.array([0.05] * 4 + [-0.05] * 6))[:, 0].cumsum() * FULL_RAD_S / RATE_HZ
    np.testing.assert_allclose(turned, [0, 0, 0.1, 0.2, 0.2, 0.2, 0.2, 0.2, 0.1, 0.0], atol=1e-12)


def play(speeds, gap):
    gear = wheel = 0.0
    out = []
    for speed in speeds * FULL_RAD_S / RATE_HZ:
        gear += speed
        after = min(max(wheel, gear - gap / 2), gear + gap / 2)
        out.append((after - wheel) * RATE_HZ / FULL_RAD_S)
        wheel = after
    return out


@pytest.mark.parametrize("length", [1, 2, 3, 63, 64, 65, 500])
def test_backlash_is_the_play_operator_written_as_a_loop(length):
    speeds = np.random.default_rng(length).normal(0.02, 0.2, (length, 2))
    expected = np.stack([play(speeds[:, side], gap) for side, gap in ((0, 0.9), (1, 0.3))], axis=-1)
    np.testing.assert_allclose(run(Backlash(0.6, -0.5), *speeds.T), expected, atol=1e-12)


RIPPLE_RATE_HZ, RADIUS, BASELINE = 600.0, 0.03, 0.16
RIPPLE_NOMINAL = {"wheel_radius": RADIUS, "effective_baseline": BASELINE}


def wheels(effect, forward, samples, angles=((0.0, 0.0),)):
    """Speeds of the left and the right wheel over a straight drive."""
    context = FilterContext(RIPPLE_RATE_HZ, np.zeros(3), RIPPLE_NOMINAL, angles=np.array(angles))
    moved = effect.apply(np.tile((forward, 0.0, 0.0), (samples, 1)), effect.begin(context))[0]
    turn = moved[:, 2] * BASELINE / 2.0
    return np.stack((moved[:, 0] - turn, moved[:, 0] + turn), axis=-1)


def test_one_wheel_ripples_by_its_angle_and_rolls_as_far_as_a_round_one():
    left, right = wheels(WheelRipple(0.2, 0.1, 0.0, 0.0), 0.3, 600).T
    angle = (np.arange(600) + 0.5) * 0.3 / RADIUS / RIPPLE_RATE_HZ
    np.testing.assert_allclose(left, 0.3 * (1.0 + 0.2 * np.sin(angle) + 0.1 * np.cos(angle)))
    np.testing.assert_allclose(right, 0.3)
    turn = round(2.0 * np.pi * RADIUS / 0.3 * RIPPLE_RATE_HZ)
    rolled = wheels(WheelRipple(0.0, 0.0, 0.3, 0.2), 0.3, turn)[:, 1].sum() / RIPPLE_RATE_HZ
    assert rolled == pytest.approx(2.0 * np.pi * RADIUS, rel=0.005)
    ahead = wheels(WheelRipple(0.2, 0.0, 0.2, 0.0), 1e-9, 1, angles=((np.pi / 2, -np.pi / 2),))[0] / 1e-9
    np.testing.assert_allclose(ahead, (1.2, 0.8), atol=1e-6)


def test_a_duty_rises_at_its_rate_and_a_motor_loses_by_long_work_and_recovers_at_rest():
    risen = filtered(SlewRate(0.5), np.ones((60, 2)))
    np.testing.assert_allclose(risen[:30, 0], np.arange(1, 31) / 30.0)
    np.testing.assert_array_equal(risen[30:], 1.0)
    np.testing.assert_array_equal(filtered(SlewRate(0.5), [[0.03, -0.03]]), [[0.03, -0.03]])
    np.testing.assert_allclose(filtered(SlewRate(1.0), [[1.0, 1.0]], rest=(0.5, -0.5)), [[0.5 + 1 / 60, -0.5 + 1 / 60]])
    tired = filtered(ThermalFade(0.3, 2.0), np.tile((1.0, -1.0), (60 * 20, 1)))
    np.testing.assert_allclose(tired[-1], (0.7, -0.7), atol=1e-3)
    assert tired[0, 0] == pytest.approx(1.0, abs=0.01)
    work, rest = np.ones((600, 2)), np.zeros((600, 2))
    tired = filtered(ThermalFade(0.4, 2.0), np.concatenate((work, rest, work)))
    assert tired[599, 0] == pytest.approx(0.6, abs=0.01)
    assert tired[1200, 0] > 0.99


def test_a_wheel_rests_before_it_turns_the_other_way_and_a_stand_counts_as_rest_or_not():
    turned = np.concatenate((np.ones((60, 2)), -np.ones((60, 2))))
    rests = filtered(ReversalPause(0.375, 1.0), turned)
    np.testing.assert_array_equal(rests[:60], 1.0)
    np.testing.assert_array_equal(rests[60:82], 0.0)
    np.testing.assert_allclose(rests[82], -0.5)
    np.testing.assert_array_equal(rests[83:], -1.0)
    stood = np.concatenate((turned[:60], np.zeros((20, 2)), turned[60:]))
    for stand, samples in ((1.0, 10), (0.5, 20), (0.0, 30)):
        rests = filtered(ReversalPause(0.5, stand), stood)[:, 0]
        assert np.count_nonzero(rests[80:] == 0.0) == samples
    again = np.concatenate((np.ones((60, 2)), np.zeros((5, 2)), np.ones((60, 2))))
    np.testing.assert_array_equal(filtered(ReversalPause(0.5, 1.0), again), again)
    np.testing.assert_array_equal(filtered(ReversalPause(0.5, 1.0), turned[60:]), turned[60:])
    np.testing.assert_array_equal(filtered(ReversalPause(0.5, 1.0), turned[60:], rest=(1.0, 0.0))[0], (0.0, -1.0))


@pytest.mark.parametrize(
    ("limit", "imbalance", "left", "right"),
    [(0.6, 0.0, 0.6, 0.6), (0.6, -1.0, 0.2, 1.0), (0.6, 0.5, 0.8, 0.4), (0.2, 1.0, 1.0, 0.05)],
)
def test_saturation_shares_the_lost_part_and_leaves_a_twentieth(limit, imbalance, left, right):
    clipped = filtered(Saturation(limit, imbalance), [[1.0, 1.0], [-1.0, -1.0], [0.03, -0.04]], rate_hz=RATE_HZ)
    np.testing.assert_allclose(clipped, [[left, right], [-left, -right], [0.03, -0.04]])


def test_a_battery_slows_both_wheels_by_what_was_driven_and_turns_none_round():
    np.testing.assert_allclose(filtered(BatterySag(0.2, 0.0, 0.0), [[1.0, -0.5]], rate_hz=RATE_HZ), [[0.85, -0.425]])
    faded = filtered(BatterySag(0.0, 0.5, 0.0), np.full((1200, 2), (0.3, -0.5)), rate_hz=RATE_HZ)
    np.testing.assert_allclose(faded[-1], np.array((0.3, -0.5)) * np.exp(-0.5 * 0.4 * 2.0), rtol=1e-3)
    np.testing.assert_allclose(faded[0], (0.3, -0.5), rtol=1e-3)
    coarse = filtered(BatterySag(0.0, 1.0, 0.0), np.full((600, 2), 0.8), rate_hz=10.0)
    fine = filtered(BatterySag(0.0, 1.0, 0.0), np.full((6000, 2), 0.8), rate_hz=100.0)
    np.testing.assert_allclose(coarse, fine.reshape(600, 10, 2).mean(axis=1), rtol=1e-6)
    np.testing.assert_array_equal(filtered(BatterySag(0.8, 0.0, 0.0), [[2.0, 2.0]], rate_hz=RATE_HZ), [[0.0, 0.0]])
