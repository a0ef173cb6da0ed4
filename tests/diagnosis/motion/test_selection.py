"""Effects are adopted one at a time, each for its evidence beside its rivals, and dropped where they no longer pay."""

from dataclasses import replace
from types import SimpleNamespace

import hidden_cars
import numpy as np
import pytest
from planted import DECLARED, NOISE, ROBOT, TRUTH, planted_drives

from proxytune.diagnosis import RULES, AdoptedEffect, Findings, SignalCurve
from proxytune.diagnosis.motion import selection
from proxytune.diagnosis.motion.drives import gather
from proxytune.diagnosis.motion.evidence import Evidence, FittedCandidate, exceeds_names, list_tried
from proxytune.diagnosis.motion.fitting import evaluate, fit
from proxytune.diagnosis.motion.innovations import at_edge, widened
from proxytune.diagnosis.motion.random_effects import RandomEffect
from proxytune.diagnosis.motion.screening import ScreenedCandidate, candidates
from proxytune.diagnosis.motion.selection import adopt, choose_best, drop_idle, eliminate, fit_declared
from proxytune.driving import read_robot
from proxytune.effects import CATALOGUE

FORMS = {form.label: form for form in candidates(ROBOT, TRUTH, ())}
AS_GOOD, WORSE = {"lateral_slip": 1e-4}, {"lateral_slip": 0.2}
ACROSS, ALONG = (0.0, 1.0, 0.0), (0.99, 0.1, 0.0)


@pytest.fixture(scope="module")
def drives():
    return planted_drives(TRUTH, episodes=4, seconds=12.0)


def screened_with(label, gain, p_value=0.002, column=(1.0, 1.0, 1.0)):
    form = FORMS[label]
    return ScreenedCandidate(form, form.probes[0], form.probes[0], gain, gain, p_value, np.array(column))


def adopted_with(name):
    return AdoptedEffect(name, "", (name,), ((name,),), 60.0, 0.002, ())


def curve_over_time(gain):
    return SignalCurve(SimpleNamespace(name="time", effects=()), gain, np.zeros(1))


def rivals(drives, gain, theta, column=ACROSS):
    """The rivals of an effect of 100 nats beside a second one: its gain, its values and what it does."""
    best = screened_with("yaw_scrub", 100.0, column=(1.0, 0.0, 0.0))
    second = screened_with("lateral_slip", 100.0, column=column)
    model = evaluate(drives, {**TRUTH, "yaw_scrub": 0.16}, DECLARED, NOISE)
    fits = {"yaw_scrub": FittedCandidate(100.0, model, best)}
    if gain is not None:
        fits["lateral_slip"] = FittedCandidate(gain, evaluate(drives, {**TRUTH, **theta}, DECLARED, NOISE), second)
    (adopted,) = adopt([], FittedCandidate(100.0, model, best), Evidence([best, second], fits, (), []))
    return [rival.effect for rival in adopted.rivals]


@pytest.mark.parametrize(
    ("gain", "theta", "column", "rival"),
    [
        *((gain, AS_GOOD, ACROSS, gain == 75.0) for gain in (50.0, 65.0, 75.0)),
        *((gain, WORSE, ACROSS, gain == 98.0) for gain in (75.0, 96.0, 98.0)),
        *((gain, AS_GOOD, ALONG, True) for gain in (None, 20.0)),
    ],
)
def test_a_rival_has_most_of_the_evidence_nearly_all_if_it_predicts_worse_or_moves_alike(
    drives, gain, theta, column, rival
):
    assert rivals(drives, gain, theta, column) == ["lateral_slip"] * rival


@pytest.mark.parametrize(("gain", "expected"), [(50.0, []), (80.0, ["delay_jitter"])])
def test_a_random_effect_has_the_other_as_rival_by_most_of_the_evidence(drives, gain, expected):
    lost, late = (RandomEffect(name, 0.1, (0.05, 0.2), nats, 0.01) for name, nats in
                  (("dropped_commands", 100.0), ("delay_jitter", gain)))  # fmt: skip
    choice = FittedCandidate(100.0, evaluate(drives, TRUTH, DECLARED, NOISE), random=lost)
    (adopted,) = adopt([], choice, Evidence([], {}, (lost, late), []))
    assert [rival.effect for rival in adopted.rivals] == expected
    assert (adopted.names, adopted.interval) == (("dropped_commands",), (0.05, 0.2))


