from dataclasses import replace

import pytest
from confirmations import TOLD, planted

from proxytune.report.study.theta_table import theta_columns, theta_lines, theta_rows, told_rows
from proxytune.storage.store import Store
from proxytune.study.result import result_of
from proxytune.study.study import open_study
from proxytune.study.study_run import StudyRun


@pytest.fixture
def result(finished):
    with Store.read(finished) as store:
        return planted(replace(result_of(StudyRun(open_study(finished), store)), cautions=()))


def test_a_row_has_the_best_value_its_interval_what_is_as_good_and_the_box(result):
    assert theta_columns(result) == ("parameter", "best", "95 % interval", "as good by PRPV", "searched")
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
    assert theta_lines(vague)[0].startswith("unidentified: delay; ")
    assert not [line for line in theta_lines(result) if line.startswith("unidentified")]


def test_pairs_that_trade_are_named_with_their_correlation(result):
    trading = planted(result, centre=(0.5, 0.5), deviation=(0.1, 0.1), correlation=-0.9)
    assert "delay and trim make up for each other, correlation −0.9" in theta_lines(trading)
    assert not [line for line in theta_lines(result) if "make up" in line]


def test_it_is_said_whether_the_region_holds_the_truth_and_the_best_theta(result):
    best = dict(result.best.trial.theta)
    unit = (best["delay"] / 0.3, (best["trim"] + 0.3) / 0.6)
    inside = planted(result, centre=unit)
    assert theta_lines(replace(inside, truth=best)) == ["the 95 % region holds the truth"]
    outside = planted(result, centre=tuple((place + 0.5) % 1.0 for place in unit))
    first, second = theta_lines(replace(outside, truth=best))
    assert first.startswith("the best θ by PRPV is outside the 95 % region")
    assert second == "the 95 % region does not hold the truth"


def test_what_was_lost_is_a_caution(result):
    assert "caution: no shared starts" in theta_lines(replace(result, cautions=("no shared starts",)))


def test_per_parameter_those_that_tell_most_are_named_with_what_would_tell_more(result):
    assert told_rows(result) == [
        ("delay", "agent4 46 %, agent0 30 %, agent1 20 %", "speed 100 %", "more starts"),
        ("trim", "agent1 100 %", "distance 75 %, survival_time 25 %", "more trials"),
    ]


def test_a_parameter_of_which_nothing_is_told_has_no_row(result):
    silent = replace(TOLD[0], agents=(("agent0", 0.0), ("agent1", 0.0)))
    assert [row[0] for row in told_rows(planted(result, information=(silent, TOLD[1])))] == ["trim"]
