"""Forward selection of effects with backward elimination: what a model of a robot's motion lacks.

From the model with declared parameters, fitted, each round of `search` goes through

    score test   every candidate effect on the whitened innovations z of the model          screening.screen
    refit        the best few, together with the free parameters and the noise              evidence.gather_evidence
    weigh        the held-out gain G of each, and of curves over every signal [nats]        evidence.gather_evidence
    adopt        the best of p ≤ p_value and G ≥ least_gain_nats that predicts no worse     choose_best, adopt
    drop         backwards: what pays no more beside the effect adopted last                drop_idle
    widen        the range of a value at its end, which other robots than most may need     widen

and looks again at what the new model leaves over, until nothing pays or a curve says far more than any name. Effects
of a car hide one another, so that chance is asked once all are there (`drop_unconfirmed`), and some pay together but
not one at a time: where a curve is left over, all that cars are
modelled with is fitted together, and what is not sure is taken out (`eliminate`, backward elimination). Evidence
grows with the length of a log, usefulness does not: `select_effects` then drops the effects that are negligible for
prediction (`effect_size`), and searches once more without one that did harm while others were chosen beside it.
Every threshold is one of `diagnosis.Rules`, as the drives carry them.
"""

import math
from collections.abc import Collection, Sequence
from dataclasses import replace

import numpy as np

from proxytune.diagnosis.answer import Progress, Rules
from proxytune.diagnosis.motion.drives import Drives
from proxytune.diagnosis.motion.effect_size import drop_negligible
from proxytune.diagnosis.motion.evidence import (
    AdoptedEffect,
    DroppedEffect,
    Evidence,
    Findings,
    FittedCandidate,
    TriedEffect,
    Variant,
    exceeds_names,
    gather_evidence,
    list_tried,
    without_effect,
)
from proxytune.diagnosis.motion.fitting import KEPT_SOLVABLE, Fit, derivatives_by_block, fit, held_out_log_likelihood
from proxytune.diagnosis.motion.innovations import at_edge, huber, lateness, span, widened
from proxytune.diagnosis.motion.prediction import Ratio, cut, ratio_over, squared_distances
from proxytune.diagnosis.motion.random_effects import RandomEffect, infer_size_indirectly
from proxytune.diagnosis.motion.screening import Candidate, ScreenedCandidate, candidates, screen
from proxytune.diagnosis.motion.signals import SignalCurve, fit_curves
from proxytune.effects import effect_of
from proxytune.space import Theta


def fit_declared(drives: Drives, theta: Theta, declared: tuple[str, ...]) -> Fit:
    """Fit the model with declared parameters only, from where θ has them."""
    return widen(fit(drives, theta, tuple((name,) for name in declared)))


def widen(model: Fit) -> Fit:
    """Fit again in wider ranges while a value lies at an end that physics does not set: the optimum lies beyond."""
    wider = widened(model.drives, model.theta, model.free)
    return model if wider is model.drives else widen(fit(wider, model.theta, model.free, model.noise))


def select_effects(base: Fit, seed: int, report: Progress) -> Findings:
    """Search for what a model is missing, and drop what is negligible."""
    first, misled = _search_and_drop(base, seed, report, ())
    if not misled:
        return first
    # What was chosen beside an effect that does harm may be wrong: without it, where that predicts no worse.
    names = tuple(dropped.effect.effect for dropped in misled)
    report(f"searching again without {', '.join(names)}")
    again, _ = _search_and_drop(base, seed, report, names)
    if not predicts_no_worse(again.model, first.model):
        return first
    return replace(again, negligible=again.negligible + misled)


def _search_and_drop(
    base: Fit, seed: int, report: Progress, without: tuple[str, ...]
) -> tuple[Findings, tuple[DroppedEffect, ...]]:
    """Search, drop what is negligible, and tell which effects did harm while others were chosen beside them."""
    found = search(base, seed, report, without)
    left = max((curve.gain for curve in found.unnamed_curves), default=0.0)
    if base.drives.robot.drive == "ackermann" and left > base.drives.rules.sure_gain_nats:
        together = eliminate(found, report, without)
        if together is not None:
            # Each was held against all others; taken out one after another they would make up for one another.
            return together, ()
    report("weighing what each effect is worth")
    kept = drop_negligible(found, seed)
    order = [effect.effect for effect in found.adopted]
    last = max((order.index(effect.effect) for effect in kept.adopted), default=-1)
    harmful = (dropped for dropped in kept.negligible if dropped.harmful)
    return kept, tuple(dropped for dropped in harmful if order.index(dropped.effect.effect) < last)


