"""What every effect promises, run over the whole catalogue."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from proxytune.driving.robot import read_robot
from proxytune.effects import CATALOGUE, CHANNELS, PARAMETERS, Setting, Stage, effects_from, theta_names
from proxytune.space import Parameter

ROBOT = read_robot("duckiebot")
RATE_HZ = 60.0
PROBE_VALUES = [
    (name, theta_name, value)
    for name, effect in CATALOGUE.items()
    for theta_name, parameter in zip(theta_names(effect), effect.parameters, strict=True)
    for value in parameter.probes
]
PROBES = [pytest.param(*probe, id=f"{probe[1]}={probe[2]}") for probe in PROBE_VALUES]


IMBALANCED = [name for name, effect in CATALOGUE.items() if f"{name}.imbalance" in PARAMETERS]
FLAT = [name for name, effect in CATALOGUE.items() if effect.stage not in (Stage.CAMERA, Stage.IMAGE)]


def at(name, theta_name, value):
    """An effect with one value of its own; what only shapes an effect is of one that is there."""
    main = CATALOGUE[name].parameters[0]
    there = {theta_names(CATALOGUE[name])[0]: main.probes[2]} if PARAMETERS[theta_name].shape else {}
    (effect,) = effects_from({**there, theta_name: value}, ROBOT.figures)
    return effect


def a_signal(stage: Stage, seed: int, length: int = 90) -> np.ndarray:
    """Something a stage could meet: held commands, camera figures, or a changing picture."""
    random = np.random.default_rng(seed)
    if stage is Stage.CAMERA:
        return np.repeat(ROBOT.camera_figures().channels()[None], length, axis=0)
    if stage is Stage.IMAGE:
        return random.uniform(0.0, 255.0, (length, 12)).astype(np.float32)
    return np.repeat(random.uniform(-1.0, 1.0, (length // 3, len(CHANNELS[stage]))), 3, axis=0)


def everywhere():
    """Places along both axes that reach beyond every patch, nearest first, one after another and to and fro."""
    way = np.repeat(np.linspace(0.0, 21.0, 225), 2) * np.tile((1.0, -1.0), 225)
    along = np.stack((way, np.zeros_like(way)), axis=-1)
    return np.stack((along, along[:, ::-1]), axis=1).reshape(-1, 2)


EVERYWHERE = everywhere()


def setting_for(effect, rest, seed=7):
    """An effect of a place is shown one everywhere."""
    known = {"places": EVERYWHERE, "headings": np.zeros(len(EVERYWHERE))}
    return Setting(RATE_HZ, rest, ROBOT.figures, seed=seed, **(known if effect.trace and effect.trace.placed else {}))


def run(effect, signal, cuts=(), seed=7):
    rest = signal[0] if effect.stage in (Stage.IMAGE, Stage.CAMERA) else np.zeros(signal.shape[-1])
    memory = effect.begin(setting_for(effect, rest, seed))
    out = []
    for chunk in np.split(signal, sorted(cuts)):
        if len(chunk):
            filtered, memory = effect.apply(chunk, memory)
            out.append(filtered)
    return np.concatenate(out)


def neutral(name):
    return {
        theta_name: parameter.neutral_value(ROBOT.figures)
        for theta_name, parameter in zip(theta_names(CATALOGUE[name]), CATALOGUE[name].parameters, strict=True)
    }


@pytest.mark.parametrize("name", CATALOGUE)
def test_neutral_value_changes_nothing(name):
    (effect,) = effects_from(neutral(name), ROBOT.figures)
    signal = a_signal(effect.stage, 1)
    of_the_robot = {theta: ROBOT.theta[theta] for theta in neutral(name) if theta in ROBOT.theta}
    if any(isinstance(p.neutral, str) for p in effect.parameters) and of_the_robot and effect.stage is not Stage.CAMERA:
        nominal = effects_from(of_the_robot, ROBOT.figures)[0]
        np.testing.assert_array_equal(run(effect, signal), run(nominal, signal))
    else:
        np.testing.assert_array_equal(run(effect, signal), signal)


@pytest.mark.parametrize("name", IMBALANCED)
@pytest.mark.parametrize("imbalance", [-1.0, 0.3, 1.0])
def test_an_imbalance_of_nothing_changes_nothing(name, imbalance):
    theta = neutral(name) | {f"{name}.imbalance": imbalance}
    if name == "motor_lag":
        theta["motor_lag.time_constant"] = 0.0
    (effect,) = effects_from(theta, ROBOT.figures)
    signal = a_signal(effect.stage, 1)
    np.testing.assert_array_equal(run(effect, signal), signal)


@pytest.mark.parametrize("name", IMBALANCED)
@pytest.mark.parametrize(("imbalance", "wheel"), [(-1.0, "left"), (1.0, "right")])
def test_an_imbalance_of_one_leaves_the_other_wheel_alone(name, imbalance, wheel):
    effect = at(name, f"{name}.imbalance", imbalance)
    signal = a_signal(effect.stage, 1)
    moved = np.abs(run(effect, signal) - signal).max(axis=0)
    here, there = moved if wheel == "left" else moved[::-1]
    assert here > 0.0
    assert there == 0.0


@pytest.mark.parametrize(("name", "theta_name", "value"), PROBES)
def test_every_probe_value_changes_the_signal(name, theta_name, value):
    effect = at(name, theta_name, value)
    still = at(name, theta_name, neutral(name)[theta_name])
    signal = a_signal(effect.stage, 2, length=900)
    moved = np.abs(run(effect, signal) - run(still, signal)).max()
    assert moved == 0.0 if value == neutral(name)[theta_name] else moved > 1e-3


@pytest.mark.parametrize(("name", "theta_name"), sorted({(name, theta_name) for name, theta_name, _ in PROBE_VALUES}))
def test_every_step_over_a_parameters_range_changes_the_signal(name, theta_name):
    parameter = PARAMETERS[theta_name]
    signal = a_signal(CATALOGUE[name].stage, 6, length=2700)
    steps = np.linspace(parameter.low, parameter.high, 9)
    values = [run(at(name, theta_name, value), signal) for value in steps]
    assert all(np.abs(later - earlier).max() > 1e-3 for earlier, later in pairwise(values))


@pytest.mark.parametrize(("name", "theta_name", "value"), PROBES)
@given(cuts=st.lists(st.integers(1, 89), max_size=6), seed=st.integers(0, 99))
@settings(max_examples=8, derandomize=True, deadline=None)
def test_cutting_the_signal_into_chunks_never_changes_the_result(name, theta_name, value, cuts, seed):
    effect = at(name, theta_name, value)
    signal = a_signal(effect.stage, seed)
    tolerance = 2e-4 if effect.stage is Stage.IMAGE else 1e-12
    np.testing.assert_allclose(run(effect, signal, cuts), run(effect, signal), rtol=0, atol=tolerance)


@pytest.mark.parametrize("name", FLAT)
def test_a_long_signal_one_control_step_at_a_time_is_the_same(name):
    effect = at(name, theta_names(CATALOGUE[name])[0], CATALOGUE[name].parameters[0].probes[-1])
    signal = a_signal(effect.stage, 5, length=1800)
    np.testing.assert_allclose(run(effect, signal, range(3, 1800, 3)), run(effect, signal), rtol=0, atol=1e-11)


@pytest.mark.parametrize(("name", "theta_name", "value"), PROBES)
def test_what_is_filtered_never_depends_on_what_comes_later(name, theta_name, value):
    effect = at(name, theta_name, value)
    signal = a_signal(effect.stage, 3)
    other = signal.copy()
    other[45:] = other[45:] * 0.5 + 0.1
    np.testing.assert_array_equal(run(effect, signal)[:45], run(effect, other)[:45])


@pytest.mark.parametrize(("name", "theta_name", "value"), PROBES)
def test_the_same_seed_gives_the_same_result(name, theta_name, value):
    effect = at(name, theta_name, value)
    signal = a_signal(effect.stage, 4)
    np.testing.assert_array_equal(run(effect, signal), run(effect, signal))


@pytest.mark.parametrize("name", FLAT)
def test_only_effects_that_draw_depend_on_the_seed(name):
    effect = at(name, theta_names(CATALOGUE[name])[0], CATALOGUE[name].parameters[0].probes[-1])
    signal = a_signal(effect.stage, 4)
    differ = not np.array_equal(run(effect, signal, seed=7), run(effect, signal, seed=8))
    assert differ == bool(CATALOGUE[name].trace.draws)


@pytest.mark.parametrize("name", FLAT)
def test_memories_are_never_changed_in_place(name):
    effect = at(name, theta_names(CATALOGUE[name])[0], CATALOGUE[name].parameters[0].probes[-1])
    signal = a_signal(effect.stage, 4)
    rest = np.zeros(signal.shape[-1])
    memory = effect.begin(Setting(RATE_HZ, rest, ROBOT.figures, seed=7))
    kept = signal.copy()
    first, middle = effect.apply(signal, memory)
    second, _ = effect.apply(signal, middle)
    np.testing.assert_array_equal(effect.apply(signal, memory)[0], first)
    np.testing.assert_array_equal(effect.apply(signal, middle)[0], second)
    np.testing.assert_array_equal(signal, kept)


@pytest.mark.parametrize(("name", "theta_name", "value"), [probe for probe in PROBES if probe.values[0] in FLAT])
def test_a_batch_is_filtered_like_its_members(name, theta_name, value):
    effect = at(name, theta_name, value)
    batch = np.stack([a_signal(effect.stage, seed) for seed in range(6)]).reshape(2, 3, 90, -1)
    memory = effect.begin(setting_for(effect, np.zeros((2, 3, batch.shape[-1]))))
    first, memory = effect.apply(batch[..., :50, :], memory)
    second, _ = effect.apply(batch[..., 50:, :], memory)
    together = np.concatenate((first, second), axis=-2)
    alone = [[run(effect, one) for one in row] for row in batch]
    np.testing.assert_allclose(together, alone, rtol=0, atol=1e-12)


@pytest.mark.parametrize("name", CATALOGUE)
def test_every_parameter_has_bounds_around_its_neutral_value_and_a_source(name):
    for parameter in CATALOGUE[name].parameters:
        assert parameter.low <= parameter.neutral_value(ROBOT.figures) <= parameter.high
        assert parameter.source
        assert len(parameter.probes) >= 4
        assert all(parameter.low <= probe <= parameter.high for probe in parameter.probes)


@pytest.mark.parametrize("name", CATALOGUE)
def test_an_effect_leaves_a_trace_in_motion_unless_it_bends_pictures_alone(name):
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


def test_parameters_are_given_by_keyword():
    with pytest.raises(TypeError, match="positional"):
        Parameter("trim", "", -0.5, 0.5, 0.0)
