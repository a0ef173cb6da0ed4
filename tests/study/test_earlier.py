"""A bank says what a target would tell; earlier studies count before the first trial, or are refused by their names."""

import json
import re
import shutil
from pathlib import Path
from types import SimpleNamespace

import pytest
from one_line import complaint_of
from wobbly import Wobbly

from proxytune.api import read_study, run_study
from proxytune.cli.main import main
from proxytune.errors import ProxytuneError
from proxytune.report.bank import bank_sentence
from proxytune.storage import Store
from proxytune.study import StudyRun, open_study, read_study_settings
from proxytune.study.bank import _starts_needed
from proxytune.study.earlier import BANK_FILE, earlier_trials, learn

BANK = {"target": None, "preflight": "true", "budget": "10", "engine": None}
LEARNS = {"learn_from": '["../bank"]', "budget": "0", "engine": None, "confirm": "1"}


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


def test_more_trials_are_the_same_design_gone_on_with_and_starts_needed_follow_from_two_numbers(make_study, answered):
    """A budget that is raised keeps what is there."""
    folder = make_study(**{**BANK, "budget": "6"})
    answered("study", folder)
    make_study(**{**BANK, "budget": "9"})
    assert answered("study", folder)["episodes"]["run"] == 3 * 6 * 3
    # What trials leave unknown no start makes less.
    assert _starts_needed({1: 0.1, 4: 0.05}, 20) == 10
    assert _starts_needed({1: 0.1, 4: 0.1}, 20) is None


def test_a_bank_says_where_more_starts_seem_to_tell_less():
    def sentence(later):
        known = {1: {"trim": 0.08}, 3: {"trim": later}}
        settings = SimpleNamespace(starts=3, agents=("one",))
        facts = {"widths": known.get, "expected": known, "units": {"trim": ""}, "agents": [("one", 1.0)], "failed": {}}
        return bank_sentence(SimpleNamespace(**facts, trials=12, settings=settings))

    assert sentence(0.083).endswith("one tell most.")
    assert sentence(0.09).endswith("More starts seem to tell less of trim: widths are known roughly; raise budget.")


def test_a_bank_answers_though_an_agent_always_scores_the_same(make_study, answered, monkeypatch):
    own, alike = Wobbly.run, {"distance": 1.0, "survival_time": 5.0}
    monkeypatch.setattr(Wobbly, "run", lambda self, one: alike if one.agent == "agent3" else own(self, one))
    found = answered("study", make_study(**BANK))
    assert found["sentence"].startswith("10 trials: 6 agents measured from 3 starts tell delay to")
    assert found["bank"]["agents"][-1] == "agent3"


def test_a_bank_names_the_agent_whose_failures_leave_it_without_an_answer(make_study, answered):
    found = answered("study", make_study(**BANK, domain={"faults": "['agent3:*:raises']"}))
    assert found["sentence"].startswith("agent3 failed from every start in 10 of 10 trials, too many to say what 6")


@pytest.fixture(scope="module")
def bank(make_studies):
    """A bank that has been run."""
    folder = make_studies("bank", **BANK)
    assert main(["study", str(folder), "--json"]) == 0
    return folder


@pytest.fixture
def beside(bank, tmp_path):
    """The same bank beside a test's own studies."""
    return Path(shutil.copytree(bank, tmp_path / "bank"))


def test_knowledge_alone_answers_without_a_trial(beside, make_study):
    """With budget = 0 the document has posterior, answer, misfit and confirmation, and no trial was run."""
    found = run_study(make_study(**LEARNS)).document()
    assert found["trials"] == []
    assert found["earlier"] == 10
    assert found["best"]["index"] is None
    assert found["best"]["fresh"]["prpv"] is not None
    assert found["misfit"]["p_value"] is not None
    low, high = found["best"]["theta_interval"]["trim"]
    assert low <= 0.1 <= high
    assert high - low < 0.3


