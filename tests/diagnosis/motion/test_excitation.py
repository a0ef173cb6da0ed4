"""The next drive, designed: within the robot's limits and the room, and worth more than what is in the library."""

import numpy as np
import pytest
from planted import DECLARED, NOISE, ROBOT, TRUTH, driven_log, drives_of

from proxytune.diagnosis import AdoptedEffect, Findings, Limits, increments
from proxytune.diagnosis.motion import excitation
from proxytune.diagnosis.motion.excitation import Rivals, course_of, design_drive
from proxytune.diagnosis.motion.fitting import evaluate, fit
from proxytune.diagnosis.motion.innovations import huber
from proxytune.diagnosis.motion.manoeuvres import LIBRARY
from proxytune.diagnosis.motion.screening import candidates

SIZES = {
    "dead_band": {"dead_band.width": 0.08, "dead_band.imbalance": 0.0},
    "lateral_slip": {"lateral_slip": 0.05},
    "turn_slip": {"turn_slip": 0.1},
}
FORMS = {form.effect: form for form in candidates(ROBOT, TRUTH, ()) if not form.form}
ROOM = Limits((4.0, 3.0))


@pytest.fixture(scope="module")
def drives():
    times = np.arange(600) / 20.0
    turn = 0.15 * np.sin(2.0 * np.pi * times / 5.0)
    return drives_of(driven_log(TRUTH, np.stack((0.5 - turn, 0.5 + turn), axis=1)[None], np.zeros((1, 3))))


@pytest.fixture
def quick(monkeypatch):
    monkeypatch.setattr(excitation, "GENERATIONS", 3)
    monkeypatch.setattr(excitation, "ROUNDS", 1)


