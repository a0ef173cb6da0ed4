"""What was learnt is told with its worth, labelled as no physics."""

import json

from proxytune.diagnosis import Learning, MatchedEffect, Ratio, Rmse
from proxytune.diagnosis.motion.discrepancy import Discrepancy, LearntError
from proxytune.report.diagnosis.learnt import learnt_document, learnt_notes

RATIO = Ratio(0.5, (0.4, 0.6))
ERROR = LearntError(2.0, Rmse(0.01, (0.009, 0.011)), Rmse(0.02, (0.01, 0.03)), RATIO)
THETA = {"learnt.turn_rate.yaw@1.0": 0.1}
SHARE = {"heading": 0.25, "turn rate": 0.75}
USED = Learning(Discrepancy(THETA, SHARE, {2.0: RATIO}, True), (ERROR,), False)
REFUSED = Learning(Discrepancy(THETA, SHARE, {2.0: RATIO}, False), (), True)


def test_the_document_has_groups_shares_and_ratios_by_horizon():
    told = json.loads(json.dumps(learnt_document(USED)))
    assert told["used"] is True
    assert told["groups"] == ["turn rate", "heading"]
    assert told["share"] == SHARE
    assert told["ratio"] == {"2": {"value": 0.5, "interval": [0.4, 0.6]}}
    assert told["errors"][0]["after"] == 0.01


def test_what_is_refused_has_no_groups_but_its_guard_is_told():
    told = learnt_document(REFUSED)
    assert (told["used"], told["groups"], told["share"], told["ratio"]) == (False, [], {}, {})
    assert told["guard"]["2"]["value"] == 0.5
    assert told["names_doubtful"] is True


def test_a_note_says_what_it_is_worth_and_that_it_is_no_physics():
    (note,) = learnt_notes(USED)
    assert "not physics" in note
    assert "turn rate (75 %)" in note
    assert "2 s: 10.0 mm, 0.50 (0.40 … 0.60)" in note


def test_what_was_tried_and_left_out_is_told_and_doubtful_names_are_warned_of():
    first, second = learnt_notes(REFUSED)
    assert "left out" in first
    assert "names are likely wrong" in second


def test_nothing_is_said_where_nothing_was_found():
    assert learnt_notes(Learning(Discrepancy(), (), False)) == []


def test_a_name_that_would_do_as_well_is_told():
    like = Learning(USED.discrepancy, USED.errors, False, MatchedEffect("turn_slip", "", {"turn_slip": 0.1}, 0.93))
    assert learnt_notes(like)[1] == "the curves look like turn_slip (turn_slip 0.1), which alone keeps 93 % of it"
    assert learnt_document(like)["looks_like"]["share"] == 0.93
    assert learnt_document(USED)["looks_like"] is None
