from dataclasses import replace

import pytest
from confirmations import TOLD, planted

from proxytune.report.study.information_table import information_rows
from proxytune.report.study.theta_table import theta_columns, theta_notes, theta_rows
from proxytune.storage import Store
from proxytune.study import StudyRun, open_study, result_of


@pytest.fixture
def result(finished):
    with Store.read(finished) as store:
        return planted(replace(result_of(StudyRun(open_study(finished), store)), cautions=()))


def test_a_row_has_the_best_value_its_interval_what_is_as_good_and_the_box(result):
    assert theta_columns(result) == ("parameter", "best", "95 % interval", "by PRPV alone", "box")
    delay, trim, last = theta_rows(result)
    assert delay[:2] == ("delay", f"{result.best.trial.theta['delay']:.4g} s")
    assert delay[2:] == ("0.091 to 0.149", "0.03 to 0.21", "0 to 0.3")
    assert trim[3:] == ("0.05 to 0.15", "−0.3 to 0.3")
    assert last[0] == "share of the box"
    assert last[3:] == ("6.2 %", "")
    assert 0.3 < float(last[2].removesuffix(" %")) < 3.0


def test_the_truth_has_a_column_only_where_it_is_known_and_is_marked_outside_the_interval(result):
    known = replace(result, truth={"trim": 0.1, "delay": 0.29})
    assert theta_columns(known)[3] == "truth"
    assert [row[3] for row in theta_rows(known)] == ["0.29 (outside)", "0.1", ""]
    assert [row[3] for row in theta_rows(replace(result, truth={"trim": 0.1}))] == ["", "0.1", ""]


def test_a_parameter_with_an_interval_of_nearly_its_range_is_unidentified(result):
    vague = planted(result, deviation=(3.0, 0.02))
    assert theta_rows(vague)[0][2] == "unidentified"
    assert theta_notes(vague)[0].startswith("7 trials exclude almost no value of delay; unidentified")
    assert not [line for line in theta_notes(result) if "unidentified" in line]


def test_pairs_that_trade_are_named_with_their_correlation(result):
    trading = planted(result, centre=(0.5, 0.5), deviation=(0.1, 0.1), correlation=-0.9)
    assert any("delay and trim trade off" in note and "correlation −0.9" in note for note in theta_notes(trading))
    assert not [line for line in theta_notes(result) if "trade off" in line]


def test_it_is_said_whether_the_region_holds_the_truth_and_the_best_theta(result):
    best = dict(result.best.trial.theta)
    unit = (best["delay"] / 0.3, (best["trim"] + 0.3) / 0.6)
    inside = planted(result, centre=unit)
    assert theta_notes(replace(inside, truth=best)) == ["the 95 % region contains the truth"]
    outside = planted(result, centre=tuple((place + 0.5) % 1.0 for place in unit))
    first, second = theta_notes(replace(outside, truth=best))
    assert first.startswith("the best θ by PRPV is outside the 95 % region")
    assert second == "the 95 % region does not contain the truth"


def test_what_the_target_s_table_does_not_allow_is_a_note(result):
    assert "no shared starts" in theta_notes(replace(result, cautions=("no shared starts",)))


def test_per_parameter_the_most_informative_are_named_with_what_limits_them(result):
    assert information_rows(result) == [
        ("delay", "agent4 46 %, agent0 30 %", "speed 100 %", "starts"),
        ("trim", "agent1 100 %", "distance 75 %", "trials"),
    ]


def test_a_parameter_that_nothing_informs_has_no_row(result):
    silent = replace(TOLD[0], agents=(("agent0", 0.0), ("agent1", 0.0)))
    assert [row[0] for row in information_rows(planted(result, information=(silent, TOLD[1])))] == ["trim"]