def test_an_effect_that_does_nothing_beside_the_last_one_is_dropped_and_one_that_pays_is_kept():
    drives = planted_drives({**TRUTH, "yaw_scrub": 0.13}, episodes=4, seconds=12.0)
    idle, pays, last = map(adopted_with, ("lateral_slip", "yaw_scrub", "turn_slip"))
    theta = {**TRUTH, "yaw_scrub": 0.13, "lateral_slip": 0.0, "turn_slip": 0.0}
    free = DECLARED + idle.free + pays.free + last.free
    model, kept = drop_idle(fit(drives, theta, free), [pays, idle, last])
    assert [effect.effect for effect in kept] == ["yaw_scrub", "turn_slip"]
    assert "lateral_slip" not in model.theta
    assert model.theta["yaw_scrub"] == pytest.approx(0.13, abs=0.005)


@pytest.mark.parametrize("size", [0.0, 0.1])
def test_an_idle_delay_stays_only_beside_draws_whose_lateness_it_has_to_take_back(size):
    usual = ROBOT.theta["delay"]
    drives = planted_drives({"trim": 0.03, "delay": usual + size / 2.0}, episodes=4, seconds=12.0)
    late, draws, last = adopted_with("delay"), replace(adopted_with("delay_jitter"), free=()), adopted_with("turn_slip")
    theta = {"trim": 0.03, "delay": usual, "turn_slip": 0.0, **({"delay_jitter": size} if size else {})}
    model = fit(drives, theta, (("trim",), *late.free, *last.free))
    _, kept = drop_idle(model, [late, draws, last] if size else [late, last])
    assert (late in kept) == bool(size)


RESISTED = "inertia (turning is resisted by speed)"


def chosen(drives, *tried, p_value=0.002, random=(), had=TRUTH):
    """What is chosen of effects, each with its values and its gain, for a model that had these."""
    model = evaluate(drives, had, DECLARED, NOISE)
    fits = {}
    for label, values, gain in tried:
        model_with = evaluate(drives, {**had, **values}, DECLARED + FORMS[label].free, NOISE)
        fits[label] = FittedCandidate(gain, model_with, screened_with(label, gain, p_value))
    best = choose_best(model, Evidence([], fits, random, []), 15.0)
    return best and best.screened.candidate.label


def patch(radius):
    values = {"loss": 0.001, "x": 0.0, "y": 0.0, "radius": radius}
    return {f"slippery_patch.{name}": value for name, value in values.items()}


def test_most_evidence_is_chosen_unless_it_predicts_worse_or_a_part_of_the_map_holds_all_drives(drives):
    slip, scrub = ("lateral_slip", {"lateral_slip": 1e-4}, 90.0), ("yaw_scrub", {"yaw_scrub": 0.1601}, 80.0)
    assert chosen(drives, slip, scrub) == "lateral_slip"
    assert chosen(drives, ("yaw_scrub", {"yaw_scrub": 0.1601}, 10.0)) is None
    worse, next_best = ("yaw_scrub", {"yaw_scrub": 0.12}, 500.0), ("lateral_slip", {"lateral_slip": 1e-4}, 90.0)
    assert chosen(drives, worse, next_best) == "lateral_slip"
    scrub = ("yaw_scrub", {"yaw_scrub": 0.1601}, 50.0)
    assert chosen(drives, ("slippery_patch", patch(0.1), 90.0), scrub) == "slippery_patch"
    assert chosen(drives, ("slippery_patch", patch(5.0), 90.0), scrub) == "yaw_scrub"


