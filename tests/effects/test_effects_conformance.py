"""What every effect promises, run over the whole catalogue."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from proxytune.driving.robot import read_robot
from proxytune.effects import CATALOGUE, CHANNELS, Setting, Stage, effects_from, theta_names

ROBOT = read_robot("duckiebot")
RATE_HZ = 60.0
PROBES = [
    pytest.param(name, theta_name, value, id=f"{theta_name}={value}")
    for name, effect in CATALOGUE.items()
    for theta_name, parameter in zip(theta_names(effect), effect.parameters, strict=True)
    for value in parameter.probes
]


def a_signal(stage: Stage, seed: int, length: int = 90) -> np.ndarray:
    """Something a stage could meet: held commands, camera figures, or a changing picture."""
    random = np.random.default_rng(seed)
    if stage is Stage.CAMERA:
        return np.repeat(ROBOT.camera_figures().channels()[None], length, axis=0)
    if stage is Stage.IMAGE:
        return random.uniform(0.0, 255.0, (length, 12)).astype(np.float32)
    return np.repeat(random.uniform(-1.0, 1.0, (length // 3, len(CHANNELS[stage]))), 3, axis=0)


def run(effect, signal, cuts=()):
    rest = signal[0] if effect.stage in (Stage.IMAGE, Stage.CAMERA) else np.zeros(signal.shape[-1])
    memory = effect.begin(Setting(RATE_HZ, rest, ROBOT.figures, seed=7))
    out = []
    for chunk in np.split(signal, sorted(cuts)):
        if len(chunk):
            filtered, memory = effect.apply(chunk, memory)
            out.append(filtered)
    return np.concatenate(out)


@pytest.mark.parametrize("name", CATALOGUE)
def test_neutral_value_changes_nothing(name):
    effect = CATALOGUE[name](*(p.neutral_value(ROBOT.figures) for p in CATALOGUE[name].parameters))
    replaces_nominal = any(isinstance(p.neutral, str) for p in effect.parameters)
    signal = a_signal(effect.stage, 1)
    if replaces_nominal and effect.stage is not Stage.CAMERA:
        nominal = effects_from({theta_names(CATALOGUE[name])[0]: ROBOT.theta[name]}, ROBOT.figures)[0]
        np.testing.assert_array_equal(run(effect, signal), run(nominal, signal))
    else:
        np.testing.assert_array_equal(run(effect, signal), signal)


@pytest.mark.parametrize(("name", "theta_name", "value"), PROBES)
def test_every_probe_value_changes_the_signal(name, theta_name, value):
    pairs = zip(theta_names(CATALOGUE[name]), CATALOGUE[name].parameters, strict=True)
    neutral = {theta: parameter.neutral_value(ROBOT.figures) for theta, parameter in pairs}
    (effect,) = effects_from(neutral | {theta_name: value}, ROBOT.figures)
    (still,) = effects_from(neutral, ROBOT.figures)
    signal = a_signal(effect.stage, 2)
    moved = np.abs(run(effect, signal) - run(still, signal)).max()
    assert moved == 0.0 if value == neutral[theta_name] else moved > 1e-3


@pytest.mark.parametrize(("name", "theta_name", "value"), PROBES)
@given(cuts=st.lists(st.integers(1, 89), max_size=6), seed=st.integers(0, 99))
@settings(max_examples=8, derandomize=True, deadline=None)
def test_cutting_the_signal_into_chunks_never_changes_the_result(name, theta_name, value, cuts, seed):
    (effect,) = effects_from({theta_name: value}, ROBOT.figures)
    signal = a_signal(effect.stage, seed)
    tolerance = 2e-4 if effect.stage is Stage.IMAGE else 1e-12
    np.testing.assert_allclose(run(effect, signal, cuts), run(effect, signal), rtol=0, atol=tolerance)


@pytest.mark.parametrize(("name", "theta_name", "value"), PROBES)
def test_what_is_filtered_never_depends_on_what_comes_later(name, theta_name, value):
    (effect,) = effects_from({theta_name: value}, ROBOT.figures)
    signal = a_signal(effect.stage, 3)
    other = signal.copy()
    other[45:] = other[45:] * 0.5 + 0.1
    np.testing.assert_array_equal(run(effect, signal)[:45], run(effect, other)[:45])


@pytest.mark.parametrize(("name", "theta_name", "value"), PROBES)
def test_the_same_seed_gives_the_same_result(name, theta_name, value):
    (effect,) = effects_from({theta_name: value}, ROBOT.figures)
    signal = a_signal(effect.stage, 4)
    np.testing.assert_array_equal(run(effect, signal), run(effect, signal))


@pytest.mark.parametrize("name", [n for n, e in CATALOGUE.items() if e.stage in (Stage.COMMAND, Stage.ACTUATION)])
def test_a_batch_is_filtered_like_its_members(name):
    first = CATALOGUE[name].parameters[0]
    (effect,) = effects_from({theta_names(CATALOGUE[name])[0]: first.probes[-1]}, ROBOT.figures)
    batch = np.stack([a_signal(effect.stage, seed) for seed in range(4)])
    memory = effect.begin(Setting(RATE_HZ, np.zeros((4, 2)), ROBOT.figures, seed=7))
    together, _ = effect.apply(batch, memory)
    np.testing.assert_allclose(together, [run(effect, one) for one in batch], rtol=0, atol=1e-12)


@pytest.mark.parametrize("name", CATALOGUE)
def test_every_parameter_has_bounds_around_its_neutral_value_and_a_source(name):
    for parameter in CATALOGUE[name].parameters:
        assert parameter.low <= parameter.neutral_value(ROBOT.figures) <= parameter.high
        assert parameter.source
        assert len(parameter.probes) >= 4
        assert all(parameter.low <= probe <= parameter.high for probe in parameter.probes)
