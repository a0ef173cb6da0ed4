"""Document and sentences of a diagnosis of motion."""

import json
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from proxytune.diagnosis import (
    RULES,
    AdoptedEffect,
    Clocks,
    Estimate,
    Learning,
    MatchedEffect,
    NextDrive,
    Offset,
    Ratio,
    Rmse,
    RobotClusters,
)
from proxytune.diagnosis.motion.clocks import Jump
from proxytune.diagnosis.motion.discrepancy import Discrepancy, LearntError
from proxytune.diagnosis.motion.moments import Period
from proxytune.diagnosis.motion.multistep_fit import MultistepFit
from proxytune.driving import read_robot
from proxytune.effects import GROUPS, FittedRange, Learnt, LearntCurve, learnt_theta
from proxytune.report.diagnosis.document import _immaterial_document, clocks_document, learnt_document, unlike_document
from proxytune.report.diagnosis.notes import (
    VERDICTS,
    clocks_notes,
    decisive,
    learnt_notes,
    may_matter,
    motion_headline,
    motion_notes,
    moves_from,
    per_cent,
    unlike_notes,
)

SLIP = AdoptedEffect("lateral_slip", "", ("lateral_slip",), (("lateral_slip",),), 75.2, 0.002, ())
BAND = AdoptedEffect("dead_band", "left wheel", ("dead_band.width",), (("dead_band.width",),), 900.0, 0.002, ())
LITTLE = {2.0: Ratio(0.999, (0.98, 1.02)), 5.0: Ratio(1.01, (0.942, 1.083))}
SURE = {2.0: Ratio(1.001, (0.98, 1.02)), 5.0: Ratio(1.01, (0.99, 1.03))}
MUCH = {2.0: Ratio(1.34, (1.2, 1.5))}


def diagnosis(**changes):
    """As much of a diagnosis as is told of it: nothing was found, but for changes."""
    empty = "edges effects negligible errors residual_depends_on could_not_be_seen clocks drive_names"
    plain = dict.fromkeys(empty.split(), ()) | dict.fromkeys(("period", "multistep", "next_drive", "robot_clusters"))
    plain |= {"log": "run", "verdict": "explained", "rules": RULES, "effect_sizes": {}, "theta": {}}
    plain |= {"expected_false_names": 0.02, "learning": Learning(Discrepancy(), (), False)}
    plain |= {"dropped_values": {"lateral_slip": Estimate(0.0024, (0.0024, 0.0024), "s")}}
    return SimpleNamespace(**{**plain, **changes})


def test_what_is_left_is_told_and_beside_an_explained_motion_that_values_may_stand_in_for_it():
    parts = {"log": SimpleNamespace(), "residual_depends_on": ("wheel speed", "heading")}
    little = " ".join(motion_notes(diagnosis(**parts)))
    assert "no named effect explains what little is left, which depends on: wheel speed, heading; the values" in little
    much = " ".join(motion_notes(diagnosis(verdict="unexplained", **parts)))
    assert "no named effect explains the rest, which depends on: wheel speed, heading" in much
    assert "may stand in for it" not in much


@pytest.mark.parametrize("verdict", VERDICTS)
def test_every_verdict_is_told_with_its_meaning(verdict):
    assert motion_headline(diagnosis(verdict=verdict)) == f"run: {verdict}: {VERDICTS[verdict]['motion']}"


def test_the_headline_has_what_was_fitted_before_the_verdict_and_warns_of_ends_and_false_names():
    """Where nothing is missing the declared values are the answer, so the first sentence has them."""
    trim = ", with trim 0.043"
    assert motion_headline(diagnosis(), "dead band: 0.1", trim).startswith(f"run: dead band: 0.1{trim}. Explained: ")
    nothing = motion_headline(diagnosis(verdict="nothing missing"), "", trim)
    assert nothing == "run: nothing missing, with trim 0.043: only noise is left"
    ends = diagnosis(effects=(BAND,), edges=BAND.names, verdict="partly explained")
    assert "dead_band.width at the end of the range stands for something else" in motion_headline(ends)
    assert "expected false names: at most 0.02" in motion_headline(diagnosis(effects=(BAND,)))
    assert "false names" not in motion_headline(diagnosis())