def search(base: Fit, seed: int, report: Progress, without: Collection[str] = ()) -> Findings:
    """Add what a model is missing, one effect at a time, but not those it is to be without."""
    rules = base.drives.rules
    declared = {effect_of(name) for coordinate in base.free for name in coordinate} | set(without)
    of_car = base.drives.robot.drive == "ackermann"
    most = rules.most_effects_of_cars if of_car else rules.most_effects
    model = base
    adopted: list[AdoptedEffect] = []
    tried: list[TriedEffect] = []
    first_curves: list[SignalCurve] = []
    unnamed: list[SignalCurve] = []
    for number in range(most + 1):
        report(f"looking for what is missing, round {number + 1}")
        evidence = gather_evidence(model, declared | {effect.effect for effect in adopted}, seed)
        tried = tried or list_tried(evidence)
        first_curves = first_curves or evidence.curves
        least = _least_gain(adopted, rules)
        best = choose_best(model, evidence, least, 1.0 if of_car else rules.p_value)
        named = max(least, best.gain if best else 0.0)
        unnamed = [curve for curve in evidence.curves if exceeds_names(curve, named, rules)]
        # One round more than there may be effects: the last one only says what is still left over.
        if best is None or number == most:
            break
        # Where a signal explains more, an effect is still added if it says enough beside it; the first never is, for it
        # might be wrong.
        enough = max(rules.curve_margin_nats, rules.share_of_curve * unnamed[0].gain) if unnamed else 0.0
        if unnamed and not of_car and not (adopted and best.gain > enough):
            break
        if best.random is not None:
            best = fit_random(model, infer_size_indirectly(model, best.random, seed))
        model, adopted = drop_idle(best.fitted, adopt(adopted, best, evidence))
        model = widen(model)
    if of_car:
        report("holding each effect against chance")
        model, adopted = drop_unconfirmed(model, adopted, declared, seed)
    return Findings(base, model, tuple(adopted), tuple(tried), tuple(unnamed), tuple(first_curves))


OF_CARS = (
    "dead_band", "motor_lag", "rolling", "steering_lag", "steering_curve", "steering_friction", "tyres",
    "marker_offset", "heading_offset",
)  # fmt: skip
"""What every car has in some measure: a motor, a steering, tyres, and a place where it is tracked."""


def eliminate(found: Findings, report: Progress, without: Collection[str] = ()) -> Findings | None:
    """Fit all that cars are modelled with and what was found together, and take out what is not sure.

    The effect of least evidence by Wald's statistic goes first, and all others are fitted again. None where what is
    left is not surely more likely than what was found, or predicts worse.
    """
    base, rules = found.declared, found.declared.drives.rules
    robot, theta = base.drives.robot, dict(base.theta)
    present = {effect_of(name) for coordinate in base.free for name in coordinate}
    effects = [effect for effect in found.adopted if effect.effect not in OF_CARS]
    theta |= {name: found.model.theta[name] for effect in effects for name in effect.names}
    for name in OF_CARS:
        if name in robot.catalogue.names and name not in present and name not in without:
            names = robot.catalogue.theta_names(name)
            theta |= {one: robot.catalogue.parameters[one].neutral_value(robot.figures) for one in names}
            effects.append(AdoptedEffect(name, "", names, tuple((one,) for one in names), 0.0, 0.0, ()))
    report("fitting all that cars are modelled with together")
    free = base.free + tuple(coordinate for effect in effects for coordinate in effect.free)
    model = fit(found.model.drives, theta, free, base.noise)
    sure = list[AdoptedEffect]()
    while doubtful := [effect for effect in effects if effect.free and effect not in sure]:
        effect = _weakest(model, doubtful)
        smaller = _fit_without(effect, model)
        gain = _likelihood(model) - _likelihood(smaller)
        effects.remove(effect)
        if gain < rules.sure_gain_nats:
            report(f"taking out {effect.effect}")
            model, sure = smaller, []
        else:
            sure.append(replace(effect, gain=gain))
            effects.append(sure[-1])
    gained = _likelihood(model) - _likelihood(found.model)
    if gained < rules.sure_gain_nats or not predicts_no_worse(model, found.model):
        return None
    curves = (curve for curve in fit_curves(model) if exceeds_names(curve, _least_gain(effects, rules), rules))
    return replace(found, model=model, adopted=tuple(effects), unnamed_curves=tuple(curves))


