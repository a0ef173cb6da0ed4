"""A step of the command is found however small the spike is that it leaves, and a slippery place wherever it lies."""

import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.append(str(Path(__file__).parent))

from planted import ROBOT, TRUTH, fitted, planted_drives

from proxytune.diagnosis.model.replay import increments
from proxytune.diagnosis.naming.candidates import candidates
from proxytune.diagnosis.naming.dense import cut_part, with_dense_probes

SHORT = {"episodes": 4, "seconds": 30.0}


def added(effect, theta):
    """The probe that is added to an effect's own on drives of this truth."""
    base = fitted(planted_drives({**TRUTH, **theta}, **SHORT))
    forms = [form for form in candidates(ROBOT, base.theta, ()) if form.effect == effect]
    (form,), *_ = zip(with_dense_probes(base, forms), strict=False)
    assert form.probes[: len(forms[0].probes)] == forms[0].probes
    return form.probes[len(forms[0].probes) :]


def test_a_size_between_the_probes_is_met_within_one_percent():
    (size,) = added("command_quantisation", {"command_quantisation": 0.137})
    assert size[0] == pytest.approx(0.137, rel=0.01)


def test_a_slippery_place_is_met_within_a_patch_width():
    patch = {"loss": 0.6, "x": 0.3, "y": 0.2, "radius": 0.7}
    (where,) = added("slippery_patch", {f"slippery_patch.{key}": value for key, value in patch.items()})
    assert np.hypot(where[1] - 0.3, where[2] - 0.2) < 0.7


def test_other_effects_keep_the_probes_that_they_have():
    base = fitted(planted_drives(TRUTH, **SHORT))
    forms = [form for form in candidates(ROBOT, base.theta, ()) if form.effect in ("trim", "understeer")]
    assert with_dense_probes(base, forms) == forms


def test_a_part_of_the_drives_moves_as_the_whole_does_there():
    whole = planted_drives(TRUTH, episodes=3, seconds=60.0, noise=None)
    part = cut_part(whole)
    assert 0.15 * whole.seconds < part.seconds < 0.45 * whole.seconds
    np.testing.assert_allclose(increments(part, TRUTH | {"delay": 0.12}), part.measured, atol=1e-4)
