"""Clocks are told in numbers and in sentences that say what to do."""

import json
from dataclasses import replace

import numpy as np
import pytest

from proxytune.diagnosis import Clocks, Offset
from proxytune.diagnosis.motion.clocks import Jump
from proxytune.report.diagnosis.clocks import clocks_document, clocks_notes

NONE = Offset(0.0, (0.0, 0.0))


def clocks(latency=0.14, offset=0.0, drives=None, jumps=()):
    own = Offset(offset, (offset - 0.01, offset + 0.01)) if offset else NONE
    measured = Offset(latency, (latency - 0.01, latency + 0.01))
    return Clocks(measured, own, 0.15, drives or {}, tuple(jumps), np.zeros(2), np.zeros((2, 2)))


def test_the_document_has_what_was_promised_and_can_be_written():
    found = clocks(-0.11, -0.26, {"b": Offset(0.3, (0.28, 0.32))}, [Jump("a", 31.0, -0.2)])
    told = json.loads(json.dumps(clocks_document((found,)), allow_nan=False))
    assert (told["offset_s"], told["interval"]) == (-0.26, [-0.27, -0.25])
    assert told["drives"] == {"b": {"offset_s": 0.3, "interval": [0.28, 0.32]}}
    assert told["jumps"] == [{"drive": "a", "time_s": 31.0, "by_s": -0.2}]
    assert "test" not in told
    assert clocks_document((found, clocks()))["test"]["offset_s"] == 0.0


def test_one_clock_is_no_news_but_a_delay_is_said_to_be_one_number_with_an_offset():
    assert clocks_notes("yard", (clocks(),), {}) == []
    (note,) = clocks_notes("yard", (clocks(),), {"delay": 0.1})
    assert "one number" in note


@pytest.mark.parametrize(
    ("found", "says"),
    [
        (clocks(-0.11, -0.26), "motion comes 0.11 s before its command, which no robot does"),
        (clocks(-0.11, -0.26), "stamped 0.26 s too early (0.27 to 0.25) if the robot's delay is 0.15 s"),
        (clocks(2.0, 1.85), "motion comes 2.00 s after its command; poses are stamped 1.85 s too late"),
        (clocks(drives={"b": Offset(0.3, (0.28, 0.32))}), "in drive b poses are stamped 0.30 s later (0.28 to 0.32)"),
        (
            clocks(jumps=[Jump("a", 31.2, -0.2)]),
            "in drive a the clock jumps at about 31 s: poses are stamped 0.20 s earl",
        ),
    ],
)
def test_what_is_wrong_is_one_sentence_with_what_to_do(found, says):
    (note,) = clocks_notes("yard", (found,), {})
    assert note.startswith("clocks of yard: ")
    assert says in note
    assert "\n" not in note
    assert any(word in note for word in ("Stamp both", "Check how", "Keep clocks"))


def test_an_offset_that_the_log_declares_is_told_instead_of_a_doubt():
    declared = replace(clocks(), declared_s=-0.25)
    assert clocks_document((declared,))["declared_offset_s"] == -0.25
    (note,) = clocks_notes("yard", (declared,), {"delay": 0.1})
    assert note == "poses of yard are stamped -0.25 s later than commands, as it declares; that was taken out"