def test_effects_that_were_added_or_are_immaterial_say_their_worth_where_that_is_shown():
    (note,) = motion_notes(diagnosis(effects=(BAND,), effect_sizes={"dead_band": MUCH}))
    assert note == (
        "added dead_band (left wheel): log-likelihood gain 900 nats, p = 0.002; "
        "without it the error grows by 34 % (20 to 50) at 2 s"
    )
    polish = MultistepFit(2.0, {1.0: Ratio(0.95, (0.9, 1.0)), 2.0: Ratio(0.8, (0.7, 0.9))}, {})
    (note,) = motion_notes(diagnosis(multistep=polish))
    assert "fitted to windows of 2 s" in note
    assert "1 s: 0.95, 2 s: 0.80" in note
    assert np.hstack(per_cent(Ratio(1.25, (0.9, 2.0)))) == pytest.approx((25.0, -10.0, 100.0))
    assert decisive(LITTLE) == 5.0
    assert may_matter(LITTLE, RULES.material_factor)
    assert not may_matter(SURE, RULES.material_factor)
    (note,) = motion_notes(diagnosis(negligible=(SLIP,), effect_sizes={"lateral_slip": SURE}))
    assert note == (
        "detectable but immaterial: lateral_slip 0.0024 s, log-likelihood gain 75 nats, "
        "changes the error at 5 s by 1.0 % (−1.0 to +3.0)"
    )
    (note,) = motion_notes(diagnosis(negligible=(SLIP,), effect_sizes={"lateral_slip": LITTLE}))
    assert note.startswith(
        "not shown to matter: lateral_slip 0.0024 s, log-likelihood gain 75 nats, changes the error at 5 s by 1.0 % "
    )
    told = _immaterial_document(SLIP, diagnosis(effect_sizes={"lateral_slip": SURE}, robot=read_robot("duckiebot")))
    assert (told["horizon_s"], told["changes_error_by"], told["may_matter"]) == (5.0, pytest.approx(1.0), False)
    (note,) = motion_notes(diagnosis(negligible=(SLIP,)))
    assert note == "not shown to matter: lateral_slip, log-likelihood gain 75 nats"


def test_the_next_drive_is_told_with_what_it_tells_and_values_beside_what_has_no_name_as_no_physics():
    def told(nats, *between, verdict="explained"):
        drive = NextDrive("the designed drive", "so", between, nats, np.zeros((2, 2)), 20.0, 10, (4.0, 3.0), None)
        return motion_notes(diagnosis(next_drive=drive, verdict=verdict))

    often = "drive the designed drive 10 times from the same commands, and diagnose the log with these drives in it"
    assert told(9.0, "noise", "what is missing") == [f"to tell noise from what is missing, {often}: so"]
    assert told(50.0, "a", "b") == [f"to tell a from b, {often} (one minute is ample): so"]
    assert told(3.0, "a", "b", "c") == [f"to tell a from b from c, {often} (expected gain 3 nats a minute): so"]
    assert told(50.0, "a", "b", verdict="cannot be told")[1] == "the same drives tell noise from what is missing"
    assert any("no physics yet" in line for line in motion_notes(diagnosis(verdict="partly explained")))
    assert motion_notes(diagnosis()) == []
    for lost_s, text in ((0.3, "0.3"), (0.012, "0.012")):
        (note,) = motion_notes(diagnosis(period=Period(4.0, lost_s, 1e-9)))
        assert f"as if it stood for {text} s every 4.0 s" in note


NONE = Offset(0.0, (0.0, 0.0))


def clocks(latency=0.14, offset=0.0, drives=None, jumps=()):
    own = Offset(offset, (offset - 0.01, offset + 0.01)) if offset else NONE
    measured = Offset(latency, (latency - 0.01, latency + 0.01))
    return Clocks(measured, own, 0.15, drives or {}, tuple(jumps), np.zeros(2), np.zeros((2, 2)))