def _weakest(model: Fit, effects: Sequence[AdoptedEffect]) -> AdoptedEffect:
    """The effect of the least Wald statistic: what it would cost to have it at neutral, by the Hessian [nats]."""
    robot, (_, hessian) = model.drives.robot, derivatives_by_block(model, model.slopes)
    covariance = np.linalg.inv(hessian.sum(axis=0) + KEPT_SOLVABLE * np.eye(len(model.free)))

    def wald(effect: AdoptedEffect) -> float:
        own = [model.free.index(coordinate) for coordinate in effect.free]
        spans = [span(coordinate, model.drives) for coordinate in effect.free]
        moved = [
            (model.theta[name] - robot.catalogue.parameters[name].neutral_value(robot.figures)) / (high - low)
            for (name, *_), (low, high) in zip(effect.free, spans, strict=True)
        ]
        return 0.5 * float(moved @ np.linalg.solve(covariance[np.ix_(own, own)], moved))

    return min(effects, key=wald)


def drop_unconfirmed(
    model: Fit, adopted: Sequence[AdoptedEffect], taken: set[str], seed: int
) -> tuple[Fit, list[AdoptedEffect]]:
    """Drop effects of a car that chance does as well as, the others given, the weakest first.

    A car lacks several large effects at once, and each hides the others: what is left over is then no noise, and chance
    cannot be drawn from it. So effects are added by their gain, and the weaker ones are held against chance once all
    are there.
    """
    kept = list(adopted)
    for effect in sorted((one for one in adopted if one.free), key=lambda one: one.gain):
        rules, without = model.drives.rules, _fit_without(effect, model)
        others = taken | {one.effect for one in kept if one is not effect}
        forms = [one for one in candidates(model.drives.robot, without.theta, others) if one.effect == effect.effect]
        p_value = min((one.p_value for one in screen(without, forms, seed)), default=1.0)
        gain = _gain(model, without)
        place = kept.index(effect)
        if p_value > rules.p_value and gain < rules.sure_gain_nats:
            model = without
            kept.pop(place)
        else:
            kept[place] = replace(effect, p_value=p_value)
    return model, kept


def _fit_without(effect: AdoptedEffect, model: Fit) -> Fit:
    """Fit all of a model but one of its effects again."""
    rest = without_effect(Variant(model.theta, model.free), effect, model.drives.rate_hz)
    return fit(model.drives, rest.theta, rest.free, model.noise)


def _gain(one: Fit, other: Fit) -> float:
    """The held-out evidence for one model over another [nats]."""
    return float(held_out_log_likelihood(one).sum() - held_out_log_likelihood(other).sum())


def _likelihood(model: Fit) -> float:
    """The log-likelihood of the drives that a model was fitted to [nats]."""
    return -float(huber(model.innovations).sum() + model.whiten.log_determinant.sum())


def _least_gain(adopted: Sequence[AdoptedEffect], rules: Rules) -> float:
    """The evidence that one effect more needs beside those adopted [nats]."""
    return max(rules.least_gain_nats, rules.least_gain_share * sum(effect.gain for effect in adopted))


