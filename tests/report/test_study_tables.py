"""Document and tables of a study."""

import json
from dataclasses import replace

import numpy as np
import pytest
from confirmations import LACKS, TOLD, UNTOLD, confirmed, planted
from readable import on_terminal
from searched import looked_at, searched

from proxytune.report import study_document, study_sentence, study_text
from proxytune.report.study import page
from proxytune.search.posterior import Misfit
from proxytune.space import Interval
from proxytune.study import Preflight, open_study
from proxytune.study.preflight import Movement


def row_of(table, name):
    """The row of a name; None where there is none."""
    return next((row for row in table.rows if row[0] == name), None)


def test_the_document_has_the_promised_keys_in_json_s_own_types(result):
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

    assert of_plain_types(study_document(result))
    assert not of_plain_types({"share": np.float64(0.5)})


def of_plain_types(value):
    """Whether JSON's own types are all there is: numpy's would print, and differ by version."""
    if isinstance(value, dict):
        return all(type(key) is str and of_plain_types(one) for key, one in value.items())
    if isinstance(value, list):
        return all(map(of_plain_types, value))
    return type(value) in (str, int, float, bool, type(None))


def test_the_document_has_the_promised_keys_what_is_known_of_theta_floor_and_pairs_that_trade(result):
    document = study_document(replace(planted(result, misfit=LACKS), truth={"trim": 0.1}, cautions=("few starts",)))
    best = document["best"]
    assert list(best["theta_interval"]) == ["delay", "trim"]
    assert best["theta_interval"]["trim"] == pytest.approx([0.0765, 0.1235], abs=0.002)
    assert best["region_share"] == pytest.approx(6 * np.pi * 0.05 * 0.02, rel=0.2)
    assert best["unidentified"] == []
    assert document["misfit"] == {"p_value": 0.002, "fits": False, "deviance": 9.0, "expected_deviance": 1.1}
    ends = {"delay": [0.03, 0.21], "trim": [0.05, 0.15]}
    assert document["as_good"] == {"region_share": 0.0625, "theta_interval": ends}
    assert document["information"]["trim"] == {
        "agents": {"agent1": 1.0},
        "metrics": {"distance": 0.75, "survival_time": 0.25},
        "limit": "trials",
    }
    assert (document["truth"], document["cautions"]) == ({"trim": 0.1}, ["few starts"])
    assert study_document(result)["truth"] is None
    assert study_document(planted(result, misfit=UNTOLD))["misfit"]["fits"] is None
    (trade,) = study_document(planted(result, (0.5, 0.5), (0.1, 0.1), correlation=-0.9))["trades"]
    assert trade[:2] == ["delay", "trim"]
    assert trade[2] == pytest.approx(-0.9, abs=0.05)
    assert study_document(planted(result))["trades"] == []
    document = study_document(result)
    floor = result.floor
    assert (document["noise_floor_kind"], document["cannot_be_told_from_perfect"]) == ("halves", False)
    assert (document["noise_floor"], document["noise_floor_interval"]) == (floor.value, [floor.low, floor.high])
    assert document["chance"] == result.judged.chance.mean


def shown(result):
    return on_terminal(study_text(result, "none run", {"figure": "convergence.png"}), width=300)


def test_the_first_line_is_the_sentence_that_json_has_too_then_tables_with_names_and_values_as_they_are(result):
    first, *others = shown(result).splitlines()
    assert first == study_sentence(result) == study_document(result)["sentence"]
    titles = [line for line in others if line in (page.THETA, page.USEFULNESS, page.INFORMATION, page.SEARCH)]
    assert titles == [page.THETA, page.USEFULNESS, page.INFORMATION, page.SEARCH]
    assert others[2].split()[:2] == ["parameter", "best"]
    assert others[-2].split() == ["episodes", "none", "run"]
    assert others[-1].rstrip() == "figure: convergence.png"
    told = (replace(TOLD[0], agents=(("[red]agent", 1.0),)), TOLD[1])
    assert "[red]agent 100 %" in shown(planted(result, information=told))
    assert any("--unpaired" in note for note in result.judged.notes)
    assert not any("--unpaired" in note for note in page.usefulness_table(result).notes)


