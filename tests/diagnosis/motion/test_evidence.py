"""Named effects and curves are weighed against each other by one measure of evidence."""

from types import SimpleNamespace

import numpy as np
import pytest

from proxytune.diagnosis import RULES, SignalCurve
from proxytune.diagnosis.motion.evidence import Evidence, FittedCandidate, exceeds_names, list_tried
from proxytune.diagnosis.motion.random_effects import RandomEffect
from proxytune.diagnosis.motion.screening import Candidate, ScreenedCandidate


def lead(effect, held_out, p_value=0.002):
    form = Candidate(effect, "", ((effect,),), {}, (0.0,), ((1.0,),))
    return ScreenedCandidate(form, (1.0,), (1.0,), held_out, held_out, p_value, np.zeros(3))


def curve(gain):
    return SignalCurve(SimpleNamespace(name="time", effects=()), gain, np.zeros(1))


@pytest.mark.parametrize(
    ("gain", "best", "beyond"),
    [(31.0, 0.0, True), (29.0, 0.0, False), (110.0, 90.0, False), (131.0, 100.0, True), (590.0, 500.0, False)],
)
def test_a_curve_goes_beyond_names_by_a_fifth_and_thirty_nats(gain, best, beyond):
    assert exceeds_names(curve(gain), best, RULES) == beyond


def test_an_effect_is_listed_by_its_full_fit_where_it_has_one_and_random_effects_among_them():
    fitted, screened = lead("yaw_scrub", 20.0), lead("turn_slip", 50.0, 0.3)
    lost = RandomEffect("dropped_commands", "dropped_commands", 0.1, (0.0, 1.0), 60.0, 0.01)
    evidence = Evidence([screened, fitted], {"yaw_scrub": FittedCandidate(80.0, None, fitted)}, (lost,), [])
    listed = [(one.effect, one.gain, one.p_value) for one in list_tried(evidence)]
    assert listed == [("yaw_scrub", 80.0, 0.002), ("dropped_commands", 60.0, 0.01), ("turn_slip", 50.0, 0.3)]
