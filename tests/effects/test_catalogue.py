"""The catalogue is in the order in which the signal meets effects, each of which keeps what effects promise."""

import numpy as np
import pytest
from filtered import filtered

from proxytune.driving import read_robot
from proxytune.effects import CAR_CATALOGUE, CATALOGUE, PARAMETERS, Blur, FilterContext, Stage, effects_from
from proxytune.effects.command import CommandQuantisation, Delay
from proxytune.effects.model import stage_chain
from proxytune.effects.motors import DriverMap, MotorLag
from proxytune.space import Parameter
from proxytune.testing.effect import Subject, check_effect

ROBOT = read_robot("duckiebot")

ORDER = (
    # command: what happens on the way to the robot, before the command arrives
    "delay_jitter", "dropped_commands", "command_quantisation", "reversal_pause", "delay",
    # actuation: controller, driver, friction, limits, wheels, motors, gears
    "slew_rate", "driver_map", "dead_band", "stiction", "saturation", "trim", "wheel_gain",
    "battery_sag", "thermal_fade", "motor_lag", "backlash", "wheel_ripple",
    # motion: from wheels to the body, then the floor
    "yaw_scrub", "understeer", "yaw_lag", "inertia", "turn_slip", "lateral_slip", "cross_coupling",
    "floor_slope", "slippery_patch",
    # measurement, camera, image
    "marker_offset", "heading_offset",
    "camera_pitch", "camera_roll", "camera_yaw", "camera_height", "camera_forward",
    "field_of_view", "lens_distortion", "lens_centre", "pixel_aspect",
    # first what mixes pictures, then what the lens and last what the sensor does to each
    "blur", "rolling_shutter", "camera_latency", "defocus", "vignetting", "exposure", "image_noise",
)  # fmt: skip


def wheels(theta, duty):
    """Both wheels' speeds, as shares of full speed, at a steady duty."""
    chain = stage_chain(effects_from(theta, ROBOT.figures), Stage.ACTUATION)
    return chain.apply(np.full((600, 2), duty), chain.begin(FilterContext(60.0, np.zeros(2), ROBOT.figures)))[0][-1]


def test_effects_come_in_the_order_in_which_the_signal_meets_them():
    assert tuple(CATALOGUE) == ORDER
    theta = {"motor_lag.time_constant": 0.1, "trim": 0.1, "dead_band.width": 0.1, "driver_map": 0.2, "delay": 0.1}
    names = [effect.name for effect in effects_from(theta, ROBOT.figures)]
    assert names == ["delay", "driver_map", "dead_band", "trim", "motor_lag"]
    with pytest.raises(TypeError, match="positional"):
        Parameter("trim", "", -0.5, 0.5, 0.0)


@pytest.mark.parametrize(
    ("theta", "duty", "speeds"),
    [
        ({"driver_map": 0.3, "dead_band.width": 0.1}, 0.02, [0.314 - 0.1] * 2),
        ({"saturation.limit": 0.5, "trim": 0.2}, 1.0, [0.4, 0.6]),
        ({"dead_band.width": 0.2, "wheel_gain.left": 0.5, "wheel_gain.right": 1.5}, 0.6, [0.2, 0.6]),
    ],
    ids=["the driver, then friction", "the driver's limit, then trim", "friction, then gains"],
)
def test_the_order_changes_what_comes_out(theta, duty, speeds):
    assert wheels(theta, duty) == pytest.approx(speeds)


IMBALANCED = [name for name, effect in CATALOGUE.items() if f"{name}.imbalance" in PARAMETERS]
FLAT = [name for name, effect in CATALOGUE.items() if effect.stage not in (Stage.CAMERA, Stage.IMAGE)]


def subject(name):
    return Subject(CATALOGUE[name], ROBOT, name)


@pytest.mark.parametrize(
    "name", [pytest.param(one, marks=pytest.mark.slow) if one == "slippery_patch" else one for one in CATALOGUE]
)
def test_every_effect_keeps_what_effects_promise(name):
    check_effect(CATALOGUE[name], robot=ROBOT)


OF_CARS = [name for name, effect in CAR_CATALOGUE.items() if effect not in CATALOGUE.values()]


@pytest.mark.parametrize("name", OF_CARS)
def test_every_effect_of_a_car_keeps_what_effects_promise(name):
    check_effect(CAR_CATALOGUE[name], robot=read_robot("car"))


@pytest.mark.parametrize("name", IMBALANCED)
@pytest.mark.parametrize("imbalance", [-1.0, 0.3, 1.0])
def test_an_imbalance_of_nothing_changes_nothing(name, imbalance):
    lagging = {"time_constant": 0.0} if name == "motor_lag" else {}
    signal, tried = subject(name).signal(1), subject(name)
    np.testing.assert_array_equal(tried.filtered(tried.at({"imbalance": imbalance, **lagging}), signal), signal)


@pytest.mark.parametrize("name", IMBALANCED)
@pytest.mark.parametrize(("imbalance", "wheel"), [(-1.0, "left"), (1.0, "right")])
def test_an_imbalance_of_one_leaves_the_other_wheel_alone(name, imbalance, wheel):
    signal, tried = subject(name).signal(1), subject(name)
    moved = np.abs(tried.filtered(tried.moved(CATALOGUE[name].parameters[1], imbalance), signal) - signal).max(axis=0)
    here, there = moved if wheel == "left" else moved[::-1]
    assert here > 0.0
    assert there == 0.0


