"""Naming what a model lacks: search, drop what does not matter, and search again where a harmful effect misled."""

from dataclasses import replace

from proxytune.diagnosis.model.fitting import Fit
from proxytune.diagnosis.naming.choice import predicts_no_worse
from proxytune.diagnosis.naming.findings import DroppedEffect, Findings
from proxytune.diagnosis.naming.materiality import drop_immaterial
from proxytune.diagnosis.naming.search import Report, search


def name_effects(base: Fit, seed: int, report: Report) -> Findings:
    """Search for what a model is missing, and drop what does not matter.

    What was chosen beside an effect that does harm may be wrong. So the search is then made once more without that
    effect, and taken where it predicts no worse.

    Args:
        base: The model with declared parameters only, fitted.
        seed: Of the null distributions and of draws.
        report: Takes a line about each step, as it begins.
    """
    first, misled = _search_and_weigh(base, seed, report, ())
    if not misled:
        return first
    names = tuple(dropped.effect.effect for dropped in misled)
    report(f"searching again without {', '.join(names)}")
    again, _ = _search_and_weigh(base, seed, report, names)
    return (
        replace(again, immaterial=again.immaterial + misled) if predicts_no_worse(again.model, first.model) else first
    )


def _search_and_weigh(
    base: Fit, seed: int, report: Report, without: tuple[str, ...]
) -> tuple[Findings, tuple[DroppedEffect, ...]]:
    """Search, drop what does not matter, and tell which effects did harm while others were chosen beside them."""
    found = search(base, seed, report, without)
    report("weighing what each effect is worth")
    kept = drop_immaterial(found, seed)
    order = [effect.effect for effect in found.adopted]
    last = max((order.index(effect.effect) for effect in kept.adopted), default=-1)
    harmful = (dropped for dropped in kept.immaterial if dropped.harmful)
    return kept, tuple(dropped for dropped in harmful if order.index(dropped.effect.effect) < last)
