from dataclasses import replace

import numpy as np
import pytest
from confirmations import LACKS, TOLD, planted

from proxytune.report.study.finding import Finding, Known, declared_of, finding_of
from proxytune.report.study.verdict import sentence
from proxytune.scores import Metric, ScoreTable
from proxytune.search.knowledge.information import Information
from proxytune.storage.store import Store
from proxytune.study.result import result_of
from proxytune.study.study import open_study
from proxytune.study.study_run import StudyRun
from proxytune.usefulness import NoiseFloor
from proxytune.usefulness.chance import Chance

TRIM = Known("trim", "", 0.1213, (0.108, 0.146), 0.06, True)
PITCH = Known("camera_pitch", "deg", 13.04, (11.1, 14.4), 0.1, True)
BLUR = Known("blur", "s", 0.026, (0.005, 0.062), 0.57, True)
DELAY = Known("delay", "s", 0.1, (0.001, 0.298), 0.99, False)
TABLE = ScoreTable(("a", "b"), ("0",), ("distance",), np.array([[[1.0]], [[2.0]]]))
FLOOR = NoiseFloor("same starts", 5.0, 1.0, 9.0, 1000, TABLE, (Metric("distance", "max"),))
FOUND = Finding(
    parameters=(TRIM, PITCH, BLUR),
    region=0.0016,
    inside=True,
    prpv=6,
    fresh=True,
    floor=FLOOR,
    chance=Chance(65.8, 13.7, 0.001, 1000, None),
    perfect=True,
    misfit=0.4,
    fits=True,
    informed=Information("blur", (("daredevil", 0.6), ("wary", 0.4)), (("distance", 1.0),), "starts"),
    left=0,
    budget=24,
    ruled=False,
    starts=4,
    most_starts=10,
    confirm=1,
    declared=("trim", "delay"),
)
ABOVE = replace(FOUND, prpv=16, perfect=False)
BY_CHANCE = replace(ABOVE, prpv=58, chance=Chance(65.8, 13.7, 0.3, 1000, None))


def test_theta_that_makes_a_perfect_proxy_is_found_and_the_least_known_parameter_told():
    assert sentence(FOUND) == (
        "θ was found: trim 0.121 (0.108 to 0.146), camera pitch 13.0 deg (11.1 to 14.4), "
        "blur 0.026 s (0.005 to 0.062); blur is the least known (0.6 of its range). "
        "PRPV 6 on fresh episodes, where a perfect proxy scores 5 (1 to 9): "
        "this proxy cannot be told from a perfect one. "
        "Next: use the proxy at this θ; to know blur better, "
        "raise starts from 4 to 8 and measure the target from these too."
    )


def test_a_score_above_the_floor_is_not_called_found():
    text = sentence(ABOVE)
    assert text.startswith("θ is narrowed down to 0.16 % of the box: trim 0.121 ")
    assert "a perfect proxy scores 5 (1 to 9): better than chance, not yet as good as can be." in text
    assert "found" not in text


@pytest.mark.parametrize(
    ("limit", "inside", "step"),
    [
        ("trials", True, "raise budget from 24 to 48"),
        ("starts", True, "raise starts from 4 to 8 and measure the target from these too"),
        ("starts", False, "raise budget from 24 to 48"),
    ],
)
def test_the_next_step_is_what_keeps_more_from_being_told(limit, inside, step):
    found = replace(ABOVE, inside=inside, informed=replace(FOUND.informed, limit=limit))
    assert sentence(found).endswith(f" Next: {step}, to come closer to it.")


def test_where_a_rule_ended_the_search_a_larger_budget_would_not_help(finished):
    found = replace(ABOVE, inside=False, ruled=True)
    assert sentence(found).endswith("Next: loosen the rule under [stop] that ended the search, to come closer to it.")
    with Store.read(finished) as store:
        result = result_of(StudyRun(open_study(finished), store))
    assert finding_of(result).ruled is False
    assert finding_of(replace(result, trials=result.trials[:3])).ruled is True


def test_no_more_starts_are_asked_for_than_there_are():
    assert "raise starts from 4 to 5 " in sentence(replace(ABOVE, most_starts=5))
    assert "add agents or metrics: all 4 starts are driven" in sentence(replace(ABOVE, most_starts=4))


def test_a_proxy_that_lacks_something_is_sent_to_diagnose():
    text = sentence(replace(ABOVE, fits=False, misfit=0.0042))
    assert text.startswith("The proxy lacks something: no θ explains the target's scores (p = 0.0042). PRPV 16 ")
    assert text.endswith("run `python -m proxytune diagnose LOG --declared trim,delay`.")
    assert sentence(replace(ABOVE, fits=False, declared=())).endswith("run `python -m proxytune diagnose LOG`.")