def test_people_see_what_the_proxy_is_worth_and_halves_are_not_called_a_noise_floor(result):
    rows = {label.strip(): rest for label, *rest in page.usefulness_table(result).rows}
    assert list(rows) == ["PRPV", "halves", "chance", "PPV", "misfit (p)"]
    value, interval, meaning = rows["PRPV"]
    assert value == f"{result.best.trial.prpv:g}"
    assert interval == ""
    assert "0 to 30" in meaning
    assert rows["PPV"][2].startswith("proxy predictivity value")
    assert not row_of(page.search_table(result), "failed")
    label, text = page.search_table(result).rows[0]
    assert (label, text.startswith("7 of 7; best: trial ")) == ("trials", True)
    assert "upper bound" in row_of(page.usefulness_table(result), "  halves")[3]
    known = with_floor(result, kind="same starts", value=5.0, low=1.0, high=9.0)
    row = row_of(page.usefulness_table(known), "  noise floor")
    assert row[1:3] == ("5", "1 to 9")
    assert row[3] == "target against itself from the same starts: what a perfect proxy scores"
    assert not row_of(page.usefulness_table(with_floor(result, value=None)), "  halves")


def with_floor(result, **changes):
    own = result.best.assessment
    floor = replace(own.noise_floor, **changes)
    return replace(result, best=replace(result.best, assessment=replace(own, noise_floor=floor)))


def test_what_is_expected_a_perfect_proxy_s_score_the_excess_and_whether_any_theta_explains_is_told(result):
    again = confirmed(result, kind="same starts", value=5.0, low=1.2, high=9.1)
    table = page.usefulness_table(again)
    assert row_of(table, "PRPV")[1:] == ("12", "8 to 20", "wrongly ordered pairs, 0 to 30; expected, in 5 more runs")
    assert row_of(table, "  noise floor")[1:] == ("5", "1 to 10", "what a perfect proxy scores against this target")
    assert row_of(table, "  excess") == ("  excess", "7", "−2 to 19", "more than a perfect proxy; may be none")
    # All below: 12 − 20, its ends 8 − 31 and 20 − 21.
    below = page.usefulness_table(confirmed(result, kind="same starts", value=20.0, low=21.0, high=31.0))
    assert row_of(below, "  excess") == ("  excess", "−8", "−23 to −1", "less than a perfect proxy, so not worse")
    touching = page.usefulness_table(confirmed(result, kind="same starts", value=20.0, low=20.2, high=31.0))
    assert row_of(touching, "  excess")[2:] == ("−23 to 0", "more than a perfect proxy; may be none")
    document = study_document(again)
    assert document["best"]["expected_prpv"] == {"value": 12, "interval": [8.0, 20.0]}
    assert document["excess"]["value"] == 7.0
    assert not row_of(page.usefulness_table(result), "  excess")
    assert study_document(result)["best"]["expected_prpv"] is study_document(result)["excess"] is None
    row = row_of(page.usefulness_table(planted(result)), "misfit (p)")
    assert row == ("misfit (p)", "0.4", "", "some θ may explain the target's scores")
    lacking = row_of(page.usefulness_table(planted(result, misfit=LACKS)), "misfit (p)")
    assert (lacking[1], lacking[3]) == ("0.002", "no θ explains the target's scores")
    assert "too few" in row_of(page.usefulness_table(planted(result, misfit=UNTOLD)), "misfit (p)")[3]
    silent = row_of(page.usefulness_table(planted(result, misfit=Misfit(None, None, None))), "misfit (p)")
    assert silent[1:] == ("–", "", "no test whether any θ explains the target's scores: these tell nothing of θ")