@pytest.mark.parametrize(
    ("scrub", "p_value", "wanted"),
    [
        *((0.1601, p_value, "yaw_scrub" if p_value < 0.015 else None) for p_value in (0.002, 0.01, 0.02, 0.1)),
        *((scrub, 0.002, "yaw_scrub" if scrub == 0.15 else None) for scrub in (0.15, 0.14, 0.12)),
    ],
)
def test_what_chance_gains_once_in_a_hundred_logs_or_predicts_worse_is_not_chosen(drives, scrub, p_value, wanted):
    assert chosen(drives, ("yaw_scrub", {"yaw_scrub": scrub}, 500.0), p_value=p_value) == wanted


@pytest.mark.parametrize(("gain", "p_value"), [(500.0, 0.02), (25.0, 0.01)])
def test_a_random_effect_needs_as_small_a_chance_and_twice_the_evidence(drives, gain, p_value):
    assert chosen(drives, random=(RandomEffect("dropped_commands", 0.1, (0.05, 0.2), gain, p_value),)) is None


@pytest.mark.parametrize(("spread", "wanted"), [(0.03, False), (0.05, True)])
def test_a_jitter_within_two_ticks_of_the_model_is_not_told(drives, spread, wanted, monkeypatch):
    monkeypatch.setattr(
        selection, "fit_random", lambda model, effect: FittedCandidate(effect.gain, model, None, effect)
    )
    jitter = RandomEffect("delay_jitter", spread, (0.02, 0.06), 500.0, 0.002)
    best = choose_best(evaluate(drives, TRUTH, DECLARED, NOISE), Evidence([], {}, (jitter,), []), 15.0)
    assert (best is not None and best.random is jitter) == wanted


@pytest.mark.parametrize(("gain", "wanted"), [(85.0, "dead_band"), (40.0, "dead_band (left wheel)")])
def test_a_form_for_both_wheels_is_preferred_to_one_for_a_single_wheel_at_little_loss(drives, gain, wanted):
    one = ("dead_band (left wheel)", {"dead_band.width": 0.001, "dead_band.imbalance": 0.001}, 90.0)
    assert chosen(drives, one, ("dead_band", {"dead_band.width": 0.001, "dead_band.imbalance": 0.0}, gain)) == wanted


def test_one_that_contains_another_gives_way_to_it_at_little_loss_and_else_has_to_predict_better(drives):
    heavy = (RESISTED, {f"inertia.{name}": 0.001 for name in ("forward", "turn", "linear")}, 90.0)
    lags = [chosen(drives, heavy, ("yaw_lag", {"yaw_lag": 0.001}, gain)) for gain in (85, 65, 40)]
    assert lags == ["yaw_lag", "yaw_lag", RESISTED]
    assert chosen(drives, heavy, ("yaw_lag", {"yaw_lag": 0.3}, 65)) == RESISTED
    assert chosen(drives, heavy, had={**TRUTH, "yaw_lag": 0.001}) is None
    assert chosen(drives, (RESISTED, {**heavy[1], "yaw_lag": 0.0}, 90.0), had={**TRUTH, "yaw_lag": 0.3}) == RESISTED


@pytest.mark.parametrize(("gain", "wanted"), [(85.0, "yaw_scrub"), (40.0, "motor_lag")])
def test_an_effect_within_its_range_is_preferred_to_one_at_its_end(drives, gain, wanted, monkeypatch):
    monkeypatch.setattr(selection, "predicts_no_worse", lambda one, other: True)
    lag = ("motor_lag", {"motor_lag.time_constant": 1.0, "motor_lag.imbalance": 0.0}, 90.0)
    assert chosen(drives, lag, ("yaw_scrub", {"yaw_scrub": 0.1601}, gain)) == wanted


def test_only_an_end_that_is_not_neutral_is_an_edge(drives):
    assert at_edge("motor_lag.time_constant", 1.0, drives)
    assert not at_edge("dead_band.width", 0.0, drives)
    assert not at_edge("motor_lag.time_constant", 0.5, drives)
    assert not at_edge("motor_lag.time_constant", 1.0, replace(drives, ranges={"motor_lag.time_constant": (0.0, 2.0)}))


@pytest.mark.parametrize(
    ("name", "value", "range_after"),
    [("lateral_slip", -0.5, (-1.5, 0.5)), ("lateral_slip", 0.1, None), ("dropped_commands", 0.9, None)],
)
def test_a_range_doubles_towards_a_value_at_its_end_as_far_as_physics_allows(drives, name, value, range_after):
    assert widened(drives, {name: value}, ((name,),)).ranges.get(name) == range_after


