"""How large a random effect is: of that size, simulated drives speak for it as the measured ones do.

The likelihood of single commands takes all others as they were sent. Where many are lost or late it finds too small a
size, and much too narrow an interval; simulated drives have the same fault, and so give it back (indirect inference).
"""

from collections.abc import Sequence

import numpy as np

from proxytune.diagnosis.measured.drives import Floats
from proxytune.diagnosis.model.events import RandomEffect, likeliest_size, responses
from proxytune.diagnosis.model.fitting import Fit
from proxytune.diagnosis.model.innovations import HUBER, clip_outliers
from proxytune.diagnosis.model.replay import RANDOM_EFFECTS, drawn_paths, increments, increments_along, lateness

SMALLEST, LARGEST, SIZES = 0.6, 3.0, 8
"""Simulated sizes lie between these multiples of the likeliest one."""

DRAWS = 5
"""Drives are simulated so often for each size."""

QUIETEST = 0.1
"""Noise has at least this share of the innovations' variance."""

STEPS = 3
"""Newton steps of the free parameters: a lost command is an outlier, which a robust fit hardly follows."""

WIDE = 2.2
"""Half an interval is so many standard deviations between simulated drives: 95 % for some thirty of them."""


def size_random_effect(model: Fit, effect: RandomEffect, seed: int) -> RandomEffect:
    """The effect with the size at which simulated drives say what the measured ones do, and its interval.

    Args:
        model: The model without the effect, whose delay has its mean lateness.
        effect: The effect, as the likelihood of single commands has it.
        seed: Of draws and noise.
    """
    draws, rate = RANDOM_EFFECTS[effect.effect], model.drives.rate_hz
    sizes = np.geomspace(SMALLEST * effect.value, min(LARGEST * effect.value, draws.sizes[1]), SIZES)
    simulated = [_simulate_innovations(model, effect, size, seed + n) for n in range(DRAWS) for size in sizes]
    answered = responses(model, np.stack(simulated, axis=1))
    likeliest = np.log([likeliest_size(draws, rate, pull, answered.size)[0] for pull in answered.others])
    value, low, high = _invert(sizes, likeliest.reshape(DRAWS, SIZES), float(np.log(effect.value)))
    return effect._replace(value=value, interval=(low, high))


def _invert(sizes: Floats, likeliest: Floats, measured: float) -> Sequence[float]:
    """The size of which drives say what is measured, and the least and greatest of which they still might."""
    means = np.maximum.accumulate(likeliest.mean(axis=0)) + 1e-9 * np.arange(len(sizes))
    spread = WIDE * float(np.sqrt(np.mean(np.var(likeliest, axis=0, ddof=1))))
    return [
        float(np.exp(np.interp(one, means, np.log(sizes)))) for one in (measured, measured - spread, measured + spread)
    ]


def _simulate_innovations(model: Fit, effect: RandomEffect, size: float, seed: int) -> Floats:
    """What the model leaves over of drives with the effect and noise, as loud as that of the measured ones (3N,)."""
    drives = model.drives
    late = lateness({effect.parameter: size}, drives.rate_hz)
    theta = {**model.theta, effect.parameter: size, "delay": max(0.0, model.theta["delay"] - late)}
    drawn = increments_along(drives, drawn_paths(drives, theta, seed)) - increments(drives, model.theta)
    struck = model.whiten.whiten(drawn)
    noise = np.random.default_rng(seed).standard_normal(len(struck))
    share = max(QUIETEST, 1.0 - float(np.mean(struck**2)) / float(np.mean(model.innovations**2)))
    return _refit(model, struck + np.sqrt(share * np.mean(model.innovations**2)) * noise)


def _refit(model: Fit, innovations: Floats) -> Floats:
    """What is left of innovations (3N,) once the model's free parameters have been fitted to them."""
    left = innovations
    for _ in range(STEPS):
        weighted = model.slopes * (np.abs(left) < HUBER)[:, None]
        left = left - model.slopes @ (
            np.linalg.pinv(weighted.T @ model.slopes) @ (model.slopes.T @ clip_outliers(left))
        )
    return left
