"""A diagnosis holds what was found, tests it on drives kept aside, and refuses what it cannot bear.

Robots with a secret: the effect is the first to be added. tests/benchmarks/test_rates.py has what has no name, and
nothing found where nothing is.
"""

from dataclasses import replace

import hidden_cases as hidden
import numpy as np
import pytest
from planted import CALM, ROBOT, TRUTH, driven_log, drives_of, fitted, look_for_few, planted_log, with_poses
from rates import CLEAR

from proxytune.diagnosis import RULES, AdoptedEffect, Estimate, diagnose_log
from proxytune.diagnosis.motion.diagnose import declared_effects, declared_parameters, diagnose
from proxytune.diagnosis.motion.evidence import gather_evidence
from proxytune.diagnosis.motion.multistep_fit import HORIZONS_S
from proxytune.diagnosis.motion.selection import adopt, choose_best
from proxytune.driving import read_robot
from proxytune.effects import PARAMETERS
from proxytune.errors import LogError

SCRUBBING = {**TRUTH, "yaw_scrub": 0.12}


def scrubbing_log():
    return planted_log(SCRUBBING, episodes=6, seconds=12.0, noise=CALM)


@pytest.fixture(scope="module")
def diagnosis():
    with pytest.MonkeyPatch.context() as patch:
        look_for_few(patch)
        return diagnose(scrubbing_log(), ROBOT, ("trim", "delay"))


def test_the_planted_effect_is_found_with_its_value_and_its_worth_first_of_all_candidates(diagnosis):
    assert diagnosis.verdict == "explained"
    assert [effect.effect for effect in diagnosis.effects] == ["yaw_scrub"]
    estimate = diagnosis.theta["yaw_scrub"]
    assert abs(estimate.value - 0.12) < np.ptp(estimate.interval)
    assert estimate.unit == "m"
    assert np.ptp(estimate.interval) < 0.02

    gains = [tried.gain for tried in diagnosis.found.tried]
    assert gains == sorted(gains, reverse=True)
    assert diagnosis.found.tried[0].effect == "yaw_scrub"
    assert 0.0 < diagnosis.found.tried[0].p_value <= 0.01

    assert set(diagnosis.effect_sizes) == {"yaw_scrub"}
    assert set(diagnosis.effect_sizes["yaw_scrub"]) == set(HORIZONS_S)
    assert diagnosis.effect_sizes["yaw_scrub"][2.0].interval[0] > 1.5
    assert (diagnosis.negligible, diagnosis.dropped_values) == ((), {})


@pytest.mark.slow
def test_what_another_rule_would_have_said_is_an_argument(diagnosis):
    strict = replace(RULES, p_value=1e-3)  # less than the draws of chance can show
    asked = diagnose_log(scrubbing_log(), ROBOT, ("trim", "delay"), rules=strict).motion
    assert [effect.effect for effect in diagnosis.effects] == ["yaw_scrub"]
    assert asked.effects == ()
    assert (asked.rules, diagnosis.rules) == (strict, RULES)


def test_declared_values_are_those_before_the_effect_and_errors_at_every_horizon_fall_to_the_floor(diagnosis):
    assert set(diagnosis.declared) == {"trim", "delay"}
    assert set(diagnosis.theta) == {"trim", "delay", "yaw_scrub"}
    for name, true in TRUTH.items():
        estimate = diagnosis.theta[name]
        assert estimate.interval[0] < estimate.value < estimate.interval[1]
        assert abs(estimate.value - true) < np.ptp(estimate.interval)
    assert [error.horizon_s for error in diagnosis.errors] == list(HORIZONS_S)
    for error in diagnosis.errors:
        assert error.before.interval[0] < error.before.value < error.before.interval[1]
        assert error.ratio.value == pytest.approx(error.after.value / error.before.value)
        assert error.after.value < error.before.value
        assert 0.85 * error.floor.lower < error.after.value < 1.15 * error.floor.lower
        assert error.floor.lower <= error.floor.upper <= RULES.lowest_by_chance * error.after.value + 1e-12
    error = diagnosis.errors[1]
    assert error.ratio.interval[1] < 1.0
    assert error.removable_left < 0.3
    assert error.heading_after.value < error.heading_before.value


