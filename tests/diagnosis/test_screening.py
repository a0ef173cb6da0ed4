"""The effect that is there leads, chance is told as chance, and left and right are treated alike."""

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

sys.path.append(str(Path(__file__).parent))

from planted import ROBOT, TRUTH, drives_of, fitted, planted_drives, planted_log, with_poses

from proxytune.diagnosis.naming.candidates import candidates
from proxytune.diagnosis.naming.screening import number_stretches, project_out, screen

SHORT = {"episodes": 3, "seconds": 20.0}
TAKEN = ("trim", "delay")


def leads_of(theta, *, base=None, **more):
    base = base or fitted(planted_drives({**TRUTH, **theta}, **{**SHORT, **more}))
    return screen(base, candidates(ROBOT, base.theta, TAKEN), 1)


@pytest.mark.parametrize(
    ("theta", "effect"),
    [
        ({"dead_band.width": 0.1}, "dead_band"),
        ({"yaw_scrub": 0.13}, "yaw_scrub"),
        ({"turn_slip": 0.15}, "turn_slip"),
        ({"motor_lag.time_constant": 0.4}, "motor_lag"),
        ({"floor_slope.x": 0.04}, "floor_slope"),
        ({"lateral_slip": 0.1}, "lateral_slip"),
    ],
)
def test_a_planted_effect_leads(theta, effect):
    leads = leads_of(theta)
    assert leads[0].candidate.effect == effect
    assert leads[0].p_value <= 0.01
    assert leads[0].held_out > 30.0
    assert leads[0].gain > leads[0].held_out - 30.0


def test_leads_come_best_first_and_once_per_form():
    leads = leads_of({"yaw_scrub": 0.13})
    gains = [lead.gain for lead in leads]
    assert gains == sorted(gains, reverse=True)
    labels = [lead.candidate.label for lead in leads]
    assert len(labels) == len(set(labels)) > 15


def test_the_step_lands_near_the_planted_value():
    lead = leads_of({"yaw_scrub": 0.13})[0]
    assert lead.start[0] == pytest.approx(0.13, abs=0.02)


@pytest.fixture(scope="module")
def chance():
    """The smallest p-value of every clean log."""
    return np.array([min(lead.p_value for lead in leads_of({}, seed=seed)) for seed in range(20, 28)])


@pytest.mark.slow
def test_chance_alone_is_told_as_chance(chance):
    assert chance.min() > 0.005
    assert (chance < 0.1).sum() <= 3
    assert 0.15 < chance.mean() < 0.85


@pytest.mark.slow
def test_the_same_seed_gives_the_same_leads():
    base = fitted(planted_drives(TRUTH, **SHORT))
    forms = candidates(ROBOT, base.theta, TAKEN)
    one, again, other = (screen(base, forms, seed) for seed in (1, 1, 2))
    assert [lead.p_value for lead in one] == [lead.p_value for lead in again]
    assert [lead.p_value for lead in one] != [lead.p_value for lead in other]
    assert [lead.gain for lead in one] == [lead.gain for lead in other]


def mirrored(log):
    """The same drives seen in a mirror."""
    swapped = tuple(replace(e, commands=e.commands[:, ::-1].copy()) for e in log.episodes)
    return with_poses(replace(log, episodes=swapped), lambda poses: poses * (1.0, -1.0, -1.0))


def test_a_mirror_swaps_left_and_right_and_nothing_else():
    log = planted_log({"trim": 0.0, "delay": 0.12, "dead_band.width": 0.1, "dead_band.imbalance": -1.0}, **SHORT)
    one, other = (leads_of({}, base=fitted(drives_of(seen))) for seen in (log, mirrored(log)))
    swap = {"left wheel": "right wheel", "right wheel": "left wheel"}
    gains = {(lead.candidate.effect, lead.candidate.form): lead.gain for lead in other}
    assert one[0].candidate.label == "dead_band (left wheel)"
    for lead in one:
        twin = gains[lead.candidate.effect, swap.get(lead.candidate.form, lead.candidate.form)]
        assert twin == pytest.approx(lead.gain, rel=0.03, abs=1.0)


def test_what_free_parameters_can_do_is_projected_out():
    random = np.random.default_rng(1)
    slopes, columns, weight = random.random((60, 2)), random.random((60, 3)), random.random(60) > 0.3
    left = project_out(slopes, columns, weight)
    np.testing.assert_allclose(slopes[weight].T @ left[weight], 0.0, atol=1e-9)
    np.testing.assert_allclose(project_out(slopes, slopes @ random.random((2, 1)), weight), 0.0, atol=1e-9)
    assert project_out(np.empty((60, 0)), columns, weight) is columns


def test_stretches_last_a_second_and_never_cross_episodes():
    drives = planted_drives(TRUTH, episodes=2, seconds=5.0)
    number = number_stretches(drives)
    assert len(np.unique(number)) == 10
    for one in np.unique(number):
        own = number == one
        assert len(np.unique(drives.episode[own])) == 1
        assert np.ptp(drives.first[own]) < drives.tick_hz


def test_what_changes_nothing_in_these_drives_is_no_lead():
    drives = planted_drives(TRUTH, **SHORT)
    half = replace(drives, duties=0.5 * drives.duties)
    labels = {lead.candidate.effect for lead in leads_of({}, base=fitted(half))}
    limits = [lead.probe for lead in leads_of({}, base=fitted(half)) if lead.candidate.effect == "saturation"]
    assert "yaw_scrub" in labels
    assert all(limit < 0.5 for (limit,) in limits)
