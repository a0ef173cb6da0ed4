"""The search for missing effects: fit, weigh what is left over, adopt, weigh again."""

from collections.abc import Callable, Collection

from proxytune.diagnosis.measured.drives import Drives
from proxytune.diagnosis.model.fitting import Fit, fit
from proxytune.diagnosis.model.sizing import size_random_effect
from proxytune.diagnosis.naming.adoption import adopt, drop_idle
from proxytune.diagnosis.naming.choice import Choice, choose_best, fit_choice
from proxytune.diagnosis.naming.evidence import curves_beyond_names, gather_evidence, list_tried
from proxytune.diagnosis.naming.findings import AdoptedEffect, Findings, TriedEffect
from proxytune.diagnosis.naming.flexible import Curve
from proxytune.diagnosis.rules import RULES
from proxytune.effects import effect_of
from proxytune.space import Theta

Report = Callable[[str], None]
"""Takes a line about each step, for people who wait."""


def fit_declared(drives: Drives, theta: Theta, declared: tuple[str, ...]) -> Fit:
    """Fit the model with declared parameters only, from where θ has them."""
    return fit(drives, theta, tuple((name,) for name in declared))


def search(base: Fit, seed: int, report: Report, without: Collection[str] = ()) -> Findings:
    """Add what a model is missing, one effect at a time.

    Args:
        base: The model, fitted.
        seed: Of the null distributions.
        report: Takes a line about each step, as it begins.
        without: Effects that are not to be added.
    """
    declared = {effect_of(name) for coordinate in base.free for name in coordinate} | set(without)
    model = base
    adopted: list[AdoptedEffect] = []
    tried: list[TriedEffect] = []
    first_curves: list[Curve] = []
    remainder: list[Curve] = []
    for number in range(RULES.most_effects + 1):
        report(f"looking for what is missing, round {number + 1}")
        taken = declared | {effect.effect for effect in adopted}
        evidence = gather_evidence(model, taken, seed)
        tried = tried or list_tried(evidence)
        first_curves = first_curves or evidence.curves
        least = max(RULES.least_gain_nats, RULES.least_gain_share * sum(effect.gain for effect in adopted))
        best = choose_best(model, evidence, least)
        remainder = curves_beyond_names(evidence, max(least, best.gain if best else 0.0))
        # One round more than there may be effects: the last one only says what is still left over.
        if (
            best is None
            or number == RULES.most_effects
            or (remainder and not _is_worth_adding(adopted, best, remainder))
        ):
            break
        if best.random is not None:
            best = fit_choice(model, size_random_effect(model, best.random, seed))
        model, adopted = drop_idle(best.fitted, adopt(adopted, best, evidence))
    return Findings(base, model, tuple(adopted), tuple(tried), tuple(remainder), tuple(first_curves))


def _is_worth_adding(adopted: list[AdoptedEffect], best: Choice, remainder: list[Curve]) -> bool:
    """Whether an effect is worth adding although a signal explains more; the first never is, for it might be wrong."""
    least = max(RULES.curve_margin_nats, RULES.share_of_curve * remainder[0].gain)
    return bool(adopted) and best.gain > least
