"""What effects are worth in error of prediction, what drives could not have shown, and drives of two robots."""

from dataclasses import replace

import hidden_cases as hidden
import numpy as np
import pytest
from planted import DECLARED, NOISE, TRUTH, driven_log, drives_of, fitted, planted_drives, planted_log

from proxytune.diagnosis import MOTION_EFFECTS, RULES, AdoptedEffect, Findings, Ratio, cut, pose_errors
from proxytune.diagnosis.motion import effect_size as likeness
from proxytune.diagnosis.motion.effect_size import drop_negligible, find_robot_clusters, invisible_effects
from proxytune.diagnosis.motion.evidence import Variant, without_effect
from proxytune.diagnosis.motion.fitting import evaluate
from proxytune.diagnosis.motion.innovations import Noise

SHORT = {"episodes": 6, "seconds": 20.0}


def mixed(theta, of=(1, 3, 4)):
    """A log some of whose drives are another robot's."""
    one, other = planted_log(TRUTH, **SHORT), planted_log({**TRUTH, **theta}, **SHORT)
    return replace(one, episodes=tuple([(other if e in of else one).episodes[e] for e in range(6)]))


CASES = {case.name: case for case in (*hidden.IN_FORM, *hidden.OTHER_FORM, *hidden.OUTSIDE)}


def unlike(log):
    drives = drives_of(log)
    return find_robot_clusters(drives, fitted(drives))


@pytest.mark.parametrize(("theta", "wheel"), [({"trim": -0.06}, None), ({"wheel_gain.left": 0.88}, "left")])
def test_drives_of_two_robots_are_told_apart_with_their_gains(theta, wheel):
    found = unlike(mixed(theta))
    assert found is not None
    assert set(found.groups) == {(0, 2, 5), (1, 3, 4)}
    assert wheel in (None, found.wheel)
    assert abs(found.gains[1] - found.gains[0]) > 0.06


@pytest.mark.parametrize("theta", [{}, {"motor_lag.time_constant": 0.3}])
def test_drives_of_one_robot_are_alike(theta):
    assert unlike(planted_log({**TRUTH, **theta}, **SHORT)) is None


@pytest.mark.slow
@pytest.mark.parametrize(
    "name", ["dead_band width 0.12", "stiction breakaway 0.14", "dead_zone_that_jumps", "eccentric_wheel"]
)
def test_what_one_robot_lacks_does_not_make_two_of_it(name):
    assert unlike(hidden.make_log(CASES[name], episodes=8, seconds=40.0)) is None


@pytest.mark.slow
def test_drives_on_two_floors_fall_in_two_groups_too():
    found = unlike(hidden.make_log(CASES["carpet"], episodes=8, seconds=40.0))
    assert sorted(found.gains) == pytest.approx([0.8, 1.0], abs=0.03)