@pytest.mark.slow
def test_a_study_with_knowledge_has_no_design(beside, make_study):
    """The first trial is proposed from what is known; the answer knows of earlier trials too."""
    known = run_study(make_study(**{**LEARNS, "budget": "2"})).document()
    alone = run_study(make_study("alone", engine=None, budget="2")).document()
    assert [one["index"] for one in known["trials"]] == [1, 2]
    assert known["earlier"] == 10
    assert known["trials"][0]["theta"] != alone["trials"][0]["theta"]
    assert known["best"]["region_share"] < alone["best"]["region_share"] + 1e-9


@pytest.mark.parametrize(("initial", "spared"), [("5", "all 5"), ("12", "10 of 12")])
def test_a_design_whose_place_is_taken_is_told_once(beside, make_study, initial, spared):
    folder = make_study(**{**LEARNS, "budget": "2", "initial": initial})
    with Store.open(folder) as store:
        run = StudyRun(open_study(folder), store)
        assert learn(run) == (f"initial: {spared} trials of the design are left out, as learn_from knows 10",)
        assert learn(run) == ()


@pytest.mark.slow
def test_what_is_learnt_is_a_fact(beside, make_study):
    """A source that grows, or goes, changes nothing of a study that has learnt from it."""
    folder = make_study(**LEARNS)
    first = run_study(folder).document()
    make_study("bank", **{**BANK, "budget": "12"})
    assert main(["study", str(beside), "--json"]) == 0
    assert run_study(folder).document() == first
    shutil.rmtree(beside)
    assert run_study(folder).document() == first == read_study(folder).document()


@pytest.mark.slow
def test_a_table_knows_what_its_study_knows(beside, make_study):
    """The table that a bank writes gives the same answer as its database, to the digits that it has."""
    first = run_study(make_study(**LEARNS)).document()["best"]["theta_interval"]
    (beside / "study.db").unlink()
    second = run_study(make_study("other", **LEARNS)).document()["best"]["theta_interval"]
    assert second == {name: pytest.approx(ends, abs=0.01) for name, ends in first.items()}


@pytest.mark.slow
def test_trials_of_another_seed_are_another_placement(beside, make_study):
    """Trials that share the study's seed have its placement, 0; others one of their own."""
    for seed, placement in (("1", 0), ("2", 1)):
        folder = make_study(f"seed{seed}", **{**LEARNS, "seed": seed})
        run_study(folder)
        with Store.read(folder) as store:
            assert {one.placement for one in earlier_trials(StudyRun(open_study(folder), store))} == {placement}


def _cut_in_half(path):
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])


def _edit_table(folder, **changes):
    """Leave the source its table alone, in which these keys are others; a function changes what is there."""
    (folder / "study.db").unlink()
    table = json.loads((folder / BANK_FILE).read_text())
    table |= {key: value(table[key]) if callable(value) else value for key, value in changes.items()}
    (folder / BANK_FILE).write_text(json.dumps(table))


def _other_code(folder, shift):
    """Make the source's table one of other code, whose scores differ by so much."""

    def shifted(trials):
        return [
            [theta, [[one and [value + shift for value in one] for one in row] for row in rows]]
            for theta, rows in trials
        ]

    _edit_table(folder, facts=lambda own: own | {"identity": "other"}, trials=shifted)


@pytest.mark.slow
def test_other_code_that_plays_the_same_counts(beside, make_study):
    """Twelve episodes of a source of other code are driven again; where they come out alike it counts."""
    _other_code(beside, 0.0)
    report = run_study(make_study(**LEARNS))
    assert report.document()["earlier"] == 10
    assert report.spent.unused == 12