def test_what_a_heavy_robot_has_is_fitted_beyond_the_range_of_most():
    heavy = {**TRUTH, "motor_lag.time_constant": 1.6, "motor_lag.imbalance": 0.0}
    drives, names = planted_drives(heavy, episodes=4, seconds=20.0), ("trim", "delay", "motor_lag.time_constant")
    found = fit_declared(drives, {**heavy, "motor_lag.time_constant": 0.1}, names)
    assert found.theta["motor_lag.time_constant"] == pytest.approx(1.6, abs=0.05)
    assert found.drives.ranges == {"motor_lag.time_constant": (0.0, 2.0)}


def test_a_value_without_a_best_one_is_looked_for_no_further_than_physics_allows(drives, monkeypatch):
    looked = []

    def at_the_end(where, theta, free, noise):
        looked.append(where.ranges["turn_slip"][1])
        return SimpleNamespace(drives=where, theta={"turn_slip": looked[-1]}, free=free, noise=noise)

    monkeypatch.setattr(selection, "fit", at_the_end)
    first = SimpleNamespace(drives=drives, theta={"turn_slip": 1.5}, free=(("turn_slip",),), noise=NOISE)
    assert selection.widen(first).theta == {"turn_slip": 15.0}
    assert looked == [3.0, 6.0, 12.0, 15.0]


MIXED = {**TRUTH, "yaw_scrub": 0.13, "lateral_slip": 0.002}
SLIP, SCRUB = map(adopted_with, ("lateral_slip", "yaw_scrub"))


@pytest.fixture(scope="module")
def base():
    return evaluate(planted_drives(MIXED, episodes=6, seconds=20.0), TRUTH, DECLARED, NOISE)


def searching_of_names(answers, asked):
    """A search that adopts what is given, in that order, less what it is to do without."""

    def search(base, seed, report, without=()):
        asked.append(without)
        effects = tuple(effect for effect in answers if effect.effect not in without)
        theta = {**TRUTH, **{effect.effect: MIXED[effect.effect] for effect in effects}}
        free = DECLARED + tuple(coordinate for effect in effects for coordinate in effect.free)
        return Findings(base, evaluate(base.drives, theta, free, NOISE), effects, (), (), ())

    return search


def named(base, monkeypatch, *answers, harmful=True):
    whole = selection.drop_negligible

    def weighed(found, seed):
        kept = whole(found, seed)
        return replace(kept, negligible=tuple(one._replace(harmful=harmful) for one in kept.negligible))

    monkeypatch.setattr(selection, "drop_negligible", weighed)
    asked, told = [], []
    monkeypatch.setattr(selection, "search", searching_of_names(answers, asked))
    return selection.select_effects(base, 1, told.append), asked, told


@pytest.mark.slow
def test_an_effect_that_misled_is_left_out_of_a_second_search_and_still_told(base, monkeypatch):
    found, asked, told = named(base, monkeypatch, SLIP, SCRUB)
    assert asked == [(), ("lateral_slip",)]
    assert "searching again without lateral_slip" in told
    assert [effect.effect for effect in found.adopted] == ["yaw_scrub"]
    assert [dropped.effect.effect for dropped in found.negligible] == ["lateral_slip"]


@pytest.mark.slow
def test_an_effect_that_does_no_harm_or_was_found_last_and_does_not_matter_misled_nobody(base, monkeypatch):
    found, asked, _ = named(base, monkeypatch, SLIP, SCRUB, harmful=False)
    assert asked == [()]
    assert [effect.effect for effect in found.adopted] == ["yaw_scrub"]
    found, asked, _ = named(base, monkeypatch, SCRUB, SLIP)
    assert asked == [()]
    assert [dropped.effect.effect for dropped in found.negligible] == ["lateral_slip"]


