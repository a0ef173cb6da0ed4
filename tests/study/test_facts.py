"""A resume names what has changed, versions by their names; which search proposed which trials is kept."""

import sqlite3

import pytest
from searched import changed, searched

from proxytune.errors import SettingsError, StoreError
from proxytune.storage import Store
from proxytune.study import StudyRun, check_facts, open_study, stored_run, study_facts
from proxytune.study.facts import SEARCH, changes, note_search

NOW = {"numpy": "2.0", "pybullet": "3.2.6"}


@pytest.fixture
def versions(monkeypatch):
    """The formula tells versions of packages."""
    monkeypatch.setattr("wobbly.Wobbly.versions", NOW, raising=False)


def test_another_version_of_a_package_is_told_by_its_name_unless_the_family_changed(make_study, versions, monkeypatch):
    folder = make_study()
    searched(changed(folder))
    monkeypatch.setattr("wobbly.Wobbly.identity", "wobbly, other PyBullet")
    monkeypatch.setattr("wobbly.Wobbly.versions", {**NOW, "pybullet": "3.2.7"})
    with pytest.raises(SettingsError, match=r"since the first trial: PyBullet 3\.2\.7 \(was 3\.2\.6\); put it back"):
        searched(changed(folder))
    with Store.read(folder) as store:
        assert stored_run(open_study(folder), store).study.identity == "wobbly 1 ()"
    before = study_facts(open_study(make_study()))
    monkeypatch.setattr("wobbly.Wobbly.versions", {"numpy": "2.0"})
    monkeypatch.setattr("wobbly.Wobbly.identity", "another")
    assert changes(before, study_facts(open_study(make_study(domain={"version": '"2"'})))) == [
        "domain.version (was nothing)"
    ]


def searches(folder):
    with Store.read(folder) as store:
        return [(one["first_trial"], one["code"]) for one in store.facts()[SEARCH]]


def noted(folder):
    with Store.open(folder) as store:
        check_facts(StudyRun(open_study(folder), store))
        return note_search(open_study(folder), store)


@pytest.fixture
def code(monkeypatch):
    """Make the engine's code another one."""

    def change(name):
        monkeypatch.setattr("proxytune.study.facts.engine_code", lambda engine: name)

    change("one")
    return change


def test_which_search_proposed_which_trials_is_kept_and_a_change_is_told_but_not_refused(make_study, code, monkeypatch):
    folder = make_study()
    assert (noted(folder), searches(folder)) == ("", [(1, "one")])
    searched(changed(folder))
    make_study(budget="9")
    assert (noted(folder), searches(folder)) == ("", [(1, "one")])
    code("two")
    assert noted(folder) == (
        "trials from 8 on are proposed by another search than those before: the code of the engine"
    )
    assert searches(folder) == [(1, "one"), (8, "two")]
    monkeypatch.setattr("proxytune.study.facts.versions_of", lambda packages: dict.fromkeys(packages, "9"))
    assert "scikit-learn 9 (was " in noted(folder)
    assert len(searched(changed(folder))[1]) == 9


@pytest.mark.slow
def test_a_search_that_proposed_nothing_is_forgotten(finished, make_study, code):
    make_study(budget="8")
    noted(finished)
    make_study(budget="9")
    searched(changed(finished))
    make_study(budget="10")
    code("two")
    noted(finished)
    code("one")
    assert (noted(finished), searches(finished)[:1]) == ("", [(8, "one")])
    code("three")
    noted(finished)
    assert searches(finished) == [(8, "one"), (10, "three")]


def test_nothing_is_said_or_kept_of_the_search_once_all_trials_are_proposed(finished, code):
    before = sqlite3.connect(finished / "study.db").execute("SELECT * FROM facts").fetchall()
    assert noted(finished) == ""
    assert sqlite3.connect(finished / "study.db").execute("SELECT * FROM facts").fetchall() == before


@pytest.mark.parametrize(
    ("fact", "value"),
    [(SEARCH, 7), (SEARCH, {"a": 1}), (SEARCH, [7]), (SEARCH, [{"first_trial": "x"}]), ("versions", [1])],
)
def test_facts_of_the_code_that_are_not_as_we_write_them_are_refused_in_one_line(finished, make_study, fact, value):
    make_study(budget="9")
    with Store.open(finished) as store:
        store.save_fact(fact, value)
    with pytest.raises(StoreError, match=f"'{fact}' is not as proxytune writes it"), Store.open(finished) as store:
        run = StudyRun(open_study(finished), store)
        check_facts(run)
        note_search(run.study, store)