BAD = {
    "another robot": (
        {},
        lambda bank: _edit_table(bank, facts=lambda own: own | {"identity": "other", "domain.robot": '"cart"'}),
        "domain.robot is .*cart.* there",
    ),
    "other agents": ({"agents": '["agent0", "agent1"]'}, None, "has not driven agent2, agent3"),
    "fewer starts": ({"starts": "2"}, None, "has driven from 2 starts, and this study asks for 3"),
    "other code": ({}, lambda bank: _other_code(bank, 0.5), "its code or versions are others, and agent"),
    "half a database": ({}, lambda bank: _cut_in_half(bank / "study.db"), "study.db: "),
    "half a table": (
        {},
        lambda bank: ((bank / "study.db").unlink(), _cut_in_half(bank / BANK_FILE)),
        "no table of trials",
    ),
    "a seed below 0": ({}, lambda bank: _edit_table(bank, facts=lambda own: own | {"seed": -1}), "no table of trials"),
    "metrics": ({}, lambda bank: _edit_table(bank, metrics=["a", "b"]), "has no scores of distance, survival_time"),
    "θ cut short": (
        {},
        lambda bank: _edit_table(bank, trials=lambda own: [*own[1:], [{"trim": 0.1}, own[0][1]]]),
        "no table of trials",
    ),
    "a score beyond all": (
        {},
        lambda bank: _edit_table(
            bank, trials=lambda own: [[theta, [[[1e308, 1.0]] * 3] * len(rows)] for theta, rows in own]
        ),
        "no table of trials",
    ),
    "no table": (
        {},
        lambda bank: [(bank / "study.db").unlink(), (bank / BANK_FILE).write_text("a")],
        "learn_from: .*table",
    ),
    "not run": ({}, lambda bank: [(bank / name).unlink() for name in ("study.db", BANK_FILE)], "run it first"),
    "an empty folder": ({}, lambda bank: [one.unlink() for one in bank.iterdir()], "is a folder without study.toml"),
    "not there": ({}, lambda bank: shutil.rmtree(bank), "no such study or table of trials"),
}


@pytest.mark.parametrize(("changes", "spoil", "words"), BAD.values(), ids=BAD)
def test_a_source_that_is_none_is_refused(changes, spoil, words, tmp_path, bank, make_study):
    """One line names the study.toml or the file, the source, what is wrong and what to do."""
    if changes:
        main(["study", str(make_study("bank", **{**BANK, **changes})), "--json"])
    else:
        spoil(Path(shutil.copytree(bank, tmp_path / "bank")))
    with pytest.raises(ProxytuneError, match=words) as refused:
        run_study(make_study(**LEARNS))
    assert str(refused.value).count("\n") == 0
    assert "bank" in str(refused.value)


def test_a_source_that_is_none_a_bank_without_a_target_also_alone_and_a_circle_are_refused(make_study, beside):
    """No system has such a path: one line, as of any that is not there."""
    with pytest.raises(ProxytuneError, match="no such study or table of trials"):
        run_study(make_study(**{**LEARNS, "learn_from": json.dumps(["a" * 5000])}))
    folder = make_study(**{**LEARNS, "learn_from": '["../study"]'})
    with pytest.raises(ProxytuneError, match="is this very study"):
        run_study(folder)
    make_study("monday", **{**LEARNS, "learn_from": '["../study"]'})
    make_study(**{**LEARNS, "learn_from": '["../monday"]'})
    with pytest.raises(ProxytuneError, match="monday: learns from this study in turn"):
        run_study(folder)
    # Commands that need a target refuse it in one line.
    with pytest.raises(ProxytuneError, match="target: is missing, so this is a bank"):
        run_study(beside)


SETTINGS = {
    "nothing known": ({"budget": "0"}, "budget: is 0, and nothing is known"),
    "a bank by learning value": ({"target": None, "objective": '"plv"'}, "objective: 'plv' needs a target"),
    "a bank that learns": ({"target": None, "preflight": "true", "learn_from": '["x"]'}, "learn_from: is for studies"),
    "a bank without pre-flight": ({"target": None}, "preflight: is off"),
    "learning value that learns": ({"objective": '"plv"', "learn_from": '["x"]'}, "learn_from: has scores"),
}


@pytest.mark.parametrize(("changes", "words"), SETTINGS.values(), ids=SETTINGS)
def test_settings_that_know_nothing_are_refused(changes, words, make_study):
    """One line names the key and says what to do."""
    assert words in complaint_of(read_study_settings, make_study(**changes))


