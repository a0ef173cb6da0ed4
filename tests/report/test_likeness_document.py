"""Drives that seem to be of two robots are named with what to do."""

import json

from proxytune.diagnosis import RobotClusters
from proxytune.report.diagnosis.likeness import unlike_document, unlike_notes

FOUND = RobotClusters("left", (0.88, 1.02), ((0, 2), (1, 3)))
NAMES = ("a", "b", "c", "d")


def test_both_groups_are_told_with_their_gains():
    told = json.loads(json.dumps(unlike_document(FOUND, NAMES)))
    assert told == {
        "wheel": "left",
        "groups": [{"gain": 0.88, "drives": ["a", "c"]}, {"gain": 1.02, "drives": ["b", "d"]}],
    }
    (note,) = unlike_notes(FOUND, NAMES)
    assert "0.88 in a, c but 1.02 in b, d" in note
    assert "diagnose each group alone" in note


def test_drives_that_are_alike_are_no_news():
    assert unlike_document(None, NAMES) is None
    assert unlike_notes(None, NAMES) == []