def test_offsets_of_clocks_can_be_written_one_clock_is_no_news_and_a_declared_offset_is_told_instead_of_a_doubt():
    found = clocks(-0.11, -0.26, {"b": Offset(0.3, (0.28, 0.32))}, [Jump("a", 31.0, -0.2)])
    told = json.loads(json.dumps(clocks_document((found,)), allow_nan=False))
    assert (told["offset_s"], told["interval"]) == (-0.26, [-0.27, -0.25])
    assert told["drives"] == {"b": {"offset_s": 0.3, "interval": [0.28, 0.32]}}
    assert told["jumps"] == [{"drive": "a", "time_s": 31.0, "by_s": -0.2}]
    assert told["drift"] == {"rate": 0.0, "interval": [0.0, 0.0]}
    assert "test" not in told
    assert clocks_document((found, clocks()))["test"]["offset_s"] == 0.0
    assert clocks_notes("yard", (clocks(),), {}) == []
    (note,) = clocks_notes("yard", (clocks(),), {"delay": 0.1})
    assert note.endswith("are one number: the delay is the robot's only if one clock stamped both")
    *_, note = clocks_notes("yard", (found,), {"delay": 0.1})
    assert note.endswith(
        "the robot's own delay cannot be told here, as an offset was taken out: set both to one clock to know it"
    )
    declared = replace(clocks(), declared_s=-0.25)
    assert clocks_document((declared,))["declared_offset_s"] == -0.25
    (note,) = clocks_notes("yard", (declared,), {"delay": 0.1})
    assert note == "poses of yard are stamped -0.25 s later than commands, as it declares; that was taken out"


@pytest.mark.parametrize(
    ("found", "says"),
    [
        (clocks(-0.11, -0.26), "motion comes 0.11 s before its command, which no robot does"),
        (clocks(-0.11, -0.26), "stamped 0.26 s too early (0.27 to 0.25) if the robot's delay is 0.15 s"),
        (
            replace(clocks(), drift=Offset(-0.002, (-0.0022, -0.0018))),
            "the poses' clock runs 0.2 % (0.18 to 0.22) slower than that of the commands; this was corrected",
        ),
        (clocks(2.0, 1.85), "motion comes 2.00 s after its command; poses are stamped 1.85 s too late"),
        (clocks(drives={"b": Offset(0.3, (0.28, 0.32))}), "in drive b poses are stamped 0.30 s later (0.28 to 0.32)"),
        (clocks(jumps=[Jump("a", 31.2, -0.2)]), "in drive a the clock jumps at about 31 s: poses are stamped 0.20 s"),
    ],
)
def test_what_is_wrong_is_one_sentence_with_what_to_do(found, says):
    (note,) = clocks_notes("yard", (found,), {})
    assert note.startswith("clocks of yard: ")
    assert says in note
    assert "\n" not in note
    assert any(word in note for word in ("Stamp both", "Check how", "Keep clocks"))


@pytest.mark.parametrize(
    ("changes", "says"),
    [
        ({"verdict": "unexplained"}, "what no effect explains can look like clocks"),
        ({"effects": (replace(BAND, effect="delay_jitter"),)}, "chance in when commands act can look like clocks"),
        ({}, ""),
    ],
)
def test_clocks_of_single_drives_are_doubted_beside_what_may_look_so(changes, says):
    odd = clocks(drives={"b": Offset(0.3, (0.28, 0.32))})
    for own, said in (odd, says), (clocks(), ""):
        told = motion_notes(diagnosis(clocks=(own,), **changes))
        assert [note for note in told if "look like" in note] == [note for note in told if said and said in note]


RATIO = Ratio(0.5, (0.4, 0.6))
ERROR = LearntError(2.0, Rmse(0.01, (0.009, 0.011)), Rmse(0.02, (0.01, 0.03)), RATIO)
THETA = {"learnt.turn_rate.yaw@1.0": 0.1}
SHARE = {"heading": 0.25, "turn rate": 0.75}
USED = Learning(Discrepancy(THETA, SHARE, {2.0: RATIO}, True), (ERROR,), False)
REFUSED = Learning(Discrepancy(THETA, SHARE, {2.0: RATIO}, False), (), False)


def test_the_document_has_groups_shares_and_ratios_and_of_what_is_refused_its_guard():
    told = json.loads(json.dumps(learnt_document(USED)))
    assert told["used"] is True
    assert told["groups"] == ["turn rate", "heading"]
    assert told["share"] == SHARE
    assert told["ratio"] == {"2": {"value": 0.5, "interval": [0.4, 0.6]}}
    assert told["errors"][0]["after"] == 0.01
    told = learnt_document(REFUSED)
    assert (told["used"], told["groups"], told["share"], told["ratio"]) == (False, [], {}, {})
    assert told["guard"]["2"]["value"] == 0.5


