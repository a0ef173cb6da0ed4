"""What has no name is learnt, and used only where it is shown to help."""

import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.append(str(Path(__file__).parent))

from learnt_truth import TURNING
from planted import TRUTH, planted_drives

from proxytune.diagnosis.horizon.windows import Ratio, cut, pose_errors
from proxytune.diagnosis.remainder.remainder import Remainder, _helps, remainder
from proxytune.diagnosis.rules import RULES


@pytest.fixture(scope="module")
def found():
    drives = planted_drives({**TRUTH, **TURNING}, episodes=6, seconds=20.0)
    return drives, remainder(drives, TRUTH)


def test_drives_too_short_for_a_window_teach_nothing():
    drives = planted_drives(TRUTH, episodes=8, seconds=1.5)
    learnt = remainder(drives, TRUTH)
    assert (learnt.used, dict(learnt.theta), len(learnt.held_out)) == (False, {}, 0)


def test_a_hidden_curve_is_learnt_by_its_signal_and_lowers_the_error_of_other_drives(found):
    _, learnt = found
    assert learnt.used
    assert max(learnt.share, key=lambda title: learnt.share[title]) == "turn rate"
    assert sum(learnt.share.values()) == pytest.approx(1.0)
    others = planted_drives({**TRUTH, **TURNING}, episodes=3, seconds=20.0, seed=9)
    windows = cut(others, 2.0)
    before, after, right = (
        np.sqrt(np.mean(pose_errors(others, theta, windows)[:, 0] ** 2))
        for theta in (TRUTH, {**TRUTH, **learnt.theta}, {**TRUTH, **TURNING})
    )
    assert after < 0.5 * before
    assert after < 1.25 * right


def test_the_guard_and_the_held_out_errors_tell_of_blocks_that_were_not_fitted(found):
    drives, learnt = found
    assert set(learnt.guard) == {1.0, 2.0, 5.0}
    before = pose_errors(drives, TRUTH, cut(drives, 2.0))[:, 0] ** 2
    assert np.sqrt(learnt.held_out.mean() / before.mean()) == pytest.approx(learnt.guard[2.0].value)
    inside = pose_errors(drives, {**TRUTH, **learnt.theta}, cut(drives, 2.0))[:, 0] ** 2
    assert inside.mean() < learnt.held_out.mean()


def test_curves_that_promise_nothing_to_who_asks_are_not_used(found):
    drives, learnt = found
    asked = []
    refused = remainder(drives, TRUTH, lambda held_out: asked.append(held_out))
    assert (refused.used, dict(refused.guard), dict(refused.theta)) == (False, {}, {})
    np.testing.assert_array_equal(asked, [learnt.held_out])
    np.testing.assert_array_equal(refused.held_out, learnt.held_out)


@pytest.mark.parametrize("seed", [1, 2])
def test_nothing_is_used_where_nothing_is_missing(seed):
    drives = planted_drives(TRUTH, episodes=6, seconds=12.0, seed=seed)
    assert not remainder(drives, TRUTH).used


def test_too_few_blocks_teach_nothing():
    drives = planted_drives({**TRUTH, **TURNING}, episodes=1, seconds=12.0)
    learnt = remainder(drives, TRUTH)
    assert (dict(learnt.theta), learnt.used) == ({}, False)
    assert len(learnt.held_out)


GOOD, DULL = Ratio(0.8, (0.7, 0.9)), Ratio(1.0, (0.9, 1.1))
BAD, UNSURE = Ratio(1.1, (0.9, 1.3)), Ratio(0.8, (0.6, 1.01))


@pytest.mark.parametrize(
    ("guard", "used"),
    [
        ({1.0: GOOD, 2.0: DULL}, True),
        ({1.0: GOOD, 2.0: BAD}, False),
        ({1.0: DULL, 2.0: DULL}, False),
        ({1.0: UNSURE, 2.0: DULL}, False),
        ({}, False),
    ],
)
def test_the_guard_wants_a_sure_gain_somewhere_and_a_loss_nowhere(guard, used):
    assert DULL.value < RULES.remainder_harms < BAD.value
    assert GOOD.value < RULES.remainder_helps < DULL.value
    assert _helps(guard) == used
    assert not Remainder().used
