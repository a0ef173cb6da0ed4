import io
import json
from dataclasses import replace

import numpy as np
import pytest
from confirmations import LACKS, TOLD, UNTOLD, confirmed, planted
from rich.console import Console

from proxytune.report.page.rendering import html_of
from proxytune.report.study.document import study_document
from proxytune.report.study.finding import finding_of
from proxytune.report.study.page import study_page
from proxytune.report.study.search_rows import cut_rows, failure_rows, search_rows
from proxytune.report.study.table import INFORMATION, SEARCH, THETA, USEFULNESS, study_table
from proxytune.report.study.usefulness_table import floor_rows, misfit_row, usefulness_notes, usefulness_rows
from proxytune.report.study.verdict import sentence
from proxytune.search import make_proposer
from proxytune.space import Interval
from proxytune.storage import Store
from proxytune.study import Preflight, StudyRun, open_study, result_of, run_study
from proxytune.study.preflight import Movement


@pytest.fixture
def result(finished):
    with Store.read(finished) as store:
        return result_of(StudyRun(open_study(finished), store))


def test_the_document_has_the_promised_keys_and_is_plain_json(result):
    document = json.loads(json.dumps(study_document(result), allow_nan=False))
    best = result.best
    assert document["best"]["theta"] == dict(best.trial.theta)
    assert document["best"]["prpv"] == best.trial.prpv
    assert document["best"]["prpv_interval"] == [best.assessment.prpv_interval.low, best.assessment.prpv_interval.high]
    assert document["best"]["ppv"] == best.trial.ppv
    assert [trial["index"] for trial in document["trials"]] == [1, 2, 3, 4, 5, 6, 7]
    assert {"index", "theta", "prpv", "ppv", "failed_episodes"} <= set(document["trials"][0])
    assert document["target"] == {
        "path": str(result.study.settings.target),
        "files": [str(result.study.settings.target)],
        "agents": 6,
        "episodes_per_agent": [3, 3],
    }
    assert document["settings"]["parameters"] == {"delay": [0.0, 0.3], "trim": [-0.3, 0.3]}


def of_plain_types(value):
    """Whether JSON's own types are all there is: numpy's would print, and differ by version."""
    if isinstance(value, dict):
        return all(type(key) is str and of_plain_types(one) for key, one in value.items())
    if isinstance(value, list):
        return all(map(of_plain_types, value))
    return type(value) in (str, int, float, bool, type(None))


def test_every_value_is_of_json_s_own_types(result):
    assert of_plain_types(study_document(result))
    assert not of_plain_types({"share": np.float64(0.5)})


def test_what_is_known_of_theta_is_in_the_document(result):
    document = study_document(replace(planted(result, misfit=LACKS), truth={"trim": 0.1}, cautions=("few starts",)))
    best = document["best"]
    assert list(best["theta_interval"]) == ["delay", "trim"]
    assert best["theta_interval"]["trim"] == pytest.approx([0.0765, 0.1235], abs=0.002)
    assert best["region_share"] == pytest.approx(6 * np.pi * 0.05 * 0.02, rel=0.2)
    assert best["unidentified"] == []
    assert document["misfit"] == {"p_value": 0.002, "fits": False, "deviance": 9.0, "expected_deviance": 1.1}
    assert document["as_good"] == {
        "region_share": 0.0625,
        "theta_interval": {"delay": [0.03, 0.21], "trim": [0.05, 0.15]},
    }
    assert document["information"]["trim"] == {
        "agents": {"agent1": 1.0},
        "metrics": {"distance": 0.75, "survival_time": 0.25},
        "limit": "trials",
    }
    assert (document["truth"], document["cautions"]) == ({"trim": 0.1}, ["few starts"])
    assert study_document(result)["truth"] is None
    assert study_document(planted(result, misfit=UNTOLD))["misfit"]["fits"] is None


def test_pairs_that_trade_are_in_the_document(result):
    (trade,) = study_document(planted(result, (0.5, 0.5), (0.1, 0.1), correlation=-0.9))["trades"]
    assert trade[:2] == ["delay", "trim"]
    assert trade[2] == pytest.approx(-0.9, abs=0.05)
    assert study_document(planted(result))["trades"] == []


def test_the_document_tells_the_floor_s_kind_and_whether_the_proxy_is_as_good_as_perfect(result):
    document = study_document(result)
    floor = result.floor
    assert (document["noise_floor_kind"], document["cannot_be_told_from_perfect"]) == ("halves", False)
    assert (document["noise_floor"], document["noise_floor_interval"]) == (floor.value, [floor.low, floor.high])
    assert document["chance"] == result.judged.chance.mean


def shown(result):
    console = Console(width=300, file=io.StringIO())
    console.print(study_table(result, "none run", {"figure": "convergence.png"}))
    return console.file.getvalue()


def test_the_first_line_is_the_sentence_that_json_has_too_then_the_table(result):
    first, *others = shown(result).splitlines()
    assert first == sentence(finding_of(result)) == study_document(result)["sentence"]
    titles = [line for line in others if line in (THETA, USEFULNESS, INFORMATION, SEARCH)]
    assert titles == [THETA, USEFULNESS, INFORMATION, SEARCH]
    assert others[2].split()[:2] == ["parameter", "best"]
    assert others[-2].split() == ["episodes", "none", "run"]
    assert others[-1].rstrip() == "figure: convergence.png"