@pytest.fixture(scope="module")
def designed(drives):
    """A drive that tells two rivals apart, designed once."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(excitation, "GENERATIONS", 3)
        patch.setattr(excitation, "ROUNDS", 1)
        return design_drive(found(drives, "lateral_slip", "marker_offset"), limits=ROOM)


def found(drives, effect, *rivals):
    theta = {**TRUTH, **SIZES[effect]}
    own = FORMS[effect]
    others = tuple(FORMS[name] for name in rivals)
    adopted = AdoptedEffect(effect, "", tuple(SIZES[effect]), own.free, 100.0, 0.002, others)
    declared = evaluate(drives, TRUTH, DECLARED, NOISE)
    return Findings(declared, evaluate(drives, theta, (*DECLARED, *own.free), NOISE), (adopted,), (), (), ())


def test_where_noise_is_not_known_a_drive_is_driven_ten_times_and_without_rivals_nothing(drives, designed, quick):
    alone = design_drive(found(drives, "dead_band"), again=True, limits=Limits((6, 5), 1, 10), unseen=("saturation",))
    assert (alone.times, alone.between, alone.manoeuvre[0]) == (10, ("noise", "what is missing"), "quick steps")
    assert alone.nats_per_minute >= alone.manoeuvre[1] > 0.0
    rivals = design_drive(found(drives, "lateral_slip", "marker_offset"), again=True, limits=ROOM)
    assert (rivals.times, rivals.between) == (10, ("lateral_slip", "marker_offset"))
    assert 3 <= designed.times < 10
    assert design_drive(found(drives, "dead_band")) is None


@pytest.mark.parametrize(
    ("effect", "rival"), [("dead_band", "stiction"), pytest.param("turn_slip", "yaw_scrub", marks=pytest.mark.slow)]
)
def test_rivals_are_told_apart_within_the_room_and_the_robots_limits(drives, quick, effect, rival):
    findings = found(drives, effect, rival)
    drive = design_drive(findings, limits=Limits((1.5, 1.2), fastest=0.6, seconds=10.0))
    assert drive.between == (effect, rival)
    assert drive.commands.shape == (200, 2)
    assert drive.seconds == 10.0
    assert np.abs(drive.commands).max() <= 0.6
    course = course_of(drives, Limits((1.5, 1.2), seconds=10.0))
    places = course.imagine(drive.commands[None], findings.model.theta).poses[:, 1, :2] - course.start[:2]
    assert (np.abs(places) <= (0.65, 0.5)).all(), "0.1 m of the robot itself stays off the edges"


@pytest.mark.slow
def test_what_is_expected_is_the_evidence_that_fits_of_both_models_have(designed):
    theta, starts = {**TRUTH, **SIZES["lateral_slip"]}, np.zeros((3, 3))
    driven = drives_of(driven_log(theta, np.repeat(designed.commands[None], 3, axis=0), starts, seed=5))

    def log_likelihood(form):
        start = {**TRUTH, **form.fixed, form.free[0][0]: 0.03, form.free[-1][0]: 0.03}
        fitted = fit(driven, start, DECLARED + form.free)
        return -huber(fitted.innovations).sum() - fitted.whiten.log_determinant.sum()

    gained = log_likelihood(FORMS["lateral_slip"]) - log_likelihood(FORMS["marker_offset"])
    assert 0.5 < gained / designed.nats_per_minute < 2.0


@pytest.mark.slow
def test_a_design_is_worth_more_than_the_manoeuvres_that_keep_to_the_room(drives):
    drive = design_drive(found(drives, "lateral_slip", "marker_offset"), limits=ROOM)
    assert drive.name == "the designed drive"
    assert drive.nats_per_minute > 5.0 * drive.manoeuvre[1]


@pytest.mark.slow
def test_a_manoeuvre_that_is_worth_as_much_is_taken(drives, quick, monkeypatch):
    monkeypatch.setattr(excitation, "SIMPLER", 1e6)
    drive = design_drive(found(drives, "turn_slip", "yaw_scrub"), limits=ROOM)
    assert (drive.name, drive.description.split(",")[0]) in {(name, text.split(",")[0]) for name, text, _ in LIBRARY}
    assert drive.nats_per_minute == drive.manoeuvre[1]


def test_one_seed_is_one_drive_imagined_from_the_middle_of_the_room_if_there_is_one(drives, designed, quick):
    again = design_drive(found(drives, "lateral_slip", "marker_offset"), limits=ROOM)
    np.testing.assert_array_equal(again.commands, designed.commands)
    course = course_of(drives, Limits())
    ends = drives.poses[:, 1, :2]
    assert course.room == pytest.approx(sorted(np.ptp(ends, axis=0), reverse=True))
    np.testing.assert_allclose(course.start[:2], (ends.min(axis=0) + ends.max(axis=0)) / 2.0)
    assert course.start[2] in (0.0, pytest.approx(np.pi / 2.0))
    course = course_of(drives, Limits((2.0, 2.0), seconds=5.0))
    still, straight = np.zeros((100, 2)), np.full((100, 2), 0.6)
    batch = course.imagine(np.stack((still, straight)), TRUTH)
    reach = np.abs(batch.poses[batch.episode == 1][-1, 1, :2] - course.start[:2]).max()
    beyond = course.beyond(batch, 0.0)
    assert beyond[0] == pytest.approx(-0.9)
    assert beyond[1] == pytest.approx(reach - 0.9)
    assert course.beyond(batch, 0.1)[1] > beyond[1] + 0.05, "drift counts"

    course = course_of(drives, ROOM)
    commands = course.library[:2]
    batch = course.imagine(commands, TRUTH)
    np.testing.assert_array_equal(batch.duties[:, ::3], commands)
    np.testing.assert_allclose(batch.measured, increments(batch, TRUTH), atol=1e-9)
    np.testing.assert_allclose(batch.poses[~batch.linked, 0], np.tile(course.start, (2, 1)), atol=1e-12)
    assert batch.travel[:, 0].sum() == pytest.approx(np.abs(batch.measured[:, 0]).sum(), rel=0.02)


@pytest.mark.slow
def test_an_effect_is_told_from_itself_by_nothing(drives, quick):
    findings = found(drives, "turn_slip", "turn_slip")
    question = Rivals(course_of(drives, ROOM), findings.model, findings.adopted[0])
    assert question.worth(course_of(drives, ROOM).library).max() < 1e-3
    assert design_drive(findings, limits=ROOM) is None