def test_one_drive_of_another_kind_makes_no_second_robot_and_few_at_a_time_give_the_same(monkeypatch):
    assert unlike(mixed({"trim": -0.06}, of=(1,))) is None
    log = mixed({"trim": -0.06})
    assert unlike(replace(log, episodes=log.episodes[:3])) is None
    drives = drives_of(mixed({"wheel_gain.left": 0.88}))
    model = fitted(drives)
    together = find_robot_clusters(drives, model)
    monkeypatch.setattr(likeness, "AT_ONCE", len(drives.episode) // 3)
    apart = find_robot_clusters(drives, model)
    assert apart.groups == together.groups
    assert apart.gains == pytest.approx(together.gains, rel=1e-9)


SCRUB, SLIP = (("yaw_scrub",),), (("lateral_slip",),)
MIXED = {**TRUTH, "yaw_scrub": 0.13, "lateral_slip": 0.002}


def adopted(effect, free=(), names=()):
    return AdoptedEffect(effect, "", names or tuple(name for names in free for name in names), free, 60.0, 0.002, ())


def found(drives, theta, *effects):
    free = DECLARED + tuple(coordinate for effect in effects for coordinate in effect.free)
    return Findings(evaluate(drives, TRUTH, DECLARED, NOISE), evaluate(drives, theta, free, NOISE), effects, (), (), ())


@pytest.fixture(scope="module")
def drives():
    return planted_drives(MIXED, episodes=6, seconds=20.0)


def test_what_matters_is_kept_and_the_model_is_fitted_again_without_what_does_not(drives):
    weighed = drop_negligible(found(drives, MIXED, adopted("yaw_scrub", SCRUB), adopted("lateral_slip", SLIP)), 1)
    assert [effect.effect for effect in weighed.adopted] == ["yaw_scrub"]
    assert [dropped.effect.effect for dropped in weighed.negligible] == ["lateral_slip"]
    assert "lateral_slip" not in weighed.model.theta
    assert SLIP[0] not in weighed.model.free
    assert weighed.model.theta["yaw_scrub"] == pytest.approx(0.13, abs=0.005)
    assert weighed.negligible[0].beside.theta["lateral_slip"] == 0.002
    bare = without_effect(Variant({"lateral_slip": 0.002}, SLIP), adopted("lateral_slip", SLIP), 20.0)
    assert bare == Variant({}, ()), "no delay where none was"


def test_where_everything_matters_or_windows_are_too_short_nothing_is_dropped(drives):
    whole = found(drives, MIXED, adopted("yaw_scrub", SCRUB))
    assert drop_negligible(whole, 1) is whole
    short = found(planted_drives(MIXED, episodes=2, seconds=4.0), MIXED, adopted("lateral_slip", SLIP))
    assert drop_negligible(short, 1) is short


@pytest.mark.slow
def test_of_two_effects_that_stand_for_one_another_one_is_kept(drives):
    twins = (adopted("yaw_scrub", SCRUB), adopted("wheel_gain", (("wheel_gain.left", "wheel_gain.right"),)))
    theta = {**TRUTH, "yaw_scrub": 0.13, "wheel_gain.left": 1.0, "wheel_gain.right": 1.0}
    assert [one.effect for one in drop_negligible(found(drives, theta, *twins), 1).adopted] == ["yaw_scrub"]


def test_worth_is_told_on_drives_that_were_not_fitted(drives):
    tested = planted_drives(MIXED, seed=2, episodes=4, seconds=20.0)
    variant = Variant(MIXED, (*DECLARED, *SCRUB, *SLIP))
    effects = [adopted("yaw_scrub", SCRUB), adopted("s", SLIP)]
    much, little = likeness.measure_effect_sizes(found(drives, MIXED, *effects).model, tested, variant, effects, 1)
    assert set(much) == set(little) == {1.0, 2.0, 5.0}
    assert max(one.interval[0] for one in much.values()) > 1.2
    assert max(one.value for one in much.values()) > 1.5
    assert all(one.interval[0] < RULES.material_factor and one.value < 1.2 for one in little.values())


def test_a_delay_that_draws_made_needless_is_weighed_anew_where_they_are_dropped(monkeypatch):
    late, draws = adopted("delay", (("delay",),)), adopted("delay_jitter", names=("delay_jitter",))
    theta, free = {"trim": TRUTH["trim"], "delay": 0.0, "delay_jitter": 0.24}, (("trim",), ("delay",))
    drives = planted_drives(TRUTH, episodes=6, seconds=20.0)
    plain = evaluate(drives, {"trim": TRUTH["trim"]}, free[:1], NOISE)

    def sizes(_model, _tested, variant, effects, _seed):
        drawn = "delay_jitter" in variant.theta
        needed = {"delay": not drawn, "delay_jitter": drawn and ("delay",) in variant.free}
        return [{2.0: Ratio(1.5, (1.4, 1.6)) if needed[one.effect] else Ratio(1.0, (0.9, 1.1))} for one in effects]

    monkeypatch.setattr(likeness, "measure_effect_sizes", sizes)
    weighed = drop_negligible(Findings(plain, evaluate(drives, theta, free, NOISE), (late, draws), (), (), ()), 1)
    assert weighed.adopted == (late,)
    assert [dropped.effect for dropped in weighed.negligible] == [draws]
    assert weighed.model.free == free
    assert weighed.model.theta["delay"] == pytest.approx(TRUTH["delay"], abs=0.005)


@pytest.mark.parametrize(("size", "matters"), [(0.4, True), (0.02, False)])
def test_a_random_effect_matters_if_its_draws_make_up_the_error(size, matters):
    calm = planted_drives(TRUTH, episodes=6, seconds=20.0)
    lossy = adopted("dropped_commands", names=("dropped_commands",))
    kept = drop_negligible(found(calm, {**TRUTH, "dropped_commands": size}, lossy), 1)
    assert bool(kept.adopted) == matters
    if not matters:
        assert kept.model.theta["delay"] == pytest.approx(TRUTH["delay"], abs=0.01)


def without(*ratios):
    """An effect without which errors are so many times as large, one horizon each."""
    told = {float(horizon): Ratio(value, ends) for horizon, (value, *ends) in enumerate(ratios)}
    return likeness.WeighedEffect(adopted("lateral_slip", SLIP), told)


def test_an_effect_matters_or_does_harm_where_the_error_is_clearly_another_draws_at_several_horizons():
    assert without((1.2, 1.1, 1.3)).material
    assert without((1.0, 0.9, 1.1), (1.06, 1.01, 1.1)).material
    assert not any(without(one).material for one in ((1.2, 0.9, 1.6), (1.04, 1.02, 1.06), (0.8, 0.7, 0.9)))
    assert RULES.material_factor == 1.05
    assert without((0.9, 0.85, 0.96)).harmful
    assert not any(without(one).harmful for one in ((0.9, 0.75, 1.02), (0.97, 0.95, 0.99), (1.2, 1.1, 1.3)))
    shown, hidden = Ratio(1.14, (1.03, 1.26)), Ratio(1.04, (1.0, 1.1))
    lossy = adopted("dropped_commands", names=("dropped_commands",))
    assert not likeness.WeighedEffect(lossy, {1.0: hidden, 2.0: hidden, 5.0: shown}).material
    assert likeness.WeighedEffect(lossy, {1.0: hidden, 2.0: shown, 5.0: shown}).material
    assert likeness.WeighedEffect(lossy, {2.0: shown}).material


@pytest.mark.slow
def test_draws_do_not_matter_where_the_noise_of_poses_leaves_no_room_for_them():
    calm = planted_drives(TRUTH, episodes=6, seconds=20.0, noise=Noise((1e-6, 1e-6, 1e-6), (0.005, 0.01)))
    jittery = Variant({**TRUTH, "delay": TRUTH["delay"] - 0.05, "delay_jitter": 0.1}, DECLARED)
    windows = cut(calm, 2.0)
    errors = pose_errors(calm, jittery.theta, windows)[:, 0]
    drawn = np.sqrt(likeness._drawn_squares(calm, jittery, windows, 1).mean())
    assert drawn > 0.4 * np.sqrt(np.mean(errors**2)), "by their size alone they would matter"
    kept = drop_negligible(found(calm, jittery.theta, adopted("delay_jitter", names=("delay_jitter",))), 1)
    assert kept.adopted == ()


VISIBILITY_DECLARED = {"trim", "delay"}


def swinging(level, swing):
    times = np.arange(600) / 20.0
    turn = swing * np.sin(2.0 * np.pi * times / 5.0)
    duties = np.stack((level - turn, level + turn), axis=1)
    return fitted(drives_of(driven_log(TRUTH, np.tile(duties, (3, 1, 1)), np.zeros((3, 3)))))


@pytest.fixture(scope="module")
def slow():
    return invisible_effects(swinging(0.15, 0.03), VISIBILITY_DECLARED)


def test_effects_of_motion_are_unseen_in_the_catalogues_order_unless_declared_or_shown(slow):
    assert "saturation" in slow
    assert "saturation" not in invisible_effects(swinging(0.9, 0.1), VISIBILITY_DECLARED)
    assert "turn_slip" in invisible_effects(swinging(0.3, 0.0), VISIBILITY_DECLARED)
    assert not VISIBILITY_DECLARED & set(slow)
    assert "saturation" not in invisible_effects(swinging(0.15, 0.03), {*VISIBILITY_DECLARED, "saturation"})
    assert slow == tuple(name for name in MOTION_EFFECTS if name in slow)


@pytest.mark.slow
def test_rich_drives_show_nearly_everything_and_commands_that_never_change_not_their_loss():
    assert len(invisible_effects(fitted(planted_drives(TRUTH, episodes=6, seconds=30.0)), VISIBILITY_DECLARED)) <= 3
    steady = fitted(drives_of(driven_log(TRUTH, np.full((3, 600, 2), 0.4), np.zeros((3, 3)))))
    assert {"dropped_commands", "delay_jitter"} <= set(invisible_effects(steady, VISIBILITY_DECLARED))
