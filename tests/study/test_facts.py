"""Studies of earlier code go on; which search proposed which trials is kept; changed versions are told by name."""

import sqlite3

import pytest

from proxytune.cli.main import main
from proxytune.errors import SettingsError, StoreError
from proxytune.search import make_proposer
from proxytune.storage import Store
from proxytune.study import StudyRun, check_facts, note_search, open_study, run_trials, study_facts
from proxytune.study.facts import SEARCH
from proxytune.study.opening import changes
from proxytune.study.run import as_stored

NOW = {"numpy": "2.0", "pybullet": "3.2.6"}


@pytest.fixture
def newer(monkeypatch):
    """A later version of the family: the same episodes under another identity, and versions of packages."""
    monkeypatch.setattr("wobbly.Wobbly.identity", "wobbly by another rule", raising=False)
    monkeypatch.setattr("wobbly.Wobbly.earlier_identities", ("unheard of", "wobbly 1 ()"), raising=False)
    monkeypatch.setattr("wobbly.Wobbly.versions", NOW, raising=False)


def resumed(folder):
    with Store.open(folder) as store:
        study_run = StudyRun(open_study(folder), store)
        run_trials(study_run, make_proposer("gp", 5))
        return study_run.spent, store.trials()


def test_a_study_of_an_earlier_identity_goes_on_without_an_episode_run_again(finished, make_study, newer):
    with Store.read(finished) as store:
        trials = store.trials()
    assert resumed(finished)[0].episodes == 0
    make_study(budget="9")
    spent, after = resumed(finished)
    assert (spent.episodes, after[:7], len(after)) == (2 * 6 * 3, trials, 9)
    with Store.read(finished) as store:
        assert store.facts()["identity"] == "wobbly by another rule"
        assert store.facts()["versions"] == NOW


def test_it_goes_on_to_the_trials_that_it_would_have_had(finished, make_study, make_studies, newer):
    make_study(budget="9")
    fresh = make_studies("fresh", budget="9")
    assert resumed(finished)[1] == resumed(fresh)[1]


def test_the_result_of_an_earlier_identity_can_be_looked_at_and_stays_as_it_is(finished, newer):
    before = (finished / "study.db").read_bytes()
    with Store.read(finished) as store:
        assert as_stored(open_study(finished), store).identity == "wobbly 1 ()"
    assert (finished / "study.db").read_bytes() == before


def test_an_identity_that_is_none_of_the_earlier_is_refused(finished, newer, monkeypatch):
    monkeypatch.setattr("wobbly.Wobbly.earlier_identities", ("unheard of",))
    with pytest.raises(SettingsError, match="the domain family"):
        resumed(finished)


def test_another_version_of_a_package_is_told_by_its_name(finished, newer, monkeypatch):
    resumed(finished)
    monkeypatch.setattr("wobbly.Wobbly.identity", "wobbly, other PyBullet")
    monkeypatch.setattr("wobbly.Wobbly.versions", {**NOW, "pybullet": "3.2.7"})
    with pytest.raises(SettingsError, match=r"since the first trial: PyBullet 3\.2\.7 \(was 3\.2\.6\); put it back"):
        resumed(finished)
    with Store.read(finished) as store:
        assert as_stored(open_study(finished), store).identity == "wobbly by another rule"


def test_looking_at_a_study_edited_since_names_the_edit_alone(finished, make_study, newer, monkeypatch):
    resumed(finished)
    monkeypatch.setattr("wobbly.Wobbly.identity", "wobbly, other PyBullet")
    monkeypatch.setattr("wobbly.Wobbly.versions", {**NOW, "pybullet": "3.2.7"})
    make_study(seed="3")
    with (
        Store.read(finished) as store,
        pytest.raises(SettingsError, match=r"trial: seed \(was 1\); put"),
    ):
        as_stored(open_study(finished), store)


def test_versions_of_a_family_that_is_told_something_else_go_without_saying(make_study, newer, monkeypatch):
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
    resumed(folder)
    make_study(budget="9")
    assert (noted(folder), searches(folder)) == ("", [(1, "one")])
    code("two")
    assert noted(folder) == (
        "trials from 8 on are proposed by another search than those before: the code of the engine"
    )
    assert searches(folder) == [(1, "one"), (8, "two")]
    monkeypatch.setattr("proxytune.study.facts.versions_of", lambda packages: dict.fromkeys(packages, "9"))
    assert "scikit-learn 9 (was " in noted(folder)
    assert len(resumed(folder)[1]) == 9


def test_a_search_that_proposed_nothing_is_forgotten(finished, make_study, code):
    make_study(budget="8")
    noted(finished)
    make_study(budget="9")
    resumed(finished)
    make_study(budget="10")
    code("two")
    noted(finished)
    code("one")
    assert (noted(finished), searches(finished)[:1]) == ("", [(8, "one")])
    code("three")
    noted(finished)
    assert searches(finished) == [(8, "one"), (10, "three")]


def test_a_change_is_told_whatever_the_objective(make_study, code):
    folder = make_study(objective='"ppv"')
    noted(folder)
    resumed(folder)
    make_study(objective='"ppv"', budget="9")
    code("two")
    assert noted(folder).startswith("trials from 8 on are proposed by another search")
    assert searches(folder) == [(1, "one"), (8, "two")]


def test_nothing_is_said_or_kept_of_the_search_once_all_trials_are_proposed(finished, code):
    before = sqlite3.connect(finished / "study.db").execute("SELECT * FROM facts").fetchall()
    assert noted(finished) == ""
    assert sqlite3.connect(finished / "study.db").execute("SELECT * FROM facts").fetchall() == before


def test_a_sweep_finds_the_episodes_of_an_earlier_identity(make_study, newer, monkeypatch, capsys):
    folder, command = make_study(), ["sweep", "--parameter", "trim", "--points", "2"]
    with monkeypatch.context() as then:
        then.setattr("wobbly.Wobbly.identity", "wobbly 1 ()")
        assert main([*command, str(folder)]) == 0
    assert "36 episodes run" in capsys.readouterr().out
    assert main([*command, str(folder)]) == 0
    assert "\n0 episodes run" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("fact", "value"),
    [(SEARCH, 7), (SEARCH, {"a": 1}), (SEARCH, [7]), (SEARCH, [{"first_trial": "x"}]), ("versions", [1])],
)
def test_what_code_a_study_was_made_by_is_refused_in_one_line_where_it_is_not_as_we_write_it(
    finished, make_study, newer, fact, value
):
    make_study(budget="9")
    with Store.open(finished) as store:
        store.save_fact(fact, value)
    with pytest.raises(StoreError, match=f"'{fact}' is not as proxytune writes it"), Store.open(finished) as store:
        run = StudyRun(open_study(finished), store)
        check_facts(run)
        note_search(run.study, store)
