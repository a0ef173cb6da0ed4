"""What was chosen beside an effect that does harm is searched for again without it."""

import sys
from dataclasses import replace
from pathlib import Path

import pytest

sys.path.append(str(Path(__file__).parent))

from planted import DECLARED, NOISE, TRUTH, planted_drives

from proxytune.diagnosis.model.fitting import evaluate
from proxytune.diagnosis.naming import names as naming
from proxytune.diagnosis.naming.findings import AdoptedEffect, Findings

MIXED = {**TRUTH, "yaw_scrub": 0.13, "lateral_slip": 0.002}
SLIP, SCRUB = (AdoptedEffect(name, "", (name,), ((name,),), 60.0, 0.002, ()) for name in ("lateral_slip", "yaw_scrub"))


@pytest.fixture(scope="module")
def base():
    return evaluate(planted_drives(MIXED, episodes=6, seconds=20.0), TRUTH, DECLARED, NOISE)


def searching(answers, asked):
    """A search that adopts what is given, in that order, less what it is to do without."""

    def search(base, seed, report, without=()):
        asked.append(without)
        effects = tuple(effect for effect in answers if effect.effect not in without)
        theta = {**TRUTH, **{effect.effect: MIXED[effect.effect] for effect in effects}}
        free = DECLARED + tuple(coordinate for effect in effects for coordinate in effect.free)
        return Findings(base, evaluate(base.drives, theta, free, NOISE), effects, (), (), ())

    return search


def named(base, monkeypatch, *answers, harmful=True):
    whole = naming.drop_immaterial

    def weighed(found, seed):
        kept = whole(found, seed)
        return replace(kept, immaterial=tuple(one._replace(harmful=harmful) for one in kept.immaterial))

    monkeypatch.setattr(naming, "drop_immaterial", weighed)
    asked, told = [], []
    monkeypatch.setattr(naming, "search", searching(answers, asked))
    return naming.name_effects(base, 1, told.append), asked, told


@pytest.mark.slow
def test_an_effect_that_misled_is_left_out_of_a_second_search_and_still_told(base, monkeypatch):
    found, asked, told = named(base, monkeypatch, SLIP, SCRUB)
    assert asked == [(), ("lateral_slip",)]
    assert "searching again without lateral_slip" in told
    assert [effect.effect for effect in found.adopted] == ["yaw_scrub"]
    assert [dropped.effect.effect for dropped in found.immaterial] == ["lateral_slip"]


def test_an_effect_that_does_no_harm_misled_nobody(base, monkeypatch):
    found, asked, _ = named(base, monkeypatch, SLIP, SCRUB, harmful=False)
    assert asked == [()]
    assert [effect.effect for effect in found.adopted] == ["yaw_scrub"]


@pytest.mark.slow
def test_an_effect_that_was_found_last_and_does_not_matter_misled_nobody(base, monkeypatch):
    found, asked, _ = named(base, monkeypatch, SCRUB, SLIP)
    assert asked == [()]
    assert [dropped.effect.effect for dropped in found.immaterial] == ["lateral_slip"]


@pytest.mark.slow
def test_the_second_search_is_not_taken_where_it_predicts_worse(base, monkeypatch):
    monkeypatch.setattr(naming, "predicts_no_worse", lambda one, other: False)
    found, asked, _ = named(base, monkeypatch, SLIP, SCRUB)
    assert len(asked) == 2
    assert [effect.effect for effect in found.adopted] == ["yaw_scrub"]
    assert len(found.immaterial) == 1
