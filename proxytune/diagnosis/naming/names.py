"""The named effects of a model: those with evidence that matter, and were not chosen beside one that does harm."""

from dataclasses import replace

from proxytune.diagnosis.model.fitting import Fit
from proxytune.diagnosis.naming.choice import no_worse
from proxytune.diagnosis.naming.found import Dropped, Found
from proxytune.diagnosis.naming.materiality import without_immaterial
from proxytune.diagnosis.naming.search import Told, search


def name_effects(base: Fit, seed: int, told: Told) -> Found:
    """Search for what a model is missing, and drop what does not matter.

    What was chosen beside an effect that does harm may be wrong. So the search is then made once more without that
    effect, and taken where it predicts no worse.

    Args:
        base: The model with declared parameters only, fitted.
        seed: Of the null distributions and of draws.
        told: Hears of progress.
    """
    first, misled = _weighed(base, seed, told, ())
    if not misled:
        return first
    names = tuple(dropped.effect.effect for dropped in misled)
    told(f"searching again without {', '.join(names)}")
    again, _ = _weighed(base, seed, told, names)
    return replace(again, immaterial=again.immaterial + misled) if no_worse(again.model, first.model) else first


def _weighed(base: Fit, seed: int, told: Told, without: tuple[str, ...]) -> tuple[Found, tuple[Dropped, ...]]:
    """What a search comes to, and what was dropped of it that did harm and that others had been chosen beside."""
    found = search(base, seed, told, without)
    told("weighing what each effect is worth")
    kept = without_immaterial(found, seed)
    order = [effect.effect for effect in found.adopted]
    last = max((order.index(effect.effect) for effect in kept.adopted), default=-1)
    harmful = (dropped for dropped in kept.immaterial if dropped.harmful)
    return kept, tuple(dropped for dropped in harmful if order.index(dropped.effect.effect) < last)
