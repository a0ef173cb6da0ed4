"""What may be learnt has its knots where the drives have been."""

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

sys.path.append(str(Path(__file__).parent))

from planted import TRUTH, planted_drives

from proxytune.diagnosis.model.replay import twists_of
from proxytune.diagnosis.remainder.offers import offer_curves
from proxytune.effects.learnt.features import GROUPS
from proxytune.effects.learnt.table import learnt_effect, learnt_theta


@pytest.fixture(scope="module")
def drives():
    return planted_drives(TRUTH, episodes=3, seconds=20.0, noise=None)


def test_every_group_is_offered_in_the_order_of_its_weights_and_makes_an_effect(drives):
    offer = offer_curves(drives, TRUTH)
    assert {curve.group for curve in offer.curves} == set(GROUPS)
    assert learnt_effect(learnt_theta(offer)) == offer
    assert not any(any(curve.weights) for curve in offer.curves)


def test_knots_lie_within_what_was_seen(drives):
    offer, asked = offer_curves(drives, TRUTH), twists_of(drives, TRUTH)
    for bounds, signal in zip(offer.seen, (asked[..., 0], asked[..., 2]), strict=True):
        assert signal.min() <= bounds[0] < 0.0 < bounds[1] <= 1.01 * signal.max()
    knots = {curve.group: np.array(curve.knots) for curve in offer.curves}
    assert offer.seen.yaw[0] <= knots["turn_rate"].min() < 0.0 < knots["turn_rate"].max() <= offer.seen.yaw[1]
    assert knots["time"].max() <= 20.1


def test_what_was_never_driven_is_not_offered(drives):
    ahead = replace(drives, duties=np.abs(drives.duties[..., :1]).repeat(2, axis=-1))
    groups = {curve.group for curve in offer_curves(ahead, {**TRUTH, "trim": 0.0}).curves}
    assert "direction" not in groups
    assert "turn_rate" not in groups
    assert "wheel_speed" in groups