@pytest.mark.slow
def test_the_second_search_is_not_taken_where_it_predicts_worse(base, monkeypatch):
    monkeypatch.setattr(selection, "predicts_no_worse", lambda one, other: False)
    found, asked, _ = named(base, monkeypatch, SLIP, SCRUB)
    assert len(asked) == 2
    assert [effect.effect for effect in found.adopted] == ["yaw_scrub"]
    assert len(found.negligible) == 1


FREE = [f for f in candidates(ROBOT, TRUTH, ("trim", "delay")) if not f.form and not CATALOGUE[f.effect].trace.placed]


@pytest.fixture(scope="module")
def clean(drives):
    return evaluate(drives, TRUTH, DECLARED, NOISE)


def adopted(clean, monkeypatch, *rounds):
    """The gains of the effects adopted in rounds, each with an effect's gain and a curve's; and the remainder's."""
    left = iter(rounds)

    def gather_evidence(model, taken, seed):
        gain, curve = next(left, (0.0, 0.0))
        form = next(form for form in FREE if form.effect not in taken)
        neutral = {name: value for names, value in zip(form.free, form.neutral, strict=True) for name in names}
        screened, signal = screened_with(form.label, gain), curve_over_time(curve)
        fitted = replace(clean, theta={**clean.theta, **neutral})
        return Evidence([screened], {form.label: FittedCandidate(gain, fitted, screened)}, (), [signal])

    monkeypatch.setattr(selection, "gather_evidence", gather_evidence)
    monkeypatch.setattr(selection, "drop_idle", lambda model, effects: (model, effects))
    found = selection.search(clean, 1, lambda line: None)
    return [effect.gain for effect in found.adopted], [curve.gain for curve in found.unnamed_curves]


def test_an_effect_needs_fifteen_nats_a_hundredth_of_what_there_is_and_a_third_of_a_signal_s(clean, monkeypatch):
    for gain, expected in ((10.0, []), (14.9, []), (15.1, [15.1])):
        assert adopted(clean, monkeypatch, (gain, 0.0)) == (expected, [])
    for gain, expected in ((40.0, [5000.0]), (60.0, [5000.0, 60.0])):
        assert adopted(clean, monkeypatch, (5000.0, 0.0), (gain, 0.0)) == (expected, [])
    for curve, expected in ((300.0, [500.0, 100.0]), (400.0, [500.0])):
        assert adopted(clean, monkeypatch, (500.0, 0.0), (100.0, curve))[0] == expected


def test_no_more_than_five_effects_are_added_and_none_first_where_a_signal_says_far_more(clean, monkeypatch):
    assert adopted(clean, monkeypatch, *[(100.0, 0.0)] * 9)[0] == [100.0] * 5
    assert adopted(clean, monkeypatch, (100.0, 140.0)) == ([], [140.0])
    assert adopted(clean, monkeypatch, (100.0, 125.0))[0] == [100.0]
    assert adopted(clean, monkeypatch, (200.0, 238.0))[0] == [200.0]


@pytest.mark.parametrize(
    ("gain", "best", "beyond"),
    [(31.0, 0.0, True), (29.0, 0.0, False), (110.0, 90.0, False), (131.0, 100.0, True), (590.0, 500.0, False)],
)
def test_a_curve_goes_beyond_names_by_a_fifth_and_thirty_nats(gain, best, beyond):
    assert exceeds_names(curve_over_time(gain), best, RULES) == beyond


def test_an_effect_is_listed_by_its_full_fit_where_it_has_one_and_random_effects_among_them():
    fitted, other = screened_with("yaw_scrub", 20.0), screened_with("turn_slip", 50.0, 0.3)
    lost = RandomEffect("dropped_commands", 0.1, (0.0, 1.0), 60.0, 0.01)
    evidence = Evidence([other, fitted], {"yaw_scrub": FittedCandidate(80.0, None, fitted)}, (lost,), [])
    listed = [(one.effect, one.gain, one.p_value) for one in list_tried(evidence)]
    assert listed == [("yaw_scrub", 80.0, 0.002), ("dropped_commands", 60.0, 0.01), ("turn_slip", 50.0, 0.3)]


