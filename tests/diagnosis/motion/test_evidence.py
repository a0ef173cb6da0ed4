"""Named effects and curves are weighed against each other by one measure of evidence."""

from types import SimpleNamespace

import numpy as np
import pytest

from proxytune.diagnosis import Curve
from proxytune.diagnosis.motion.evidence import Evidence, FittedLead, curves_beyond_names, list_tried
from proxytune.diagnosis.motion.random_effects import RandomEffect
from proxytune.diagnosis.motion.screening import Candidate, Lead


def lead(effect, held_out, p_value=0.002):
    form = Candidate(effect, "", ((effect,),), {}, (0.0,), ((1.0,),))
    return Lead(form, (1.0,), (1.0,), held_out, held_out, p_value, np.zeros(3))


def curve(gain):
    return Curve(SimpleNamespace(name="time", effects=()), gain, np.zeros(1))


@pytest.mark.parametrize(
    ("gain", "best", "beyond"),
    [(31.0, 0.0, True), (29.0, 0.0, False), (110.0, 90.0, False), (131.0, 100.0, True), (590.0, 500.0, False)],
)
def test_a_curve_goes_beyond_names_by_a_fifth_and_thirty_nats(gain, best, beyond):
    evidence = Evidence([], {}, (), [curve(gain)])
    assert bool(curves_beyond_names(evidence, best)) == beyond


def test_an_effect_is_listed_by_its_full_fit_where_it_has_one_and_random_effects_among_them():
    fitted, screened = lead("yaw_scrub", 20.0), lead("turn_slip", 50.0, 0.3)
    lost = RandomEffect("dropped_commands", "dropped_commands", 0.1, (0.0, 1.0), 60.0, 0.01)
    evidence = Evidence([screened, fitted], {"yaw_scrub": FittedLead(fitted, None, 80.0)}, (lost,), [])
    listed = [(one.effect, one.gain, one.p_value) for one in list_tried(evidence)]
    assert listed == [("yaw_scrub", 80.0, 0.002), ("dropped_commands", 60.0, 0.01), ("turn_slip", 50.0, 0.3)]
