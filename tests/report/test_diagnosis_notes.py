"""What a diagnosis says in sentences follows from its figures."""

from types import SimpleNamespace

import numpy as np
import pytest

from proxytune.diagnosis import AdoptedEffect, Estimate, Learning, Ratio
from proxytune.diagnosis.motion.discrepancy import Discrepancy
from proxytune.diagnosis.motion.manoeuvres import LIBRARY, Manoeuvre
from proxytune.diagnosis.motion.multistep_fit import MultistepFit
from proxytune.report.diagnosis.notes import MEANINGS, decisive, headline, may_matter, notes, per_cent

SLIP = AdoptedEffect("lateral_slip", "", ("lateral_slip",), (("lateral_slip",),), 75.2, 0.002, ())
BAND = AdoptedEffect("dead_band", "left wheel", ("dead_band.width",), (("dead_band.width",),), 900.0, 0.002, ())
LITTLE = {2.0: Ratio(0.999, (0.98, 1.02)), 5.0: Ratio(1.01, (0.942, 1.083))}
SURE = {2.0: Ratio(1.001, (0.98, 1.02)), 5.0: Ratio(1.01, (0.99, 1.03))}
TIMES = np.arange(20) / 20.0
MUCH = {2.0: Ratio(1.34, (1.2, 1.5))}


def diagnosis(**changes):
    plain = {"at_edge": lambda effect: ()} | {
        "log": "run",
        "verdict": "explained",
        "effects": (),
        "negligible": (),
        "effect_sizes": {},
        "multistep": None,
    }
    plain |= {"errors": (), "residual_depends_on": (), "could_not_be_seen": (), "manoeuvre": None}
    plain |= {
        "clocks": (),
        "robot_clusters": None,
        "drive_names": (),
        "learning": Learning(Discrepancy(), (), False),
        "theta": {},
    }
    plain |= {"dropped_values": {"lateral_slip": Estimate(0.0024, (0.0024, 0.0024), "s")}}
    return SimpleNamespace(**{**plain, **changes})


@pytest.mark.parametrize("verdict", MEANINGS)
def test_every_verdict_is_told_with_its_meaning(verdict):
    assert headline(diagnosis(verdict=verdict)) == f"run: {verdict}: {MEANINGS[verdict]}"


def test_an_effect_that_was_added_says_what_the_error_is_without_it():
    (note,) = notes(diagnosis(effects=(BAND,), effect_sizes={"dead_band": MUCH}))
    assert note == (
        "added dead_band (left wheel): log-likelihood gain 900 nats, p = 0.002; "
        "without it the error grows by 34 % (20 to +50) at 2 s"
    )


def test_an_effect_that_is_shown_not_to_matter_is_called_immaterial():
    (note,) = notes(diagnosis(negligible=(SLIP,), effect_sizes={"lateral_slip": SURE}))
    assert note == (
        "detectable but immaterial: lateral_slip 0.0024 s, log-likelihood gain 75 nats, "
        "changes the error at 5 s by 1.0 % (−1.0 to +3.0)"
    )


def test_an_effect_that_may_matter_is_not_called_immaterial():
    (note,) = notes(diagnosis(negligible=(SLIP,), effect_sizes={"lateral_slip": LITTLE}))
    assert note.startswith(
        "not shown to matter: lateral_slip 0.0024 s, log-likelihood gain 75 nats, changes the error at 5 s by 1.0 % "
    )


def test_an_effect_that_could_not_be_weighed_is_not_shown_to_matter():
    assert notes(diagnosis(negligible=(SLIP,))) == ["not shown to matter: lateral_slip, log-likelihood gain 75 nats"]


def test_where_noise_is_not_known_a_manoeuvre_is_to_be_driven_ten_times():
    name, text, shape = LIBRARY[0]
    again = Manoeuvre(name, text, ("noise", "what is missing"), None, shape(TIMES), 10)
    (note,) = notes(diagnosis(manoeuvre=again))
    assert note.startswith("to tell noise from what is missing, drive figure-eight 10 times from the same commands")
    rivals = Manoeuvre(name, text, ("a", "b"), 50.0, shape(TIMES), 10)
    lines = notes(diagnosis(manoeuvre=rivals))
    assert lines[0].startswith("to tell a from b, drive figure-eight (one minute is ample): ")
    assert "10 times" in lines[1]
    (weak,) = notes(diagnosis(manoeuvre=Manoeuvre(name, text, ("a", "b"), 3.0, shape(TIMES))))
    assert "(expected gain 3 nats a minute)" in weak
    assert len(notes(diagnosis(manoeuvre=Manoeuvre(name, text, ("a", "b"), 50.0, shape(TIMES))))) == 1


def test_parameters_fitted_to_windows_are_told_with_what_that_did():
    polish = MultistepFit(2.0, {1.0: Ratio(0.95, (0.9, 1.0)), 2.0: Ratio(0.8, (0.7, 0.9))}, {})
    (note,) = notes(diagnosis(multistep=polish))
    assert "fitted to windows of 2 s" in note
    assert "1 s: 0.95, 2 s: 0.80" in note


def test_a_ratio_is_told_as_what_it_adds():
    value, ends = per_cent(Ratio(1.25, (0.9, 2.0)))
    assert (value, *ends) == pytest.approx((25.0, -10.0, 100.0))
    assert decisive(LITTLE) == 5.0
    assert may_matter(LITTLE)
    assert not may_matter(SURE)


def test_a_value_at_the_end_of_its_range_is_no_physics():
    lines = notes(diagnosis(effects=(BAND,), at_edge=lambda effect: effect.names))
    assert "beware: dead_band.width at the end of the range: it probably stands for something else" in lines


def test_beside_what_has_no_name_values_are_no_physics_yet():
    lines = notes(diagnosis(verdict="partly explained"))
    assert any("no physics yet" in line for line in lines)
    assert notes(diagnosis()) == []
