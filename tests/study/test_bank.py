"""A bank says before anything is measured what a target would tell."""

from pathlib import Path

import pytest

from proxytune.study.bank import _starts_needed

BANK = {"target": None, "preflight": "true", "budget": "10", "engine": None}


@pytest.mark.slow
def test_a_bank_says_what_a_target_would_tell(make_study, answered):
    """Its document has trials, widths, agents and starts in place of an answer, its folder a page and a table."""
    folder = make_study(**BANK)
    found = answered("study", folder)
    bank = found["bank"]
    assert "best" not in found
    assert (bank["trials"], bank["starts"]) == (10, 3)
    assert set(bank["agents"]) == {f"agent{number}" for number in range(6)}
    assert 0.0 < bank["expected_interval"]["trim"] < 0.6
    assert Path(found["table"]).stat().st_size < 2**20
    assert "trim" in Path(found["report"]).read_text()
    again = answered("study", folder)
    assert again["episodes"]["run"] == 0
    assert again["bank"] == bank


def test_more_trials_are_the_same_design_gone_on_with(make_study, answered):
    """A budget that is raised keeps what is there."""
    folder = make_study(**{**BANK, "budget": "6"})
    answered("study", folder)
    make_study(**{**BANK, "budget": "9"})
    assert answered("study", folder)["episodes"]["run"] == 3 * 6 * 3


def test_starts_needed_follow_from_two_numbers_of_starts():
    """What trials leave unknown no start makes less."""
    assert _starts_needed({1: 0.1, 4: 0.05}, 20) == 10
    assert _starts_needed({1: 0.1, 4: 0.1}, 20) is None