@pytest.mark.slow
def test_a_damaged_fact_is_told(beside, make_study):
    """What was learnt is not as it was written: one line, no traceback."""
    folder = make_study(**LEARNS)
    run_study(folder)
    with Store.open(folder) as store:
        store.save_fact("learnt", {"trials": 3})
    with pytest.raises(ProxytuneError, match="'learnt' is not as proxytune writes it"):
        run_study(folder)


CHEAPER = {"low_fidelity": '["../bank"]', "engine": None, "budget": "6"}
OTHER = {"version": '"2"'}
"""The domain of a proxy which the bank is not of."""


@pytest.mark.slow
def test_trials_of_a_cheaper_proxy_are_known_and_are_no_trials(beside, make_study):
    """The design is driven all the same; what was copied is a fact; one that does nearly the same tells a lot."""
    folder = make_study(domain=OTHER, **CHEAPER)
    first = run_study(folder).document()
    alone = run_study(make_study("alone", domain=OTHER, **{**CHEAPER, "low_fidelity": None})).document()
    assert (first["low_fidelity"], first["earlier"]) == (10, 0)
    assert [one["theta"] for one in first["trials"][:5]] == [one["theta"] for one in alone["trials"][:5]]
    assert first["trials"][5]["theta"] != alone["trials"][5]["theta"]
    assert first["best"]["region_share"] < alone["best"]["region_share"]
    shutil.rmtree(beside)
    assert run_study(folder).document() == first == read_study(folder).document()


@pytest.mark.slow
def test_a_study_with_a_cheaper_proxy_goes_on_as_if_it_had_not_stopped(beside, make_study):
    """Five trials and then three more are the same eight."""
    run_study(make_study(domain=OTHER, **{**CHEAPER, "budget": "5"}))
    in_two = run_study(make_study(domain=OTHER, **{**CHEAPER, "budget": "8"})).document()
    at_once = run_study(make_study("at_once", domain=OTHER, **{**CHEAPER, "budget": "8"})).document()
    assert in_two["trials"] == at_once["trials"]
    assert in_two["best"] == at_once["best"]


NO_CHEAPER = {
    "the same proxy": ({}, {}, "low_fidelity: .*is of this very proxy, so its trials count in full"),
    "other agents": ({"agents": '["agent0", "agent1", "agent7"]'}, OTHER, "no agent 'agent7'"),
    "more starts": ({"starts": "5"}, OTHER, "low_fidelity: .*bank.* has driven from 3 starts"),
    "an engine that learns from scores": ({"engine": '"gp"'}, OTHER, "low_fidelity: engine 'gp' cannot tell"),
    "no trial of its own": ({"budget": "0"}, OTHER, "budget: is 0, and nothing is known"),
    "a bank": ({"target": None, "preflight": "true"}, OTHER, "low_fidelity: is for studies with a target"),
    "learning value": ({"objective": '"plv"'}, OTHER, "low_fidelity: has scores"),
}


@pytest.mark.parametrize(("changes", "domain", "words"), NO_CHEAPER.values(), ids=NO_CHEAPER)
def test_a_cheaper_proxy_that_is_none_is_refused(changes, domain, words, beside, make_study):
    """One line names the key, what is wrong and what to do."""
    assert re.search(words, complaint_of(run_study, make_study(domain=domain, **{**CHEAPER, **changes})))


def test_a_cheaper_proxy_takes_half_a_design_and_what_its_domain_has_otherwise_is_said_once(make_study, beside):
    """The default of initial is 4 then, and what is written counts."""
    written = [CHEAPER | {"initial": initial} for initial in (None, "6")]
    assert [read_study_settings(make_study(**one)).initial for one in written] == [4, 6]
    assert read_study_settings(make_study(initial=None)).initial == 8
    # One line when its trials are copied; then they are a fact.
    folder = make_study(domain=OTHER, **CHEAPER)
    with Store.open(folder) as store:
        run = StudyRun(open_study(folder), store)
        (line,) = learn(run)
        assert line.endswith('bank: domain.version is not given there and "2" here')
        assert learn(run) == ()
