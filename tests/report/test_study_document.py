import json
from dataclasses import replace

import pytest

from proxytune.report.page import page
from proxytune.report.study_document import study_document
from proxytune.report.study_table import best_theta, cut_lines, failure_lines, identity_lines, usefulness_lines
from proxytune.search.engines import make_proposer
from proxytune.space import Interval
from proxytune.study.preflight import Movement, Preflight
from proxytune.study.progress import Silent
from proxytune.study.result import result_of
from proxytune.study.run import run_study
from proxytune.study.store import Store
from proxytune.study.study import open_study


@pytest.fixture
def result(finished):
    with Store.read(finished) as store:
        return result_of(open_study(finished), store)


def test_the_document_has_the_promised_keys_and_is_plain_json(result):
    document = json.loads(json.dumps(study_document(result), allow_nan=False))
    best = result.best
    assert document["best"]["theta"] == dict(best.trial.theta)
    assert document["best"]["prpv"] == best.trial.prpv
    assert document["best"]["prpv_interval"] == [best.assessment.prpv_interval.low, best.assessment.prpv_interval.high]
    assert document["best"]["ppv"] == best.trial.ppv
    assert document["noise_floor"] == best.assessment.noise_floor.value
    assert [trial["index"] for trial in document["trials"]] == [1, 2, 3, 4, 5, 6, 7]
    assert {"index", "theta", "prpv", "ppv", "failed_episodes"} <= set(document["trials"][0])
    assert document["target"] == {
        "path": str(result.study.settings.target),
        "agents": 6,
        "episodes_per_agent": [3, 3],
    }
    assert document["settings"]["parameters"] == {"delay": [0.0, 0.3], "trim": [-0.3, 0.3]}


def test_people_see_the_same(result):
    assert [row[0] for row in best_theta(result)] == ["delay", "trim"]
    assert best_theta(result)[0][1].endswith(" s")
    lines = usefulness_lines(result)
    assert lines[0].startswith(f"PRPV {result.best.trial.prpv:g} of at most 30, interval ")
    assert any(line.startswith("noise floor ") for line in lines)
    assert failure_lines(result) == []


def test_that_every_parameter_matters_is_said_too(result):
    moved = Movement(Interval("trim", -0.3, 0.3), 0.01, "distance", 2.0, 0.5, 12, False)
    flown = replace(result, preflight=Preflight({"trim": 0.0}, (moved,), 144))
    assert study_document(result)["preflight"] is None
    assert study_document(flown)["preflight"]["parameters"]["trim"] == {
        "moves": True,
        "p_value": 0.01,
        "metric": "distance",
        "change": 2.0,
        "noise": 0.5,
        "pairs": 12,
    }
    assert identity_lines(flown)[0] == "pre-flight: every parameter changes the metrics beyond noise"
    assert flown.episodes == result.episodes + 144


def test_what_was_cut_off_and_saved_is_told(result):
    assert cut_lines(result) == []
    assert study_document(result)["trials"][0]["cut_off"] is None
    first, *others = result.trials
    cut = replace(first, state="cut", prpv=None, ppv=None, decided=("agent0", "agent2"), bound=12.0, estimate=17.5)
    found = replace(result, trials=(cut, *others), spared=(12, 3.456))
    (line,) = cut_lines(found)
    assert line == "cut off: 1 trials that could not be among the best; 12 episodes saved, about 3.46 s of simulation"
    document = study_document(found)
    assert document["cut_off"] == {"trials": 1, "episodes": 12, "seconds": 3.456}
    assert document["trials"][0]["prpv"] is None
    assert document["trials"][0]["cut_off"] == {
        "prpv_at_least": 12.0,
        "prpv_estimate": 17.5,
        "agents": ["agent0", "agent2"],
    }
    assert "<td>cut off, at least 12</td>" in page(found, [])
    assert found.episodes == result.episodes - 12


def test_failed_episodes_are_told_with_the_first_of_them(make_study):
    folder = make_study(domain={"faults": '["agent3:1:raises"]'}, budget="6")
    with Store.open(folder) as store:
        run_study(open_study(folder), store, make_proposer("gp", 5), Silent())
        result = result_of(open_study(folder), store)
    head, first, *_ = failure_lines(result)
    assert head == "6 of 108 episodes failed; the first:"
    assert first.startswith("  trial 1: agent 'agent3' failed from start 1: ")
    assert study_document(result)["trials"][0]["failed_episodes"] == 1