def test_what_chance_explains_is_not_found_and_told_with_its_probability():
    text = sentence(BY_CHANCE)
    assert text == (
        "θ was not found. PRPV 58 on fresh episodes is no better than chance (65.8 ± 13.7, p = 0.3)."
        " Next: raise budget from 24 to 48, or add agents that differ more in their scores."
    )
    assert "diagnose LOG" in sentence(replace(BY_CHANCE, fits=False))
    assert "confirm" not in sentence(replace(BY_CHANCE, fresh=False, confirm=0))


def test_without_fresh_episodes_luck_is_named_and_they_are_the_next_step():
    unconfirmed = replace(ABOVE, fresh=False, confirm=0)
    assert "PRPV 16 in the search's own episodes, part of which may be luck." in sentence(unconfirmed)
    assert sentence(unconfirmed).endswith("Next: set confirm = 1 and run the study again, to drive the best θ afresh.")
    assert "set confirm" not in sentence(replace(unconfirmed, confirm=1))
    assert "perfect" not in sentence(unconfirmed)


def test_halves_of_the_target_say_nothing_of_a_perfect_proxy():
    text = sentence(replace(ABOVE, floor=replace(FLOOR, kind="halves")))
    assert "what a perfect proxy would score is not known" in text
    assert "(1 to 9)" not in text


def test_a_study_under_way_says_so_and_how_to_go_on():
    text = sentence(replace(ABOVE, left=10))
    assert text.startswith("14 of 24 trials so far. θ is narrowed down")
    assert text.endswith("Next: run the study again for the 10 trials that are left.")


def test_unidentified_parameters_are_named_without_an_interval_and_with_who_tells_of_them():
    text = sentence(replace(ABOVE, parameters=(TRIM, DELAY), informed=TOLD[0]))
    assert "trim 0.121 (0.108 to 0.146); delay is unidentified." in text
    assert "add an agent or a metric that tells of it (most tells agent4 now), or a log for `diagnose`" in text
    nothing = sentence(replace(ABOVE, parameters=(DELAY, replace(DELAY, name="blur")), informed=None))
    assert nothing.startswith("θ is not known: delay and blur are unidentified.")


def test_a_best_value_outside_its_interval_is_not_shown_as_if_it_were_inside():
    text = sentence(replace(ABOVE, parameters=(replace(TRIM, best=0.2), PITCH)))
    assert "trim 0.200 (the scores say 0.108 to 0.146)" in text


def test_of_many_parameters_only_some_are_named():
    many = tuple(replace(TRIM, name=f"gain{number}") for number in range(7))
    text = sentence(replace(FOUND, parameters=many))
    assert "gain4 0.121 (0.108 to 0.146) and 2 more;" in text
    assert "gain5" not in text


def test_only_effects_on_motion_are_declared_to_diagnose_each_once():
    names = ("blur", "trim", "motor_lag.time_constant", "camera_pitch", "wheel_gain.left", "wheel_gain.right")
    assert declared_of(names) == ("trim", "motor_lag", "wheel_gain")


def test_a_study_s_finding_holds_what_the_study_knows(finished):
    with Store.read(finished) as store:
        result = result_of(StudyRun(open_study(finished), store))
    found = finding_of(planted(result, deviation=(3.0, 0.01), misfit=LACKS))
    assert [(known.name, known.unit, known.identified) for known in found.parameters] == [
        ("delay", "s", False),
        ("trim", "", True),
    ]
    trim = found.parameters[1]
    assert trim.interval == pytest.approx((0.1 - 0.6 * 0.0196, 0.1 + 0.6 * 0.0196), abs=0.002)
    assert trim.share == pytest.approx(4 * 0.0098, rel=0.1)
    assert (found.least.name, found.informed.name) == ("delay", "delay")
    assert (found.fits, found.misfit, found.fresh, found.left) == (False, 0.002, False, 0)
    assert (found.budget, found.starts, found.most_starts, found.confirm) == (7, 3, 5, 0)
    silent = replace(TOLD[0], agents=(("agent0", 0.0),))
    assert finding_of(planted(result, deviation=(3.0, 0.01), information=(silent, TOLD[1]))).informed is None
    assert finding_of(replace(result, stopped="", trials=result.trials[:3])).left == 4


def test_a_score_at_the_floor_of_a_theta_that_other_scores_exclude_is_not_called_perfect():
    text = sentence(replace(FOUND, perfect=False, inside=False))
    assert text.startswith("θ is narrowed down to 0.16 % of the box: ")
    assert "scores 5 (1 to 9): as good by PRPV, but other scores of its agents are not the target's." in text
    assert "perfect one" not in text
    assert text.endswith("Next: raise budget from 24 to 48, to come closer to it.")