def test_drives_are_not_fitted_nothing_removable_is_left_and_a_value_at_its_range_s_end_is_told(diagnosis):
    error = diagnosis.errors[1]
    assert replace(error, before=error.before._replace(value=error.floor.lower)).removable_left is None
    assert replace(error, after=error.before).removable_left == 1.0
    assert diagnosis.parts.fitted.duties.shape[0] == 4
    assert diagnosis.parts.tested.duties.shape[0] == 2
    assert diagnosis.found.model.drives is diagnosis.parts.fitted
    jitter = AdoptedEffect("delay_jitter", "", ("delay_jitter",), (), 50.0, 0.01, ())
    highest = Estimate(PARAMETERS["delay_jitter"].high, (0.2, 0.3), "s")
    assert replace(diagnosis, theta={**diagnosis.theta, "delay_jitter": highest}).at_edge(jitter) == ("delay_jitter",)
    inside = replace(diagnosis, theta={**diagnosis.theta, "delay_jitter": replace(highest, value=0.1)})
    assert inside.at_edge(jitter) == ()


@pytest.mark.parametrize(("robot", "effects"), [("duckiebot", ("trim", "delay")), ("husky", ()), ("irobot_create", ())])
def test_declared_is_what_a_robot_has_of_theta_that_acts_on_motion(robot, effects):
    assert declared_effects(read_robot(robot)) == effects


def test_declared_effects_are_read_into_their_parameters():
    assert declared_parameters(("trim", "wheel_gain", "trim")) == ("trim", "wheel_gain.left", "wheel_gain.right")
    assert declared_parameters(("dead_band",)) == ("dead_band.width",)
    assert declared_parameters(()) == ()


@pytest.mark.parametrize(("name", "nearest"), [("trimm", "trim"), ("blur", ""), ("camera_pitch", "")])
def test_what_does_not_act_on_motion_cannot_be_declared(name, nearest):
    with pytest.raises(LogError, match=f"^--declared {name}: no effect on motion has this name.*{nearest}"):
        declared_parameters((name,))


@pytest.mark.slow
def test_the_same_seed_gives_the_same_diagnosis(diagnosis, monkeypatch):
    look_for_few(monkeypatch)
    again = diagnose(scrubbing_log(), ROBOT, ("trim", "delay"))
    assert again.theta == diagnosis.theta
    assert again.found.tried == diagnosis.found.tried
    assert again.errors == diagnosis.errors
    assert again.effect_sizes == diagnosis.effect_sizes


@pytest.mark.parametrize("level", [1e-6, 0.002])
def test_a_stationary_robot_gets_no_answer(level):
    random = np.random.default_rng(1)
    driven = hidden.make_log(hidden.CLEAN[0], episodes=6, seconds=12.0)
    log = with_poses(driven, lambda poses: random.normal(0.0, level, poses.shape))
    with pytest.raises(LogError, match="stands still"):
        diagnose(log, ROBOT, ("trim", "delay"))


@pytest.mark.slow
def test_one_long_drive_or_several_that_begin_at_the_origin_with_stubs_among_them_give_a_result(monkeypatch):
    look_for_few(monkeypatch)
    found = diagnose(planted_log(SCRUBBING, episodes=1, seconds=70.0), ROBOT, ("trim", "delay"))
    assert [effect.effect for effect in found.effects] == ["yaw_scrub"]
    assert found.robot_clusters is None
    drives = planted_log(SCRUBBING, episodes=6, seconds=12.0).episodes
    at_origin = driven_log(SCRUBBING, np.stack([e.commands for e in drives]), np.zeros((6, 3)))
    stubs = [replace(e, name=2 * e.name, times=e.times[:3], commands=e.commands[:3], poses=e.poses[:3]) for e in drives]
    found = diagnose(replace(at_origin, episodes=(*at_origin.episodes, *stubs)), ROBOT, ("trim", "delay"))
    assert [effect.effect for effect in found.effects] == ["yaw_scrub"]
    assert not found.clocks[0].differ