def test_names_are_shown_as_they_are_and_not_taken_for_markup(result):
    told = (replace(TOLD[0], agents=(("[red]agent", 1.0),)), TOLD[1])
    assert "[red]agent 100 %" in shown(planted(result, information=told))


def test_people_see_what_the_proxy_is_worth(result):
    rows = {label.strip(): rest for label, *rest in usefulness_rows(result)}
    assert list(rows) == ["PRPV", "halves", "chance", "PPV", "misfit (p)"]
    value, interval, meaning = rows["PRPV"]
    assert value == f"{result.best.trial.prpv:g}"
    assert " to " in interval
    assert "0 to 30" in meaning
    assert rows["PPV"][2].startswith("proxy predictivity value")
    assert failure_rows(result) == []
    label, text = search_rows(result)[0]
    assert (label, text.startswith("7 of 7; best: trial ")) == ("trials", True)


def test_halves_are_not_called_a_noise_floor(result):
    (row,) = floor_rows(result.floor)
    assert row[0].strip() == "halves"
    assert "upper bound" in row[3]
    (row,) = floor_rows(replace(result.floor, kind="same starts", value=5.0, low=1.0, high=9.0))
    assert row[:3] == ("  noise floor", "5", "1 to 9")
    assert row[3] == "target against itself from the same starts: what a perfect proxy scores"
    assert floor_rows(replace(result.floor, value=None)) == []


def test_the_floor_of_a_confirmed_study_is_said_to_be_the_proxy_s_own(result):
    assert not [row for row in usefulness_rows(result) if "this one re-run" in row[3]]
    again = confirmed(result, kind="same starts")
    assert [row for row in usefulness_rows(again) if "this one re-run" in row[3]]


def test_notes_give_no_advice_that_study_cannot_follow(result):
    assert any("--unpaired" in note for note in result.judged.notes)
    assert usefulness_notes(result)
    assert not any("--unpaired" in note for note in usefulness_notes(result))


def test_it_is_said_whether_any_theta_explains_the_target(result):
    row = misfit_row(planted(result))
    assert row == ("misfit (p)", "0.4", "", "some θ may explain the target's scores")
    lacking = misfit_row(planted(result, misfit=LACKS))
    assert (lacking[1], lacking[3]) == ("0.002", "no θ explains the target's scores")
    assert "too few" in misfit_row(planted(result, misfit=UNTOLD))[3]


def test_how_a_study_came_to_its_end_is_said_and_a_study_under_way_says_nothing(result):
    assert study_document(result)["stopped"] == "the budget of 7 trials is spent"
    assert search_rows(result)[0][1].endswith("; ended: the budget of 7 trials is spent")
    under_way = replace(result, stopped="")
    assert study_document(under_way)["stopped"] is None
    assert "ended" not in search_rows(under_way)[0][1]


def test_more_trials_than_the_budget_are_not_written_as_a_share_of_it(result):
    settings = replace(result.study.settings, budget=5)
    lowered = replace(result, study=replace(result.study, settings=settings))
    assert search_rows(lowered)[0][1].startswith("7 (budget 5); best: trial ")


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
    assert search_rows(flown)[1] == ("pre-flight", "every parameter changes some metric beyond noise")
    still = replace(flown.preflight, movements=(replace(moved, p_value=0.5),))
    label, warning = search_rows(replace(flown, preflight=still))[1]
    assert (label, warning.startswith("'trim' is not shown to change a metric")) == ("pre-flight", True)
    assert flown.episodes == result.episodes + 144


def test_what_was_cut_off_and_saved_is_told(result):
    assert cut_rows(result) == []
    assert study_document(result)["trials"][0]["cut_off"] is None
    first, *others = result.trials
    cut = replace(first, state="cut", score=17.5, measures={}, decided=("agent0", "agent2"), bound=12.0)
    found = replace(result, trials=(cut, *others), spared=(12, 3.456))
    (row,) = cut_rows(found)
    assert row == ("stopped early", "1 trial that could not be the best; saved 12 episodes (3.46 s)")
    document = study_document(found)
    assert document["cut_off"] == {"trials": 1, "episodes": 12, "seconds": 3.456}
    assert document["trials"][0]["prpv"] is None
    assert document["trials"][0]["cut_off"] == {
        "prpv_at_least": 12.0,
        "prpv_estimate": 17.5,
        "agents": ["agent0", "agent2"],
    }
    assert "<td>stopped early, at least 12</td>" in html_of(study_page(found, {}))
    assert found.episodes == result.episodes - 12


def test_failed_episodes_are_told_with_the_first_of_them(make_study):
    folder = make_study(domain={"faults": '["agent3:1:raises"]'}, budget="6")
    with Store.open(folder) as store:
        study_run = StudyRun(open_study(folder), store)
        run_study(study_run, make_proposer("gp", 5))
        result = result_of(StudyRun(open_study(folder), store))
    head, first, *_ = failure_rows(result)
    assert head == ("failed", "6 of 108 episodes; the first:")
    assert first[1].startswith("trial 1: agent 'agent3' failed from start 1: ")
    assert study_document(result)["trials"][0]["failed_episodes"] == 1