def choose_best(model: Fit, evidence: Evidence, least: float, p_value: float | None = None) -> FittedCandidate | None:
    """Choose the effect with most evidence, of those with at least so much [nats] that predict no worse; None if none.

    Chance does as well as the chosen with a probability of at most `p_value`, or what the rules say.
    """
    rules = model.drives.rules
    most = rules.p_value if p_value is None else p_value
    fits = [one for one in evidence.fits.values() if one.screened and one.screened.p_value <= most]
    named = [one for one in fits if not _is_everywhere(one)]
    rare = [effect for effect in evidence.random if effect.p_value <= rules.p_value]
    # A car's motion is hidden by much else at first, which pulls commands early as well as late.
    most_left = rules.most_left_of_commands if model.drives.robot.drive == "ackermann" else math.inf
    least_s = rules.least_spread_ticks / model.drives.tick_hz
    clear = [
        effect
        for effect in rare
        if effect.gain >= rules.least_random_gain_nats
        and effect.left <= most_left
        and effect.spread_s(model.drives.rate_hz) > least_s
    ]
    everything: list[FittedCandidate | RandomEffect] = [*named, *clear]
    ranked = sorted(everything, key=lambda one: -one.gain)
    # Generators: a random effect costs a fit, which is made only once its turn comes.
    enough = (_fitted(model, one) for one in ranked if one.gain >= least)
    best = next((one for one in enough if _predicts_well_enough(one, model)), None)
    if best is None:
        return None
    plain = next((one for one in named if _is_plain_form_of(one, best)), best)
    if not _is_at_edge(plain):
        return plain
    # The first that gains nearly as much, is not at an end of its range, and predicts no worse.
    near = (_fitted(model, one) for one in ranked if one.gain > rules.inside_share * plain.gain)
    inside = next((one for one in near if not _is_at_edge(one)), None)
    return inside if inside is not None and predicts_no_worse(inside.fitted, plain.fitted) else plain


def _is_everywhere(one: FittedCandidate) -> bool:
    """Tell whether an effect of a place acts where most of the drives were: then it is no matter of place."""
    if one.screened is None:
        return False
    drives, name = one.fitted.drives, one.screened.candidate.effect
    trace = drives.robot.catalogue.effect(name).trace
    if trace is None or not trace.placed:
        return False
    _, x, y, radius = (one.fitted.theta[name] for name in drives.robot.catalogue.theta_names(name))
    return float((np.hypot(*(drives.poses[:, 0, :2] - (x, y)).T) < radius).mean()) > drives.rules.patch_share


def _is_plain_form_of(one: FittedCandidate, best: FittedCandidate) -> bool:
    """Tell whether it is the best effect's form for both wheels, or a special case, at little loss of evidence.

    A special case may lose more of it where the best effect does not predict surely better.
    """
    if one.screened is None or best.screened is None or one is best or one.screened.candidate.form:
        return False
    name, effect = best.screened.candidate.effect, one.screened.candidate.effect
    rules, share = one.fitted.drives.rules, one.gain / best.gain
    special = effect in _contained(best.fitted.drives, name)
    if share > rules.plain_share:
        return special or name == effect
    return special and share >= rules.rival_share and not _predicts_better(best.fitted, one.fitted)


def _predicts_well_enough(one: FittedCandidate, model: Fit) -> bool:
    """Tell whether an effect predicts no worse than the model, and better where it contains an effect of the model."""
    contained = _contained(model.drives, one.screened.candidate.effect) if one.screened else ()
    if contained and any(effect_of(name) in contained for name in model.theta):
        return _predicts_better(one.fitted, model)
    return predicts_no_worse(one.fitted, model)


def _contained(drives: Drives, effect: str) -> tuple[str, ...]:
    """The effects that are special cases of another."""
    trace = drives.robot.catalogue.effect(effect).trace
    return trace.contains if trace else ()


def _is_at_edge(one: FittedCandidate) -> bool:
    """Tell whether one of its values was fitted to an end of its range: the effect then stands for something else."""
    free = one.screened.candidate.free if one.screened else ()
    return any(at_edge(name, one.fitted.theta[name], one.fitted.drives) for names in free for name in names)


def _fitted(model: Fit, effect: FittedCandidate | RandomEffect) -> FittedCandidate:
    return effect if isinstance(effect, FittedCandidate) else fit_random(model, effect)


