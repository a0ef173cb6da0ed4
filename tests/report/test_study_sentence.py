"""Sentence of a study."""

from dataclasses import replace
from types import SimpleNamespace as Namespace

import pytest
from confirmations import LACKS, TOLD, planted

from proxytune.report.study.sentence import KnownParameter, declared_of, known_parameters, say_answer, study_sentence
from proxytune.scores import Metric
from proxytune.search import Information
from proxytune.space import Interval
from proxytune.study import DEFAULT_FAMILY
from proxytune.usefulness import Chance, Estimate, NoiseFloor

TRIM = KnownParameter("trim", "", 0.1213, (0.108, 0.146), 0.06, True)
PITCH = KnownParameter("camera_pitch", "deg", 13.04, (11.1, 14.4), 0.1, True)
BLUR = KnownParameter("blur", "s", 0.026, (0.005, 0.062), 0.57, True)
DELAY = KnownParameter("delay", "s", 0.1, (0.001, 0.298), 0.99, False)
FLOOR = NoiseFloor("same starts", 5.0, 1.0, 9.0)
PRPV = Estimate(6.2, 2.6, 9.9)
EXCESS = Estimate(1.2, -5.3, 7.7)
TOLD_BY_STARTS = Information("blur", (("daredevil", 0.6), ("wary", 0.4)), (("distance", 1.0),), "starts")
CHANCE, EXPLAINING = (Chance(65.8, 13.7, p_value, 1000) for p_value in (0.001, 0.3))


def study(parameters=(TRIM, PITCH, BLUR), *, names=("trim", "delay"), family=DEFAULT_FAMILY, fresh=True, **changes):
    """As much of a study as a sentence tells, with changes of it, of its settings or of what is known."""
    settings = {"budget": 24, "starts": 4, "confirm": 1, "learn_from": (), "metrics": (Metric("distance"),)}
    known = {"fits": True, "p_value": 0.4, "share": 0.0016}
    facts = {"perfect": True, "inside": True, "floor": FLOOR, "excess": EXCESS, "stopped": "the budget is spent"}
    facts |= {"prpv": PRPV, "nominal": None, "chance": CHANCE, "trials": range(24), "most_starts": 10}
    facts |= {"rescored": False, "information": (TOLD_BY_STARTS,)}
    for given in (settings, known, facts):
        given |= {key: changes.pop(key) for key in list(changes) if key in given}
    assert not changes
    prpv, nominal, chance, most_starts = (facts.pop(key) for key in ("prpv", "nominal", "chance", "most_starts"))
    judged = Namespace(chance=chance, prpv=Namespace(value=prpv.value))
    expected = Namespace(prpv=Namespace(value=prpv)) if fresh else None
    boxes = tuple(Interval(one.name, 0.0, (one.interval[1] - one.interval[0]) / one.share) for one in parameters)
    space = Namespace(intervals=boxes, names=names)
    return Namespace(
        **facts,
        expected=expected,
        nominal=nominal and Namespace(expected=Namespace(prpv=Namespace(value=nominal))),
        study=Namespace(
            settings=Namespace(space=space, family=family, **settings),
            family=Namespace(starts=most_starts, parameters={one.name: one for one in parameters}),
        ),
        knowledge=Namespace(
            intervals={one.name: one.interval for one in parameters},
            unidentified=[one.name for one in parameters if not one.identified],
            misfit=Namespace(fits=known["fits"], p_value=known["p_value"]),
            posterior=Namespace(share=known["share"]),
        ),
        judged=judged,
        best=Namespace(
            trial=Namespace(theta={one.name: one.best for one in parameters}), assessment=None if fresh else judged
        ),
    )


def said(*parameters, **changes):
    """What is said of such a study."""
    return study_sentence(study(*parameters, **changes))


ABOVE = {"prpv": Estimate(16.0, 13.0, 19.0), "excess": Estimate(11.0, 4.2, 17.8), "perfect": False}
BY_CHANCE = {**ABOVE, "prpv": Estimate(58.0, 50.2, 66.0), "chance": EXPLAINING}


def test_where_the_agents_are_too_few_to_exclude_chance_theta_is_told_all_the_same():
    text = said(chance=Chance(3.0, 1.7, 1 / 6, 6, exact=True, lowest=True))
    assert "No θ found" not in text
    assert ", as low as any order of these agents has, which chance may be too (p = 0.17)." in text
    assert text.endswith("Next: add agents, for any order of these may be chance.")