def test_how_a_study_came_to_its_end_what_matters_and_what_was_cut_off_and_saved_is_said(result):
    assert study_document(result)["stopped"] == "the budget of 7 trials is spent"
    assert page.search_table(result).rows[0][1].endswith("; ended: the budget of 7 trials is spent")
    under_way = replace(result, stopped="")
    assert study_document(under_way)["stopped"] is None
    assert "ended" not in page.search_table(under_way).rows[0][1]
    lowered = replace(result, study=replace(result.study, settings=replace(result.study.settings, budget=5)))
    assert page.search_table(lowered).rows[0][1].startswith("7 (budget 5); best: trial ")
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
    assert page.search_table(flown).rows[1] == ("pre-flight", "every parameter changes some metric beyond noise")
    still = replace(flown.preflight, movements=(replace(moved, p_value=0.5),))
    vague = planted(replace(flown, preflight=still), deviation=(0.05, 3.0))
    label, warning = page.search_table(vague).rows[1]
    assert (label, warning.startswith("'trim' is not shown to change a metric")) == ("pre-flight", True)
    assert flown.episodes == result.episodes + 144
    assert not row_of(page.search_table(result), "stopped early")
    assert study_document(result)["trials"][0]["cut_off"] is None
    first, *others = result.trials
    cut = replace(first, state="cut", score=17.5, measures={}, decided=("agent0", "agent2"), bound=12.0)
    found = replace(result, trials=(cut, *others), spared=(12, 3.456))
    assert row_of(page.search_table(found), "stopped early") == (
        "stopped early",
        "1 trial that could not be the best; saved 12 episodes (3.46 s)",
    )
    document = study_document(found)
    assert document["cut_off"] == {"trials": 1, "episodes": 12, "seconds": 3.456}
    first = document["trials"][0]
    assert first["prpv"] is None
    assert first["cut_off"] == {"prpv_at_least": 12.0, "prpv_estimate": 17.5, "agents": ["agent0", "agent2"]}
    assert page.trials_table(found.trials, ["trim"]).rows[0][2] == "stopped early, at least 12"
    assert found.episodes == result.episodes - 12


def test_a_prpv_that_a_candidate_has_not_is_null_not_that_of_a_perfect_proxy(result):
    found = confirmed(result)
    answer = replace(found.confirmation.answer, trial=replace(result.best.trial, measures={"plv": 30.0}))
    found = replace(found, confirmation=replace(found.confirmation, candidates=(answer,)))
    (candidate,) = study_document(found)["best"]["fresh"]["candidates"]
    assert (candidate["prpv"], candidate["fresh_prpv"]) == (None, [12])


@pytest.mark.slow
def test_failed_episodes_are_told_with_the_first_of_them(make_study):
    study = open_study(make_study(domain={"faults": '["agent3:1:raises"]'}, budget="6"))
    searched(study)
    result = looked_at(study)
    table = page.search_table(result)
    head, first = row_of(table, "failed"), table.rows[table.rows.index(row_of(table, "failed")) + 1]
    assert head == ("failed", "6 of 108 episodes; the first:")
    assert first[1].startswith("trial 1: agent 'agent3' failed from start 1: ")
    assert study_document(result)["trials"][0]["failed_episodes"] == 1


@pytest.fixture(scope="module")
def known(result):
    return planted(replace(result, cautions=()))


def test_a_row_has_the_best_value_its_interval_what_is_as_good_and_the_box_and_a_caution_is_a_note(known):
    names = [one.name for one in page.theta_table(known).columns]
    assert names == ["parameter", "best", "95 % interval", "by PRPV alone", "box"]
    delay, trim, last = page.theta_table(known).rows
    assert delay[:2] == ("delay", f"{known.best.trial.theta['delay']:.4g} s")
    assert delay[2:] == ("0.091 to 0.149", "0.03 to 0.21", "0 to 0.3")
    assert trim[3:] == ("0.05 to 0.15", "−0.3 to 0.3")
    assert last[0] == "share of the box"
    assert last[3:] == ("6.2 %", "")
    assert 0.3 < float(last[2].removesuffix(" %")) < 3.0
    assert "no shared starts" in page.theta_table(replace(known, cautions=("no shared starts",))).notes


