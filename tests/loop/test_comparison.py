"""What a loop says: what was lacking, what it is worth, and no more than the intervals allow."""

import pytest
from tiny_loop import DIAGNOSIS

from proxytune.loop.comparison import Compared, Level, answer, compare_errors, floor_text, level_text, next_step

CAMERA = {
    "verdict": "explained",
    "effects": [{"name": "field_of_view"}],
    "extended": {"blur": {"value": 0.03}},
    "error": {
        "before": 2.94,
        "before_interval": [2.8, 3.07],
        "after": 0.23,
        "after_interval": [0.21, 0.26],
        "noise_floor": 0.23,
        "unit": "px",
    },
    "grey_error": {"before": None, "before_interval": [None, None], "after": None, "unit": "grey levels"},
}
STUDIED = "θ found: trim 0.1. Next: raise budget from 20 to 40, to get closer."


def prpv(before, after):
    return Compared("prpv", "PRPV of the agents tuned on", "", before, after, 132)


LOW, HIGH, BETWEEN = Level(8.0, (3.0, 12.0)), Level(28.0, (21.0, 45.0)), Level(20.0, (10.0, 30.0))


@pytest.mark.parametrize(
    ("before", "after", "says"),
    [
        (HIGH, LOW, "falls from 28 (21 to 45) to 8 (3 to 12)"),
        (HIGH, BETWEEN, "goes from 28 (21 to 45) to 20 (10 to 30); the intervals overlap"),
        (LOW, HIGH, "does not fall: 8 (3 to 12) before, 28 (21 to 45) after"),
        (Level(28.0, None), LOW, "goes from 28 to 8 (3 to 12)"),
    ],
)
def test_a_fall_is_claimed_where_the_intervals_are_apart(before, after, says):
    told = answer(DIAGNOSIS, [prpv(before, after)])
    assert told == f"The simulator lacked: dead band (verdict: explained). With it, PRPV of the agents tuned on {says}."


def test_motion_and_camera_are_told_together_and_what_has_no_name_or_was_not_measured_as_that():
    both = {**DIAGNOSIS, "camera": CAMERA}
    told = answer(both, [prpv(HIGH, LOW), *compare_errors(both)])
    assert "The simulator lacked: dead band and field of view" in told
    assert "position in windows of 2 s, planar plant falls from 80 mm (70 to 90) to 4 mm (3.9 to 4.1)" in told
    assert "displacement of markings falls from 2.94 px (2.8 to 3.07) to 0.23 px (0.21 to 0.26)" in told
    unchanged = {**both, "camera": {**CAMERA, "effects": []}}
    assert "markings" not in answer(unchanged, [prpv(HIGH, LOW), *compare_errors(unchanged)])
    position, markings = compare_errors({**DIAGNOSIS, "camera": CAMERA})
    assert floor_text(position.before, position.unit) == "3.9 to 4.2 mm"
    assert floor_text(markings.before, markings.unit) == "0.23 px"
    assert floor_text(Level(8.0, None, 2.0, (0.0, 6.0)), "") == "2 (0 to 6)"
    assert (floor_text(LOW, ""), level_text(None, "")) == ("–", "–")
    curves = {**DIAGNOSIS, "effects": [], "verdict": "unexplained"}
    assert "what no named effect explains (verdict: unexplained)" in answer(curves, [prpv(HIGH, LOW)])
    assert [row.key for row in compare_errors({**DIAGNOSIS, "camera": CAMERA})] == ["error", "markings_error"]


def test_what_is_next_follows_from_what_was_found():
    told = next_step(DIAGNOSIS, STUDIED, "loop/model.toml", {"trim": 0.01, "blur": 0.05})
    assert "Run your simulator with loop/model.toml" in told
    assert "from scores alone: blur 0.05" in told
    assert "trim" not in told
    drive = {"name": "spins", "description": "turns on the spot"}
    told = next_step({**DIAGNOSIS, "verdict": "partly explained", "next_manoeuvre": drive}, STUDIED, "model.toml", {})
    assert told == "Log spins (turns on the spot), and close the loop with that log."
    assert next_step(DIAGNOSIS, STUDIED, "", {}) == "Raise budget from 20 to 40, to get closer."
    misfit = "No θ fits. Next: log drives and run `python -m proxytune diagnose LOG`."
    assert "log drives that can show saturation" in next_step(DIAGNOSIS, misfit, "", {})