def test_what_is_learnt_is_told_with_its_worth_as_no_physics_and_names_that_are_doubtful_or_would_do_as_well():
    (note,) = learnt_notes(USED)
    assert "not physics" in note
    assert "turn rate (75 %)" in note
    assert "2 s: 10.0 mm, 0.50 (0.40 … 0.60)" in note
    (refused,) = learnt_notes(REFUSED)
    assert "left out" in refused
    moved = replace(USED, discrepancy=replace(USED.discrepancy, theta={**THETA, "delay": 0.1}), names_doubtful=True)
    _, own, warning = learnt_notes(moved)
    assert own == "model.toml has what was fitted along with the curves: delay 0.1"
    assert "names are likely wrong" in warning
    assert learnt_document(moved)["names_doubtful"] is True
    assert learnt_notes(Learning(Discrepancy(), (), False)) == []
    like = Learning(USED.discrepancy, USED.errors, False, MatchedEffect("turn_slip", "", {"turn_slip": 0.1}, 0.93))
    assert learnt_notes(like)[1] == "the curves look like turn_slip (turn_slip 0.1), which alone keeps 93 % of it"
    assert learnt_document(like)["looks_like"]["share"] == 0.93
    assert learnt_document(USED)["looks_like"] is None


FOUND = RobotClusters("left", (0.88, 1.02), ((0, 2), (1, 3)))
NAMES = ("a", "b", "c", "d")


def test_groups_of_drives_are_told_with_their_gains_and_only_where_they_differ():
    assert json.loads(json.dumps(unlike_document(FOUND, NAMES))) == {
        "wheel": "left",
        "groups": [{"gain": 0.88, "drives": ["a", "c"]}, {"gain": 1.02, "drives": ["b", "d"]}],
    }
    (note,) = unlike_notes(FOUND, NAMES)
    assert "0.88 in a, c but 1.02 in b, d" in note
    assert "diagnose each group alone" in note
    assert unlike_document(None, NAMES) is None
    assert unlike_notes(None, NAMES) == []


@pytest.mark.parametrize(
    ("group", "knots", "weights"),
    [
        (
            "place",
            tuple((x, y) for x in (-0.75, -0.25, 0.25, 0.75) for y in (-0.25, 0.25)),
            (0.0, 0.01, -0.02, 0.0, -0.5, -0.48, -0.52, -0.5),
        ),
        ("x", (-0.75, -0.25, 0.25, 0.75), (0.01, -0.02, -0.49, -0.51)),
    ],
)
def test_a_map_of_the_floor_is_told_in_words(group, knots, weights):
    theta = learnt_theta(Learnt(FittedRange((0.0, 1.0), (-1.0, 1.0)), (LearntCurve(group, "forward", knots, weights),)))
    notes = learnt_notes(Learning(Discrepancy(theta, {"place on the floor": 1.0}, {}, True), (), False))
    assert "slower by 50 % where x > 0 m" in notes[1]


@pytest.mark.parametrize(
    ("group", "weights", "told"),
    [
        ("held", {0.5: -0.02, 0.75: -0.56, 1.0: -0.46, 2.0: 0.04}, "100 % less from 0.75 s after either last changed"),
        ("turned", {0.2: 0.03, 0.5: -0.9}, "87 % less until 0.5 s after it turned round"),
    ],
)
def test_what_commands_lose_after_a_while_is_told_in_words(group, weights, told):
    theta = {f"learnt.{group}.duty@{knot}": weight for knot, weight in weights.items()}
    notes = learnt_notes(Learning(Discrepancy(theta, {GROUPS[group].title: 1.0}, {}, True), (), False))
    assert notes[1] == f"as that curve has it, a command counts {told}"


def test_a_car_that_its_friction_keeps_at_rest_is_told_with_the_throttle_up_to_which_it_does():
    theta = {"rolling.inertia": Estimate(0.27, (0.2, 0.3), "s"), "rolling.friction": Estimate(3.4, (2.4, 4.0), "m/s²")}
    (line,) = moves_from(SimpleNamespace(theta=theta, robot=read_robot("dart")))
    assert line.startswith("with this rolling a throttle up to 0.2 moves nothing: a dead band")
    assert moves_from(SimpleNamespace(theta={**theta, "dead_band": Estimate(0.1, (0.1, 0.1), "")})) == []