def fit_random(model: Fit, effect: RandomEffect) -> FittedCandidate:
    """Fit the model with an effect that draws."""
    theta = {**model.theta, effect.effect: effect.value}
    # The delay gives up the mean lateness of the draws, which it had to stand for without the effect.
    late = lateness(theta, model.drives.rate_hz) - lateness(model.theta, model.drives.rate_hz)
    theta["delay"] = max(0.0, model.theta["delay"] - late)
    return FittedCandidate(effect.gain, fit(model.drives, theta, model.free, model.noise), random=effect)


def predicts_no_worse(one: Fit, other: Fit) -> bool:
    """Tell whether one model's error over windows is not shown to exceed the other's beyond the guard's factor."""
    compared = _compare_predictions(one, other)
    return compared is None or compared.interval[0] <= other.drives.rules.guard_factor


def _predicts_better(one: Fit, other: Fit) -> bool:
    """Tell whether one model's error over windows is surely less than the other's, where there are windows."""
    compared = _compare_predictions(one, other)
    return compared is None or compared.below


def _compare_predictions(one: Fit, other: Fit) -> Ratio | None:
    """The ratio of one model's error over windows to another's; None where drives are too short for windows."""
    drives = other.drives
    windows = cut(drives, drives.rules.guard_horizon_s)
    if len(windows.begin) < 2:
        return None
    own, others = (squared_distances(fitted.drives, fitted.theta, windows) for fitted in (one, other))
    return ratio_over(drives, windows, own, others)


def adopt(adopted: list[AdoptedEffect], best: FittedCandidate, evidence: Evidence) -> list[AdoptedEffect]:
    """Add an effect to those of a model, with the rivals that the same evidence leaves it."""
    if (draw := best.random) is not None:
        rules = best.fitted.drives.rules
        least = min(draw.gain - rules.rival_nats, rules.rival_share * draw.gain)
        close = [other for other in evidence.random if other.effect != draw.effect and other.gain > least]
        rivals = tuple(Candidate(one.effect, "", ((one.effect,),), {}, (0.0,), ((one.value,),)) for one in close)
        own = (draw.effect,)
        return [*adopted, AdoptedEffect(draw.effect, "", own, (), draw.gain, draw.p_value, rivals, draw.interval)]
    assert best.screened is not None
    form = best.screened.candidate
    names = tuple(dict.fromkeys([name for coordinate in form.free for name in coordinate] + list(form.fixed)))
    rivals = _rivals(best, best.screened, evidence)
    return [*adopted, AdoptedEffect(form.effect, form.form, names, form.free, best.gain, best.screened.p_value, rivals)]


def _rivals(best: FittedCandidate, chosen: ScreenedCandidate, evidence: Evidence) -> tuple[Candidate, ...]:
    """Other effects with nearly as much evidence, or most of it and predictions no worse, or that do the same."""
    rules, rivals = best.fitted.drives.rules, dict[str, Candidate]()
    for one in evidence.screened:
        if chosen.candidate.effect in _contained(best.fitted.drives, one.candidate.effect):
            continue
        other = evidence.fits.get(one.candidate.label)
        close = other is not None and (
            other.gain > best.gain - rules.rival_nats
            or (other.gain >= rules.rival_share * best.gain and predicts_no_worse(other.fitted, best.fitted))
        )
        size = float(np.linalg.norm(one.column) * np.linalg.norm(chosen.column))
        alike = size > 0.0 and float(one.column @ chosen.column) / size > rules.rival_cosine
        if one.candidate.effect != chosen.candidate.effect and (close or alike):
            rivals.setdefault(one.candidate.effect, one.candidate)
    return tuple(rivals.values())


def drop_idle(model: Fit, adopted: Sequence[AdoptedEffect]) -> tuple[Fit, list[AdoptedEffect]]:
    """Drop the first effect that no longer pays beside the one adopted last; at most one a round."""
    # Random effects stay: they move no mean, so the likelihood of the mean cannot speak for them. The delay, which has
    # given them its lateness, stays to take it back.
    draws = any(not effect.free for effect in adopted)
    for effect in adopted[:-1]:
        if effect.free and len(adopted) > 1 and not (draws and effect.effect == "delay"):
            without = _fit_without(effect, model)
            if _gain(model, without) < model.drives.rules.least_gain_nats:
                return without, [other for other in adopted if other is not effect]
    return model, list(adopted)
