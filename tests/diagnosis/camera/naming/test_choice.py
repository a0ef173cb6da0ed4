"""What leaving effects out costs is what refitting would cost, for the sets that a caller may choose."""

import sys
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

sys.path.append(str(Path(__file__).parents[1]))
from viewed import everything

from proxytune.diagnosis.camera.naming.choice import rank_subsets

NAMES = ("camera_pitch", "camera_roll", "lens_centre.right", "lens_centre.down", "pixel_aspect")


def linear(seed, rows=40):
    """A linear problem y = A θ + noise that stands in for a fit, A, y, and the sum of squares over 2."""
    random = np.random.default_rng(seed)
    slopes = random.normal(size=(rows, len(NAMES)))
    measured = slopes @ random.normal(size=len(NAMES)) + 0.3 * random.normal(size=rows)
    best = np.linalg.lstsq(slopes, measured)[0]
    views = SimpleNamespace(optics=SimpleNamespace(neutral=lambda name: 0.0))
    fit = SimpleNamespace(
        names=NAMES, theta=dict(zip(NAMES, best, strict=True)), views=views, information=slopes.T @ slopes
    )

    def cost(effects):
        kept = [number for number, name in enumerate(NAMES) if name.split(".")[0] in effects]
        held = slopes[:, kept]
        left = measured - (held @ np.linalg.lstsq(held, measured)[0] if kept else 0.0)
        return 0.5 * float(left @ left)

    return fit, cost


EFFECTS = ("camera_pitch", "camera_roll", "lens_centre", "pixel_aspect")


@settings(deadline=None, max_examples=40)
@given(st.integers(0, 2**32 - 1), st.integers(0, 3))
def test_the_loss_is_what_refitting_costs_where_the_problem_is_linear(seed, size):
    fit, cost = linear(seed)
    for one in rank_subsets(fit, ["camera_pitch"], size):
        refitted = cost(("camera_pitch", *one.effects)) - cost(EFFECTS)
        assert one.loss == pytest.approx(refitted, rel=1e-6, abs=1e-6)


@settings(deadline=None, max_examples=40)
@given(st.integers(0, 2**32 - 1), st.integers(0, 4))
def test_sets_come_with_the_best_first(seed, size):
    losses = [one.loss for one in rank_subsets(linear(seed)[0], (), size)]
    assert losses == sorted(losses)
    assert min(losses) >= -1e-9


@given(st.integers(0, 3))
def test_what_is_declared_is_never_dropped_nor_named(size):
    sets = rank_subsets(linear(0)[0], ["camera_pitch"], size)
    assert all("camera_pitch" not in one.effects for one in sets)
    assert len({one.effects for one in sets}) == len(sets) == (1, 3, 3, 1)[size]


def test_parameters_of_one_effect_stay_together():
    chosen = {effect for one in rank_subsets(linear(0)[0], (), 2) for effect in one.effects}
    assert chosen == set(EFFECTS)


def test_all_effects_together_lose_nothing():
    assert rank_subsets(linear(3)[0], (), len(EFFECTS))[0].loss == 0.0


def test_more_effects_than_there_are_make_no_set():
    assert rank_subsets(linear(3)[0], (), len(EFFECTS) + 1) == []


def test_the_best_single_effect_of_a_rolled_camera_is_its_roll():
    best, second = rank_subsets(everything({"camera_roll": 4.0}), ["camera_pitch"], 1)[:2]
    assert best.effects == ("camera_roll",)
    assert second.loss > 10.0 * best.loss