@pytest.mark.parametrize(
    ("drive", "left", "chosen"), [("ackermann", 1.7, True), ("ackermann", 3.8, False), ("differential", 3.8, True)]
)
def test_no_random_effect_stands_for_what_a_car_lacks_beside_it(monkeypatch, drive, left, chosen):
    """True ones leave up to 1.7 of what pulls commands. Robots on two wheels are judged as they always were."""
    lost = RandomEffect("dropped_commands", 0.5, (0.0, 0.6), 2000.0, 0.01, left)
    driven = SimpleNamespace(rules=RULES, robot=SimpleNamespace(drive=drive), rate_hz=20.0, tick_hz=60.0)
    model = SimpleNamespace(drives=driven)
    monkeypatch.setattr(selection, "fit_random", lambda model, one: FittedCandidate(one.gain, model, random=one))
    monkeypatch.setattr(selection, "predicts_no_worse", lambda one, other: True)
    assert (choose_best(model, Evidence([], {}, (lost,), []), 15.0) is not None) == chosen


FAULTS = {"dead_band": 0.12, "steering_lag": 0.3, "steering_friction": 0.4, "marker_offset.forward": 0.1}


@pytest.fixture(scope="module")
def four_faults():
    """What a search that names nothing leaves of a car with four faults; the steering's lag is 0.1 s by nature."""
    hidden = ("dead_band", {"width": 0.12}), ("servo", {"figure": 0.3}), ("scrubbing", {"figure": 0.4}), (
        "marker_offset", {"ahead": 0.1})  # fmt: skip
    case, car = hidden_cars.Case("car with four faults", hidden, "normal", 5, 0.02, 0.1), read_robot("car")
    log = hidden_cars.make_log(case, episodes=4, seconds=20.0)
    drives = gather(log, car, log.episodes)
    model = fit_declared(drives, {"steering_offset": 0.0, "delay": 0.0}, ("steering_offset", "delay"))
    return Findings(model, model, (), (), (), ())


@pytest.fixture(scope="module")
def together(four_faults):
    return eliminate(four_faults, lambda line: None)


@pytest.mark.slow
def test_all_faults_of_a_car_are_found_together_and_nothing_beside(together):
    assert {effect.effect for effect in together.adopted} == {name.split(".")[0] for name in FAULTS}
    assert {name: together.model.theta[name] for name in FAULTS} == pytest.approx(FAULTS, rel=0.05)
    assert all(effect.gain > RULES.sure_gain_nats for effect in together.adopted)


@pytest.mark.slow
def test_what_a_second_search_is_to_do_without_is_not_fitted_together_either(four_faults, monkeypatch):
    monkeypatch.setattr(selection, "OF_CARS", ("dead_band", "steering_lag"))
    found = eliminate(four_faults, lambda line: None, without=("dead_band",))
    assert [effect.effect for effect in found.adopted] == ["steering_lag"]


@pytest.mark.slow
def test_what_is_found_together_is_taken_only_if_surely_likelier_and_no_worse(four_faults, together, monkeypatch):
    monkeypatch.setattr(selection, "OF_CARS", tuple(effect.effect for effect in together.adopted))
    assert eliminate(replace(four_faults, model=together.model), lambda line: None) is None
    monkeypatch.setattr(selection, "predicts_no_worse", lambda one, other: False)
    assert eliminate(four_faults, lambda line: None) is None


@pytest.mark.parametrize(
    ("drive", "left", "asked"), [("ackermann", 400.0, 1), ("ackermann", 200.0, 0), ("differential", 400.0, 0)]
)
def test_a_car_of_which_the_search_leaves_much_over_is_fitted_with_all_that_cars_have(monkeypatch, drive, left, asked):
    base = SimpleNamespace(drives=SimpleNamespace(rules=RULES, robot=SimpleNamespace(drive=drive)))
    found = Findings(base, base, (), (), (curve_over_time(left),), ())
    looks = []
    monkeypatch.setattr(selection, "search", lambda base, seed, report, without=(): found)
    monkeypatch.setattr(selection, "drop_negligible", lambda found, seed: found)
    monkeypatch.setattr(selection, "eliminate", lambda found, report, without: looks.append(1))
    assert selection.select_effects(base, 1, lambda line: None) is found
    assert len(looks) == asked
