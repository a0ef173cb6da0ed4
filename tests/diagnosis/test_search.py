"""The search adds effects one at a time, as long as each has evidence enough and no signal says far more."""

import sys
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

sys.path.append(str(Path(__file__).parent))

from planted import DECLARED, NOISE, ROBOT, TRUTH, planted_drives

from proxytune.diagnosis.model.fitting import evaluate
from proxytune.diagnosis.naming import search as searching
from proxytune.diagnosis.naming.candidates import candidates
from proxytune.diagnosis.naming.evidence import Evidence, FittedLead
from proxytune.diagnosis.naming.flexible import Curve
from proxytune.diagnosis.naming.screening import Lead
from proxytune.effects import CATALOGUE

FORMS = [
    form
    for form in candidates(ROBOT, TRUTH, ("trim", "delay"))
    if not form.form and not CATALOGUE[form.effect].trace.placed
]


@pytest.fixture(scope="module")
def base():
    return evaluate(planted_drives(TRUTH, episodes=4, seconds=12.0), TRUTH, DECLARED, NOISE)


def adopted(base, monkeypatch, *rounds):
    """The gains of the effects adopted in rounds, each with an effect's gain and a curve's; and the remainder's."""
    left = iter(rounds)

    def gather_evidence(model, taken, seed):
        gain, curve = next(left, (0.0, 0.0))
        form = next(form for form in FORMS if form.effect not in taken)
        neutral = {name: value for names, value in zip(form.free, form.neutral, strict=True) for name in names}
        lead = Lead(form, form.probes[0], form.probes[0], gain, gain, 0.002, np.ones(3))
        signal = Curve(SimpleNamespace(name="time", effects=()), curve, np.zeros(1))
        fitted = replace(base, theta={**base.theta, **neutral})
        return Evidence([lead], {form.label: FittedLead(lead, fitted, gain)}, (), [signal])

    monkeypatch.setattr(searching, "gather_evidence", gather_evidence)
    monkeypatch.setattr(searching, "drop_idle", lambda model, effects: (model, effects))
    found = searching.search(base, 1, lambda line: None)
    return [effect.gain for effect in found.adopted], [curve.gain for curve in found.remainder]


@pytest.mark.parametrize(("gain", "expected"), [(10.0, []), (14.9, []), (15.1, [15.1])])
def test_an_effect_needs_fifteen_nats(base, monkeypatch, gain, expected):
    assert adopted(base, monkeypatch, (gain, 0.0)) == (expected, [])


@pytest.mark.parametrize(("gain", "expected"), [(40.0, [5000.0]), (60.0, [5000.0, 60.0])])
def test_after_much_evidence_a_hundredth_of_it_is_needed(base, monkeypatch, gain, expected):
    assert adopted(base, monkeypatch, (5000.0, 0.0), (gain, 0.0)) == (expected, [])


def test_no_more_than_five_effects_are_added(base, monkeypatch):
    assert adopted(base, monkeypatch, *[(100.0, 0.0)] * 9)[0] == [100.0] * 5


def test_no_first_effect_is_added_where_a_signal_says_far_more(base, monkeypatch):
    assert adopted(base, monkeypatch, (100.0, 140.0)) == ([], [140.0])
    assert adopted(base, monkeypatch, (100.0, 125.0))[0] == [100.0]
    assert adopted(base, monkeypatch, (200.0, 238.0))[0] == [200.0]


@pytest.mark.parametrize(("curve", "expected"), [(300.0, [500.0, 100.0]), (400.0, [500.0])])
def test_a_later_effect_is_added_if_it_says_a_third_of_what_a_signal_does(base, monkeypatch, curve, expected):
    assert adopted(base, monkeypatch, (500.0, 0.0), (100.0, curve))[0] == expected