def test_theta_that_makes_a_perfect_proxy_is_found_and_the_least_known_parameter_comes_next():
    assert said() == (
        "θ found: trim 0.121 (0.108 to 0.146), camera pitch 13.0 deg (11.1 to 14.4), blur 0.026 s (0.005 to 0.062). "
        "PRPV (proxy relative predictivity value) is 6 (2 to 10), a perfect proxy's 5 (1 to 9): "
        "it cannot be told from a perfect proxy; at most 8 pairs worse. "
        "Next: use this θ; to know blur better, raise starts from 4 to 8 and measure the target from them too."
    )


@pytest.mark.parametrize(
    ("high", "told"), [(-0.5, "perfect proxy. Next"), (0.4, "at most 1 pair worse. "), (1.2, "at most 2 pairs worse. ")]
)
def test_pairs_that_may_be_worse_are_counted_where_there_may_be_any(high, told):
    assert told in said(excess=Estimate(-8.0, -15.0, high))


def test_a_score_above_the_floor_is_not_called_found_and_what_chance_explains_has_its_probability():
    text = said(**ABOVE)
    assert text.startswith("θ narrowed down to 0.16 % of the box: trim 0.121 ")
    assert (
        "is 16 (13 to 19), a perfect proxy's 5 (1 to 9): better than chance, but a perfect proxy scores lower, " in text
    )
    assert "by 4 to 18." in text
    assert "scores lower, by at most 5." in said(**{**ABOVE, "excess": Estimate(2.5, 0.4, 4.6)})
    assert "found" not in text
    text = said(perfect=False, inside=False)
    assert text.startswith("θ narrowed down to 0.16 % of the box: ")
    assert ": by PRPV alone it cannot be told from a perfect proxy; at most 8 pairs worse, but other scores of " in text
    assert "no difference" not in text
    assert text.endswith("Next: raise budget from 24 to 48, to get closer.")
    assert said(**BY_CHANCE) == (
        "No θ found. PRPV (proxy relative predictivity value) is 58 (50 to 66), no better than chance "
        "(65.8 ± 13.7, p = 0.3). Next: raise budget from 24 to 48, or add agents whose scores differ more."
    )
    assert "diagnose LOG" in said(**BY_CHANCE, fits=False)
    assert "confirm" not in said(**BY_CHANCE, fresh=False, confirm=0)


@pytest.mark.parametrize(
    ("limit", "inside", "step"),
    [
        ("trials", True, "raise budget from 24 to 48"),
        ("starts", True, "raise starts from 4 to 8 and measure the target from them too"),
        ("starts", False, "raise budget from 24 to 48"),
    ],
)
def test_the_next_step_is_what_keeps_more_from_being_told(limit, inside, step):
    text = said(**ABOVE, inside=inside, information=(replace(TOLD_BY_STARTS, limit=limit),))
    assert text.endswith(f" Next: {step}, to get closer.")


def test_the_next_step_asks_for_no_more_trials_or_starts_than_help():
    text = said(**ABOVE, inside=False, trials=range(20))
    assert text.endswith("Next: loosen the rule under [stop] that ended the search, to get closer.")
    assert said(**ABOVE, inside=False).endswith("Next: raise budget from 24 to 48, to get closer.")
    assert "raise starts from 4 to 5 " in said(**ABOVE, most_starts=5)
    assert "add agents or metrics: all 4 starts are driven" in said(**ABOVE, most_starts=4)
    assert "add agents or metrics: its only start is driven, to" in said(**ABOVE, starts=1, most_starts=1)
    told = said(**ABOVE, learn_from=("bank",), budget=0, trials=())
    assert "raise budget from 0 to 8 (starts limit it too, but more of them would leave the earlier trials out)" in told
    assert "raise starts" not in told
    by_trials = (replace(TOLD_BY_STARTS, limit="trials"),)
    assert "starts limit" not in said(**ABOVE, learn_from=("bank",), budget=0, trials=(), information=by_trials)


def test_a_proxy_that_lacks_something_is_sent_to_diagnose_with_effects_on_motion_if_its_robot_drives():
    text = said(**ABOVE, fits=False, p_value=0.0042)
    assert text.startswith("The proxy lacks something: no θ explains the target's scores (p = 0.0042). PRPV (")
    assert text.endswith("run `python -m proxytune diagnose LOG --declared trim,delay`.")
    assert "a perfect proxy scores lower" not in said(fits=False, perfect=False)
    assert said(**ABOVE, fits=False, names=("blur",)).endswith("run `python -m proxytune diagnose LOG`.")
    lacking = said(**ABOVE, fits=False, family="other:family")
    assert lacking.startswith("The proxy lacks something: no θ explains the target's scores")
    assert lacking.endswith("widen the box; of a robot on wheels a log tells (`diagnose`).")
    unknown = said((TRIM, DELAY), **ABOVE, information=TOLD, family="other:family")
    assert unknown.endswith("whose scores change with delay (so far agent4's do most), to get closer.")
    names = ("blur", "trim", "motor_lag.time_constant", "camera_pitch", "wheel_gain.left", "wheel_gain.right")
    assert declared_of(names) == ("trim", "motor_lag", "wheel_gain")


