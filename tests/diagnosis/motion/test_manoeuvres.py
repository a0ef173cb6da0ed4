"""What to drive next: the manoeuvre in which two rivals differ, within what a robot can do."""

import numpy as np
import pytest
from planted import DECLARED, NOISE, ROBOT, TRUTH, driven_log, drives_of

from proxytune.diagnosis import RULES, AdoptedEffect, Findings, increments
from proxytune.diagnosis.motion.fitting import evaluate
from proxytune.diagnosis.motion.manoeuvres import LIBRARY, imagine_drive, next_manoeuvre
from proxytune.diagnosis.motion.screening import candidates

SIZES = {
    "dead_band": {"dead_band.width": 0.08, "dead_band.imbalance": 0.0},
    "lateral_slip": {"lateral_slip": 0.05},
    "turn_slip": {"turn_slip": 0.1},
}


@pytest.fixture(scope="module")
def drives():
    times = np.arange(600) / 20.0
    turn = 0.15 * np.sin(2.0 * np.pi * times / 5.0)
    return drives_of(driven_log(TRUTH, np.stack((0.5 - turn, 0.5 + turn), axis=1)[None], np.zeros((1, 3))))


def found(drives, effect, *rivals):
    theta = {**TRUTH, **SIZES[effect]}
    forms = {form.effect: form for form in candidates(ROBOT, TRUTH, ()) if not form.form}
    own = forms[effect]
    adopted = AdoptedEffect(
        effect, "", tuple(SIZES[effect]), own.free, 100.0, 0.002, tuple(forms[name] for name in rivals)
    )
    declared = evaluate(drives, TRUTH, DECLARED, NOISE)
    model = evaluate(drives, theta, (*DECLARED, *own.free), NOISE)
    return Findings(declared, model, (adopted,), (), (), ())


def test_without_rivals_there_is_nothing_to_tell_apart(drives):
    assert next_manoeuvre(found(drives, "dead_band")) is None


def test_where_noise_is_not_known_what_is_driven_is_driven_ten_times(drives):
    alone = next_manoeuvre(found(drives, "dead_band"), again=True)
    assert (alone.times, alone.nats_per_minute) == (10, None)
    assert alone.duties.shape == (1200, 2)
    rivals = next_manoeuvre(found(drives, "dead_band", "stiction"), again=True)
    assert rivals.times == 10
    assert next_manoeuvre(found(drives, "dead_band", "stiction")).times == 1
    assert rivals.between == ("dead_band", "stiction")


@pytest.mark.parametrize(
    ("effect", "rival"),
    [("dead_band", "stiction"), ("lateral_slip", "marker_offset"), ("turn_slip", "yaw_scrub")],
)
def test_rivals_are_told_apart_by_a_manoeuvre_that_can_be_driven(drives, effect, rival):
    offer = next_manoeuvre(found(drives, effect, rival))
    assert offer.between == (effect, rival)
    assert offer.nats_per_minute > RULES.rival_nats
    assert offer.name in {name for name, _, _ in LIBRARY}
    assert offer.duties.shape == (1200, 2)


def test_steady_arcs_are_not_what_tells_stiction_from_a_dead_band(drives):
    assert next_manoeuvre(found(drives, "dead_band", "stiction")).name not in ("arcs", "full speed", "figure-eight")


@pytest.mark.parametrize(("name", "text", "shape"), LIBRARY, ids=[name for name, _, _ in LIBRARY])
def test_every_manoeuvre_is_described_and_stays_within_full_duty(name, text, shape):
    duties = shape(np.arange(1200) / 20.0)
    assert duties.shape == (1200, 2)
    assert np.abs(duties).max() <= 1.0
    assert np.ptp(duties) > 0.1
    assert len(text) > 20


def test_an_imagined_drive_is_one_episode_with_a_pose_at_every_row(drives):
    duties = LIBRARY[0][2](np.arange(200) / 20.0)
    drive = imagine_drive(drives, duties)
    assert drive.seconds == pytest.approx(199 / 20.0)
    assert drive.linked.tolist() == [False] + [True] * 198
    np.testing.assert_array_equal(drive.duties[0, ::3], duties)
    moved = increments(drive, TRUTH)
    assert moved.shape == (199, 3)
    assert np.abs(moved).max() > 0.005
