"""The search for missing effects: fit, look at what is left, adopt, look again."""

from collections.abc import Callable, Collection

from proxytune.diagnosis.measured.drives import Drives
from proxytune.diagnosis.model.fitting import Fit, fit
from proxytune.diagnosis.model.sizing import sized
from proxytune.diagnosis.naming.adoption import adopt, without_idle
from proxytune.diagnosis.naming.choice import Choice, best_of, choice_of
from proxytune.diagnosis.naming.flexible import Curve
from proxytune.diagnosis.naming.found import Adopted, Found, Tried
from proxytune.diagnosis.naming.round import look, tried_of, unnamed
from proxytune.diagnosis.rules import RULES
from proxytune.effects import effect_of
from proxytune.space import Theta

Told = Callable[[str], None]
"""Takes a line about what is being done."""


def fit_declared(drives: Drives, theta: Theta, declared: tuple[str, ...]) -> Fit:
    """The model with declared parameters only, fitted from where θ has them."""
    return fit(drives, theta, tuple((name,) for name in declared))


def search(base: Fit, seed: int, told: Told, without: Collection[str] = ()) -> Found:
    """Add what a model is missing, one effect at a time.

    Args:
        base: The model, fitted.
        seed: Of the null distributions.
        told: Hears of progress.
        without: Effects that are not to be added.
    """
    declared = {effect_of(name) for coordinate in base.free for name in coordinate} | set(without)
    model = base
    adopted: list[Adopted] = []
    tried: list[Tried] = []
    first_curves: list[Curve] = []
    remainder: list[Curve] = []
    for number in range(RULES.most_effects + 1):
        told(f"looking for what is missing, round {number + 1}")
        taken = declared | {effect.effect for effect in adopted}
        looked = look(model, taken, seed)
        tried = tried or tried_of(looked)
        first_curves = first_curves or looked.curves
        least = max(RULES.least_gain_nats, RULES.least_gain_share * sum(effect.gain for effect in adopted))
        best = best_of(model, looked, least)
        remainder = unnamed(looked, max(least, best.gain if best else 0.0))
        if best is None or number == RULES.most_effects or (remainder and not _goes_on(adopted, best, remainder)):
            break
        if best.random is not None:
            best = choice_of(model, sized(model, best.random, seed))
        model, adopted = without_idle(best.fitted, adopt(adopted, best, looked))
    return Found(base, model, tuple(adopted), tuple(tried), tuple(remainder), tuple(first_curves))


def _goes_on(adopted: list[Adopted], best: Choice, remainder: list[Curve]) -> bool:
    """Whether an effect is worth adding though some signal explains more: not as the first, for it might be wrong."""
    least = max(RULES.curve_margin_nats, RULES.share_of_curve * remainder[0].gain)
    return bool(adopted) and best.gain > least