@pytest.mark.parametrize("name", CATALOGUE)
def test_every_effect_has_bounds_with_a_source_and_a_trace_in_motion_unless_it_bends_pictures_alone(name):
    for parameter in CATALOGUE[name].parameters:
        assert parameter.low <= parameter.neutral_value(ROBOT.figures) <= parameter.high
        assert parameter.source
        assert len(parameter.probes) >= 4
        assert all(parameter.low <= probe <= parameter.high for probe in parameter.probes)
    assert (CATALOGUE[name].trace is None) == (name not in FLAT)


@pytest.mark.parametrize("name", FLAT)
def test_the_forms_of_an_effect_name_its_own_parameters_and_no_form_twice(name):
    known = {parameter.name for parameter in CATALOGUE[name].parameters}
    forms = CATALOGUE[name].trace.forms
    assert len({form.name for form in forms}) == len(forms)
    for form in forms:
        free = {parameter for coordinate in form.free for parameter in coordinate}
        assert free <= known
        assert set(form.fixed) <= known - free
        assert set(form.moved) <= free
    assert CATALOGUE[name].trace.cues


@pytest.mark.parametrize("name", [name for name in FLAT if CATALOGUE[name].trace.draws])
def test_an_effect_that_draws_tells_how_late_commands_are_about_their_mean(name):
    (parameter,) = CATALOGUE[name].parameters
    draws = CATALOGUE[name].trace.draws
    assert parameter.low < draws.sizes[0] < draws.sizes[1] <= parameter.high
    late = draws.lateness(draws.sizes[0] * 5.0, 20.0)
    weights = np.exp(late.log_weights)
    assert late.mean_s > 0.0
    assert weights.sum() == pytest.approx(1.0, abs=1e-3)
    assert weights @ late.commands == pytest.approx(0.0, abs=1e-3)


def run(effect, signal, rest=0.0, rate_hz=10.0):
    return filtered(effect, signal, rate_hz=rate_hz, rest=rest, nominal={})


def step(length=20):
    return np.ones((length, 2))


@pytest.mark.parametrize(("seconds", "expected"), [(0.0, [1, 1, 1]), (0.1, [0, 1, 1]), (0.25, [0, 0, 0.5])])
def test_delay_is_exact_for_whole_samples_and_splits_one_between_them(seconds, expected):
    np.testing.assert_allclose(run(Delay(seconds), step(3))[:, 0], expected, atol=1e-12)


def test_delay_and_blur_are_continuous_in_their_values():
    signal = np.random.default_rng(0).uniform(-1, 1, (50, 2))
    outputs = np.array([run(Delay(value), signal) for value in np.linspace(0.0, 0.3, 301)])
    assert np.abs(np.diff(outputs, axis=0)).max() < 2 * 0.001 * 10.0 + 1e-9
    scene = np.random.default_rng(1).uniform(0, 255, (20, 4))
    outputs = np.array([run(Blur(value), scene)[10:] for value in np.linspace(0.01, 0.4, 800)])
    assert np.abs(np.diff(outputs, axis=0)).max() < 15.0


def test_commands_and_motors_answer_by_their_formulas():
    duty = np.array([[0.0, 0.005], [0.01, 1.0], [-0.5, 0.5]])
    offset = 60 / 255
    low, half = offset + 0.01 * (1 - offset), offset + 0.5 * (1 - offset)
    expected = [[0.0, 0.0], [low, 1.0], [-half, half]]
    np.testing.assert_allclose(run(DriverMap(offset), duty), expected)

    time_constant, rate_hz = 0.2, 10.0
    edges = np.arange(21) / rate_hz
    travelled = edges + time_constant * np.exp(-edges / time_constant)  # integral of 1 - exp(-t/tau), plus a constant
    lagging = run(MotorLag(time_constant, 0.0), step())[:, 0]
    np.testing.assert_allclose(lagging, np.diff(travelled) * rate_hz, atol=1e-12)

    uneven = run(MotorLag(0.2, -0.5), step())
    np.testing.assert_allclose(uneven[:, 0], run(MotorLag(0.3, 0.0), step())[:, 0], atol=1e-12)
    np.testing.assert_allclose(uneven[:, 1], run(MotorLag(0.1, 0.0), step())[:, 1], atol=1e-12)

    duties = np.array([[0.0, 0.09], [0.11, 0.31], [-0.34, 1.0]])
    expected = [[0.0, 0.0], [0.2, 0.4], [-0.4, 1.0]]
    np.testing.assert_allclose(run(CommandQuantisation(0.2), duties), expected)


@pytest.mark.parametrize("samples", [0.4, 1.0, 2.0, 2.7, 5.3])
def test_blur_is_the_mean_of_a_scene_that_changes_linearly(samples):
    ramp = np.arange(30.0)[:, None] * np.ones(3)
    np.testing.assert_allclose(run(Blur(samples / 10.0), ramp)[10:], ramp[10:] - samples / 2.0, atol=1e-4)


@pytest.mark.parametrize("samples", [0.3, 1.0, 2.718, 6.0, 11.9])
def test_blur_adds_8_bit_pictures_exactly_in_any_order(samples):
    pictures = np.random.default_rng(2).integers(0, 256, (20, 50)).astype(np.float32)
    effect = Blur(samples / 10.0)
    memory = effect.begin(FilterContext(10.0, pictures[0], {}))
    weights = memory.weights.astype(np.float64)
    assert weights.sum() == 1.0
    exact = [weights @ pictures[row - len(weights) + 1 : row + 1].astype(np.float64) for row in range(13, 20)]
    np.testing.assert_array_equal(effect.apply(pictures, memory)[0][13:], exact)