def test_a_parameter_without_an_interval_is_unidentified_and_pairs_that_trade_are_named(known):
    vague = planted(known, deviation=(3.0, 0.02))
    assert page.theta_table(vague).rows[0][2] == "unidentified"
    assert page.theta_table(vague).notes[0].startswith("7 trials exclude almost no value of delay; unidentified")
    alone = page.theta_table(replace(vague, trials=vague.trials[:1])).notes
    assert alone[0].startswith("1 trial excludes almost no value of delay; unidentified")
    assert not [line for line in page.theta_table(known).notes if "unidentified" in line]
    trading = planted(known, centre=(0.5, 0.5), deviation=(0.1, 0.1), correlation=-0.9)
    assert any(
        "delay and trim trade off" in note and "correlation −0.9" in note for note in page.theta_table(trading).notes
    )
    assert not [line for line in page.theta_table(known).notes if "trade off" in line]


def test_it_is_said_whether_the_region_holds_the_best_theta_and_the_truth_which_has_a_column_where_it_is_known(known):
    best = dict(known.best.trial.theta)
    unit = (best["delay"] / 0.3, (best["trim"] + 0.3) / 0.6)
    inside = planted(known, centre=unit)
    assert page.theta_table(replace(inside, truth=best)).notes == ("the 95 % region contains the truth",)
    outside = planted(known, centre=tuple((place + 0.5) % 1.0 for place in unit))
    first, second = page.theta_table(replace(outside, truth=best)).notes
    assert first.startswith("the best θ by PRPV is outside the 95 % region")
    assert second == "the 95 % region does not contain the truth"
    known = replace(known, truth={"trim": 0.1, "delay": 0.29})
    assert page.theta_table(known).columns[3].name == "truth"
    assert [row[3] for row in page.theta_table(known).rows] == ["0.29 (outside)", "0.1", ""]
    assert [row[3] for row in page.theta_table(replace(known, truth={"trim": 0.1})).rows] == ["", "0.1", ""]


def test_per_parameter_what_informs_it_most_is_named_with_what_limits_it_and_nothing_else(known):
    assert page.information_table(known).rows == (
        ("delay", "agent4 46 %, agent0 30 %", "speed 100 %", "starts"),
        ("trim", "agent1 100 %", "distance 75 %", "trials"),
    )
    silent = replace(TOLD[0], agents=(("agent0", 0.0), ("agent1", 0.0)))
    assert [row[0] for row in page.information_table(planted(known, information=(silent, TOLD[1]))).rows] == ["trim"]


def preflown(result, **changes):
    """The result after a pre-flight in which the delay did nothing, with changes of how it did."""
    movement = Movement(Interval("delay", 0.0, 0.3), 1.0, "distance", 0.0, 0.5, 12, True)
    return replace(result, preflight=Preflight({"delay": 0.15, "trim": 0.0}, (replace(movement, **changes),), 144))


def test_a_parameter_that_changed_nothing_is_informed_by_none_and_an_interval_of_it_is_called_chance(known):
    vague = planted(confirmed(known, 3, (1.0, 5.0), value=3.0, low=1.0, high=5.0), (0.4, 0.72), (3.0, 0.02))
    names = [[row[0] for row in page.information_table(one).rows] for one in (vague, preflown(vague))]
    assert names == [["delay", "trim"], ["trim"]]
    assert "with delay (so far agent4's do most)" in study_sentence(vague)
    assert "with delay." in study_sentence(preflown(vague))
    for dead, untested in ((vague, preflown(vague, pairs=0)), (preflown(known, dead=False), preflown(known, pairs=0))):
        assert len(page.information_table(dead).rows) == len(page.information_table(untested).rows) == 2
        assert not [note for note in page.theta_table(untested).notes if "chance" in note]
    assert (
        page.theta_table(preflown(known)).notes[0].startswith("delay changed nothing at all in the pre-flight: unless")
    )


def test_a_warning_of_the_preflight_is_left_out_once_trials_have_identified_the_parameter(known):
    vague = planted(known, deviation=(3.0, 0.02))
    found = preflown(known, dead=False)
    assert row_of(page.search_table(found), "pre-flight")[1] == (
        "every parameter changes some metric beyond noise or is identified"
    )
    for changes in ({"dead": True}, {"pairs": 0}):
        assert row_of(page.search_table(preflown(known, **changes)), "pre-flight")[1].startswith("'delay' ")
    warned = row_of(page.search_table(preflown(vague, dead=False)), "pre-flight")[1]
    assert warned.startswith("'delay' is not shown to change a metric")
