"""Which of the named effects matter: what each is worth in error of prediction, whatever its evidence.

On much data an effect of a millimetre has clear evidence. It is kept only if a model without it, all else fitted again,
predicts worse. Effects are weighed on the fitted drives, each block predicted by what was fitted to others, so that the
drives kept aside can tell what that came to.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from proxytune.diagnosis.horizon.floor import noise_floor, pose_noise
from proxytune.diagnosis.horizon.polish import compare_errors, fit_windows, held_out_squares, horizons
from proxytune.diagnosis.horizon.windows import Ratio, Windows, blocks_of, cut, motion_along, pose_errors, ratio, rmse
from proxytune.diagnosis.measured.drives import Drives, Floats
from proxytune.diagnosis.model.fitting import fit
from proxytune.diagnosis.model.replay import drawn_paths, paths
from proxytune.diagnosis.naming.findings import AdoptedEffect, DroppedEffect, Findings, Variant, without_effect
from proxytune.diagnosis.rules import RULES

FITTED_S = 2.0
"""Windows that models with and without an effect are fitted to, the longest that drives have up to this."""

DRAWS = 10
"""How often the drives are replayed with a random effect drawn."""

LARGEST_SHARE = 0.95
"""A random effect is said to make up no more of the error than this share, even if its draws stray further."""

Worth = Mapping[float, Ratio]
"""The error without an effect by the error with it, by horizon [s]."""


class WeighedEffect(NamedTuple):
    """An effect, and the error without it by the error with it."""

    effect: AdoptedEffect
    worth: Worth

    @property
    def material(self) -> bool:
        """Whether predictions are shown to need it; draws add to the error at every horizon: one is not enough."""
        shown = sum(one.value >= RULES.material_factor and one.above for one in self.worth.values())
        return shown >= (1 if self.effect.free else min(2, len(self.worth)))

    @property
    def harmful(self) -> bool:
        """Whether predictions are shown to be better without it."""
        return any(one.value <= 1.0 / RULES.material_factor and one.below for one in self.worth.values())

    @property
    def largest(self) -> float:
        """The largest of the ratios."""
        return max(one.value for one in self.worth.values())


def drop_immaterial(found: Findings, seed: int) -> Findings:
    """Drop the effects that do not matter, the weakest first.

    Args:
        found: What the search came to.
        seed: Of the draws of random effects.
    """
    drives = found.model.drives
    variant, kept = Variant(found.model.theta, found.model.free), list(found.adopted)
    dropped: list[DroppedEffect] = []
    while kept and horizons(drives):
        weighed = _weigh_effects(drives, variant, kept, seed)
        weakest = min((one for one in weighed if not one.material), key=lambda one: one.largest, default=None)
        if weakest is None:
            break
        dropped.append(DroppedEffect(weakest.effect, variant, weakest.harmful))
        variant = without_effect(variant, weakest.effect, drives.rate_hz)
        kept.remove(weakest.effect)
    if not dropped:
        return found
    model = fit(drives, variant.theta, variant.free, found.model.noise)
    return replace(found, model=model, adopted=tuple(kept), immaterial=tuple(dropped))


def _weigh_effects(
    drives: Drives, variant: Variant, effects: Sequence[AdoptedEffect], seed: int
) -> list[WeighedEffect]:
    """Weigh each effect of a model on the drives it was fitted to, with blocks left out in turn."""
    length = _length(drives)
    whole = held_out_squares(drives, variant.theta, variant.free, length)
    found = []
    for effect in effects:
        if effect.free:
            theta, free = without_effect(variant, effect, drives.rate_hz)
            worth = compare_errors(drives, held_out_squares(drives, theta, free, length), whole)
        else:
            # Blocks left out add errors of the fit, which are no draws.
            squares = {h: pose_errors(drives, variant.theta, cut(drives, h))[:, 0] ** 2 for h in whole}
            worth = _worth_of_draws(drives, variant, effect, squares, seed)
        found.append(WeighedEffect(effect, worth))
    return found


def worth(fitted: Drives, tested: Drives, variant: Variant, effect: AdoptedEffect, seed: int) -> Worth:
    """The error without an effect by the error with it, on drives that nothing was fitted to.

    Args:
        fitted: Drives that the model with the effect, and the one without it, are fitted to.
        tested: Drives that they predict.
        variant: The model with it.
        effect: The effect.
        seed: Of the draws of random effects.
    """
    whole = _squares(fitted, tested, variant)
    if effect.free:
        return compare_errors(tested, _squares(fitted, tested, without_effect(variant, effect, fitted.rate_hz)), whole)
    return _worth_of_draws(tested, variant, effect, whole, seed)


def _squares(fitted: Drives, tested: Drives, variant: Variant) -> dict[float, Floats]:
    windows = cut(fitted, _length(fitted))
    theta = fit_windows(fitted, variant.theta, variant.free, windows)
    return {h: pose_errors(tested, theta, cut(tested, h))[:, 0] ** 2 for h in horizons(tested)}


def _length(drives: Drives) -> float:
    """The length of the windows that are fitted to [s]."""
    return max((h for h in horizons(drives) if h <= FITTED_S), default=min(horizons(drives), default=FITTED_S))


def _worth_of_draws(
    drives: Drives, variant: Variant, effect: AdoptedEffect, whole: Mapping[float, Floats], seed: int
) -> dict[float, Ratio]:
    """What a random effect is worth: it moves no mean, so what counts is how much of the error its draws make up.

    With s the distance of drawn and expected replays and e the error, the error without the draws would be √(e² − s²).
    It cannot be below what the noise of poses makes alone: draws that would leave less are not in the data.
    """
    found, noise = {}, pose_noise(drives, variant.theta)
    for horizon, squares in whole.items():
        windows = cut(drives, horizon)
        blocks, floor = blocks_of(drives, windows), noise_floor(drives, windows, noise)[0]
        share = ratio(_drawn_squares(drives, variant, windows, seed), squares, blocks)
        error = rmse(squares, blocks)
        ends = zip((share.value, *share.interval), (error.value, *error.interval), strict=True)
        value, low, high = (_ratio_without_draws(min(one, _room(most, floor))) for one, most in ends)
        found[horizon] = Ratio(value, (low, high))
    return found


def _room(error: float, floor: float) -> float:
    """The share of an error that is not the noise of poses."""
    return float(np.sqrt(max(0.0, 1.0 - (floor / error) ** 2))) if error > 0.0 else 0.0


def _ratio_without_draws(share: float) -> float:
    return float(1.0 / np.sqrt(1.0 - min(share, LARGEST_SHARE) ** 2))


def _drawn_squares(drives: Drives, variant: Variant, windows: Windows, seed: int) -> Floats:
    """Mean squared distance [m²] of drawn and expected replays at every compared pose (M,)."""
    expected = motion_along(drives, paths(drives, variant.theta), windows)
    total = np.zeros(len(expected))
    for draw in range(DRAWS):
        drawn = motion_along(drives, drawn_paths(drives, variant.theta, seed + draw), windows)
        total += np.square(drawn - expected)[:, :2].sum(axis=1)
    return total / DRAWS