def test_without_fresh_episodes_or_before_its_end_a_study_says_so_and_how_to_go_on():
    unconfirmed = said(**ABOVE, fresh=False, confirm=0)
    assert "is 16 in the search's own episodes, which may be partly luck." in unconfirmed
    assert unconfirmed.endswith("Next: set confirm = 1 and run the study again, to drive the best θ afresh.")
    assert said(**ABOVE, fresh=False, rescored=True).endswith("to a new study, with learn_from = [this one].")
    assert "set confirm" not in said(**ABOVE, fresh=False)
    assert "perfect" not in unconfirmed
    text = said(**ABOVE, stopped="", trials=range(14))
    assert text.startswith("14 of 24 trials so far. θ narrowed down")
    assert text.endswith("Next: run the study again for the 10 trials that are left.")


@pytest.mark.parametrize(
    ("metrics", "step"),
    [
        (["distance:max"], "give other agents"),
        (["distance:max", "time:min"], "give other agents, or fewer metrics"),
        (["distance:max:5%"], "give other agents, or smaller tolerances"),
        (["distance:max:5", "time:min"], "give other agents, or smaller tolerances, or fewer metrics"),
    ],
)
def test_where_the_target_ranks_no_agent_above_another_it_is_said_and_what_would_rank_them(metrics, step):
    text = said(chance=Chance(0.0, 0.0, 1.0, 1000), metrics=tuple(map(Metric.parse, metrics)))
    assert text.endswith(f" Next: {step}: on the target none of these agents ranks above another.")
    level = said(chance=Chance(21.0, 0.0, 1.0, 1000), fits=False, metrics=tuple(map(Metric.parse, metrics)))
    assert level.endswith(f" Next: {step}: on the target, or in the proxy, none of these agents ranks above another.")


def test_where_noise_is_not_known_nothing_is_said_of_a_perfect_proxy_and_the_nominal_stands_beside():
    text = said(**ABOVE | {"excess": None})
    assert "better than chance; what a perfect proxy scores is not known." in text
    assert "(1 to 9)" not in text
    text = said(nominal=Estimate(31.0, 24.5, 37.2))
    assert "8 pairs worse. The simulator as it is scores 31 (24 to 38). Next: " in text


def test_unidentified_parameters_have_no_interval_values_outside_theirs_have_and_of_many_some_are_told():
    text = said((TRIM, DELAY), **ABOVE, information=TOLD)
    assert "trim 0.121 (0.108 to 0.146); delay is unidentified." in text
    assert "add an agent or a metric whose scores change with delay (so far agent4's do most), or a log" in text
    few = said((TRIM, DELAY), **ABOVE, information=tuple(replace(one, limit="trials") for one in TOLD))
    assert few.endswith("Next: raise budget from 24 to 48, to get closer."), "its outputs are not known near the answer"
    nothing = said((DELAY, replace(DELAY, name="blur")), **ABOVE, information=())
    assert nothing.startswith("θ is unknown: delay and blur are unidentified.")
    perfect = said((DELAY,), information=())
    assert perfect.startswith("θ is unknown: delay is unidentified. PRPV (")
    assert " Next: to know delay better, add an agent or a metric whose scores change with delay" in perfect
    silent = replace(TOLD[0], agents=(("agent0", 0.0),))
    assert "so far" not in said((TRIM, DELAY), **ABOVE, information=(silent, TOLD[1]))
    text = said((replace(TRIM, best=0.2), PITCH), **ABOVE)
    assert "trim 0.200 (95 % region: 0.108 to 0.146)" in text
    text = said(tuple(replace(TRIM, name=f"gain{number}") for number in range(7)))
    assert "gain4 0.121 (0.108 to 0.146) and 2 more." in text
    assert "gain5" not in text


def test_what_is_told_of_a_parameter_is_what_the_study_knows(result):
    known = planted(result, deviation=(3.0, 0.01), misfit=LACKS)
    delay, trim = known_parameters(known)
    assert [(one.name, one.unit, one.identified) for one in (delay, trim)] == [
        ("delay", "s", False),
        ("trim", "", True),
    ]
    assert trim.interval == pytest.approx((0.1 - 0.6 * 0.0196, 0.1 + 0.6 * 0.0196), abs=0.002)
    assert trim.share == pytest.approx(4 * 0.0098, rel=0.1)
    assert say_answer(known).startswith("The proxy lacks something: no θ explains the target's scores (p = 0.002). ")
    assert study_sentence(replace(result, stopped="", trials=result.trials[:3])).startswith("3 of 7 trials so far. ")