@pytest.mark.slow
def test_an_hour_of_standing_with_a_minute_of_driving_gives_what_the_minute_gives(monkeypatch):
    look_for_few(monkeypatch)
    duties = np.zeros((1, 20 * 3600, 2))
    duties[0, 36000:37400] = planted_log(SCRUBBING, episodes=1, seconds=70.0).episodes[0].commands
    found = diagnose(driven_log(SCRUBBING, duties, np.zeros((1, 3))), ROBOT, ("trim", "delay"))
    assert [effect.effect for effect in found.effects] == ["yaw_scrub"]
    assert found.parts.fitted.seconds == pytest.approx(37.0, abs=1.0)
    assert found.drive_names == ("00 from 1799 s",)


@pytest.mark.slow
def test_poses_a_quarter_second_early_are_told_and_no_effect_is_invented():
    found = diagnose(hidden.make_log(hidden.CLEAN[1], episodes=6, seconds=20.0, late_s=-0.25), ROBOT, ("trim", "delay"))
    assert found.clocks[0].offset.value == pytest.approx(hidden.CLEAN[1].delay - 0.25 - 0.15, abs=0.03)
    assert found.effects == ()
    assert found.theta["delay"].value == pytest.approx(0.15, abs=0.03)


@pytest.mark.slow
def test_clocks_that_seem_to_jump_are_read_again_beside_a_slow_motor_and_its_name_is_all_that_is_added():
    told: list[str] = []
    log = planted_log({**TRUTH, "slew_rate": 1.6}, episodes=12, seconds=40.0)
    found = diagnose(log, ROBOT, ("trim", "delay"), report=told.append)
    assert sum("read again beside this model" in step for step in told) >= 1
    assert [one.effect for one in found.effects] == ["slew_rate"]
    assert not found.clocks[0].differ


@pytest.mark.slow
@pytest.mark.parametrize(
    "asked",
    [
        {"motor_lag.time_constant": 1.6},
        {"yaw_lag": 0.3},
        {"inertia.forward": 0.2, "inertia.turn": 0.3, "inertia.square": 4.0},
    ],
)
def test_what_no_usual_robot_has_is_found_with_its_value_and_of_what_contains_another_the_plainer(asked):
    found = diagnose(planted_log({**TRUTH, **asked}, episodes=6, seconds=20.0, noise=CALM), ROBOT, ("trim", "delay"))
    assert [(one.effect, one.rivals) for one in found.effects] == [(next(iter(asked)).split(".")[0], ())]
    assert {name: found.theta[name].value for name in asked} == pytest.approx(asked, rel=0.15)
    assert found.edges == ()


@pytest.mark.slow
@pytest.mark.parametrize("stand", [1.0, 0.0])
def test_a_driver_that_pauses_before_it_reverses_is_told_with_its_time_whether_a_stand_counts_or_not(stand):
    hidden_one = {"reversal_pause.pause": 0.4, "reversal_pause.stand": stand}
    found = diagnose(planted_log({**TRUTH, **hidden_one}, episodes=9, seconds=30.0), ROBOT, ("trim", "delay"))
    assert [one.effect for one in found.effects] == ["reversal_pause"]
    assert {name: found.theta[name].value for name in hidden_one} == pytest.approx(hidden_one, abs=0.03)


CASES = {case.name: case for case in hidden.IN_FORM}
HIDDEN = [
    "dead_band width 0.12",
    "turn_slip gain 0.15",
    "command_quantisation step 0.137",
    "slew_rate rise 0.8",
    "thermal_fade loss 0.6",
    "cross_coupling forward 0.02",
    "cross_coupling turn 0.8",
    "understeer gain 0.5",
    "yaw_lag time_constant 0.1",
    "wheel_ripple left 0.25",
    "slippery_patch loss 0.6",
    "fading_with_time rate 0.4",
    "sliding_slope x -0.04",
    "stiction breakaway 0.2",
]


@pytest.mark.slow
@pytest.mark.parametrize("name", HIDDEN)
def test_a_hidden_effect_is_the_first_to_be_added(name):
    base = fitted(drives_of(hidden.make_log(CASES[name], episodes=6, seconds=30.0)))
    evidence = gather_evidence(base, {"trim", "delay"}, 1)
    (added,) = adopt([], choose_best(base, evidence, RULES.least_gain_nats), evidence)
    (right,) = CASES[name].right
    assert {added.effect, *(rival.effect for rival in added.rivals)} & set(right)
    assert added.gain > CLEAR
