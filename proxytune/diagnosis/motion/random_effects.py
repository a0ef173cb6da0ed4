"""Effects that strike at random: the response of motion to single commands, weighed as a mixture over all commands.

A mean model cannot see them: a command that is lost now and then changes the motion after it, not on average. With a_j
the change of the innovations z had command j been lost, the log-likelihood ratio of an effect that makes a command late
by l commands with probability π_l is Σ_j log Σ_l π_l exp(−l a_jᵀz − ½ l² a_jᵀa_j): a size is weighed by its maximum,
against the same for innovations shifted in time.

This likelihood takes all other commands as they were sent. Where many are lost or late it finds too small a size, and
much too narrow an interval; simulated drives have the same fault, and so give it back: `infer_size_indirectly` finds
the size of which simulated drives speak for the effect as the measured ones do (indirect inference).
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy.optimize import minimize_scalar

from proxytune.diagnosis.motion.drives import Drives, Floats, Whole, sum_by
from proxytune.diagnosis.motion.fitting import Fit
from proxytune.diagnosis.motion.innovations import (
    HUBER,
    RANDOM_EFFECTS,
    clip_outliers,
    drawn_paths,
    increments,
    increments_along,
    lateness,
    paths,
)
from proxytune.effects import Draws, Lateness

MEMORY_S = 2.5
"""A command moves nothing any more after so long."""
GRID = 25
"""Sizes that are tried at first, evenly in their logarithm."""
SHIFTS = 99
"""How often the null distribution is drawn."""
AT_ONCE = 4
"""So many draws of it are weighed together: what is computed of more is slow to reach."""
SEEN = 1.0
"""A command can be seen if its loss would move the innovations by a standard deviation."""


class Responses(NamedTuple):
    """Responses of the innovations to the loss of single commands, a row per command that changed anything."""

    gradient: Floats  # product of the change with the innovations
    size: Floats  # product of the change with itself
    others: Floats  # gradient with other innovations (columns, commands)


class RandomEffect(NamedTuple):
    """A random effect weighed."""

    effect: str  # its name, which is that of its only parameter too
    value: float  # its likeliest size
    interval: tuple[float, float]  # all sizes that are looked for, until `infer_size_indirectly` narrows it
    gain: float  # beyond what chance gives on average [nats]
    p_value: float
    # what the likeliest lateness of every command leaves of its pull on the innovations: about 1 if lateness is all
    left: float = 0.0

    def spread_s(self, rate_hz: float) -> float:
        """How far apart the times lie by which it makes commands late, of so many a second [s]."""
        return float(np.ptp(RANDOM_EFFECTS[self.effect].lateness(self.value, rate_hz).commands)) / rate_hz


def random_effects(fitted: Fit, seed: int) -> tuple[RandomEffect, ...]:
    """Weigh every effect that draws on what the model leaves over."""
    z = fitted.innovations.reshape(-1, 3)
    apart = len(z) // 20
    shifts = np.random.default_rng(seed).integers(apart + 1, len(z) - apart, size=SHIFTS)
    answered = responses(fitted, np.stack([np.roll(z, shift, axis=0).ravel() for shift in shifts], axis=1))
    if len(answered.size) == 0:
        return ()
    return tuple(_weigh(name, draws, fitted.drives.rate_hz, answered) for name, draws in RANDOM_EFFECTS.items())


def _weigh(effect: str, draws: Draws, rate_hz: float, answered: Responses) -> RandomEffect:
    best, gain = likeliest_size(draws, rate_hz, answered.gradient, answered.size)
    # Of chance six digits will do, in half the time.
    others, energy = (values.astype(np.float32) for values in (answered.others, answered.size))
    chance = np.max([_ratio(draws, rate_hz, size, others, energy) for size in _grid(draws)], axis=0)
    p_value = float((1 + (chance >= gain).sum()) / (1 + len(chance)))
    left = _left(draws.lateness(best, rate_hz), answered.gradient, answered.size)
    return RandomEffect(effect, best, draws.sizes, gain - max(0.0, float(chance.mean())), p_value, left)


def _left(late: Lateness, gradient: Floats, energy: Floats) -> float:
    """What the likeliest lateness of every command that can be seen leaves [standard deviations, root mean square]."""
    seen = energy > SEEN
    if not seen.any():
        return 0.0
    gradient, energy = gradient[seen], energy[seen]
    likeliest = late.commands[_ratios(late, gradient, energy).argmax(axis=0)]
    return float(np.sqrt(np.mean((gradient + likeliest * energy) ** 2 / energy)))


def likeliest_size(draws: Draws, rate_hz: float, gradient: Floats, energy: Floats) -> tuple[float, float]:
    """Find the size of an effect that responses of commands (commands,) speak for most, and its gain [nats]."""
    grid = _grid(draws)
    here = int(np.argmax([_ratio(draws, rate_hz, size, gradient, energy) for size in grid]))
    ends = np.log((grid[max(0, here - 1)], grid[min(len(grid) - 1, here + 1)]))
    found = minimize_scalar(
        lambda log: -float(_ratio(draws, rate_hz, float(np.exp(log)), gradient, energy)),
        bounds=(float(ends[0]), float(ends[1])),
        method="bounded",
    )
    return float(np.exp(found.x)), -float(found.fun)


def _grid(draws: Draws) -> Floats:
    return np.geomspace(*draws.sizes, GRID)


def _ratio(draws: Draws, rate_hz: float, size: float, gradient: Floats, energy: Floats) -> Floats:
    """The log-likelihood ratio of an effect of this size, over all commands (…,)."""
    late, rows = draws.lateness(size, rate_hz), np.atleast_2d(gradient)
    parts = (rows[first : first + AT_ONCE] for first in range(0, len(rows), AT_ONCE))
    found = np.concatenate([_mixture(late, part, energy).sum(axis=-1) for part in parts])
    return found.reshape(gradient.shape[:-1])


def _mixture(late: Lateness, gradient: Floats, energy: Floats) -> Floats:
    """The log-likelihood ratio of each command's having been late by one of these times (…, commands)."""
    ratios = _ratios(late, gradient, energy)
    most = ratios.max(axis=0)
    ratios -= most
    return np.asarray(most + np.log(np.exp(ratios, out=ratios).sum(axis=0)))


def _ratios(late: Lateness, gradient: Floats, energy: Floats) -> Floats:
    """The same of each time, with its weight (times, …, commands)."""
    by, weights = (part.reshape(-1, *(1 for _ in gradient.shape)).astype(gradient.dtype) for part in late[1:])
    ratios = np.asarray(by * gradient)
    np.subtract(weights - 0.5 * by**2 * energy, ratios, out=ratios)
    return ratios


def responses(fitted: Fit, others: Floats) -> Responses:
    """Replay the drives with each command lost, and see what changes, and what would of other innovations."""
    # Commands far apart are lost together, so that one replay tells of many.
    changed, phase = _changed_commands(fitted.drives)
    values = np.concatenate((fitted.innovations[:, None], others), axis=1)
    heard = values, values**2
    found = [_respond_to_phase(fitted, changed[phase == number], *heard) for number in np.unique(phase)]
    if not found:
        return Responses(np.empty(0), np.empty(0), np.empty((others.shape[1], 0)))
    size, gradients = (np.concatenate(part) for part in zip(*found, strict=True))
    kept = size > 1e-3
    return Responses(gradients[kept, 0], size[kept], gradients[kept, 1:].T)


def _changed_commands(drives: Drives) -> tuple[Whole, Whole]:
    """Episode and tick of commands unlike the one before (C, 2), and phases (C,); those of one are MEMORY_S apart."""
    before = np.concatenate((drives.rest[:, None], drives.duties[:, :-1]), axis=1)
    found = np.argwhere(drives.issued & np.any(np.abs(drives.duties - before) > 1e-9, axis=-1))
    # Of commands closer together than usual the first counts.
    number = np.floor(found[:, 1] * drives.rate_hz / drives.tick_hz + 1e-6).astype(int)
    _, first = np.unique(found[:, 0] * (number.max(initial=0) + 1) + number, return_index=True)
    return found[first], number[first] % math.ceil(MEMORY_S * drives.rate_hz)


def _lose_commands(drives: Drives, lost: Whole) -> Floats:
    """Duties without some commands: the one before stays in force until the next."""
    duties, length = drives.duties.copy(), drives.duties.shape[1]
    issued = np.flatnonzero(drives.issued)
    later = np.append(issued, drives.issued.size)[np.searchsorted(issued, lost @ (length, 1), side="right")]
    for (episode, tick), end in zip(lost, later - lost[:, 0] * length, strict=True):
        duties[episode, tick:end] = drives.rest[episode] if tick == 0 else drives.duties[episode, tick - 1]
    return duties


def _respond_to_phase(fitted: Fit, lost: Whole, heard: Floats, squares: Floats) -> tuple[Floats, Floats]:
    """The size of the response to each command of one phase (commands,), and its gradients (commands, columns)."""
    drives = fitted.drives
    without = increments_along(drives, paths(drives, fitted.theta, _lose_commands(drives, lost)))
    change = fitted.whiten.whiten(increments(drives, fitted.theta) - without)
    # Which lost command each increment comes after, −1 where none.
    length = drives.duties.shape[1]
    at = np.searchsorted(lost @ (length, 1), drives.episode * length + drives.last - 1, side="right") - 1
    after = np.where((at >= 0) & (lost[np.maximum(at, 0), 0] == drives.episode), at, -1)
    label = np.repeat(after, 3)
    size = sum_by(label, change**2, len(lost))
    gradients = sum_by(label, heard, len(lost), change)
    # After a command all motion may be harder to predict: only what points its way speaks for its loss.
    share = gradients / (size[:, None] + 1e-12)
    weight, count = np.abs(change), len(share)
    total = sum_by(label, weight, count)[:, None] + 1e-12
    along = sum_by(label, heard, count, weight * change)
    cubes = sum_by(label, weight, count, change**2)[:, None]
    energy = sum_by(label, squares, count, weight) - 2.0 * share * along + share**2 * cubes
    return size, gradients / np.sqrt(np.maximum(1.0, energy / total))


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


def infer_size_indirectly(model: Fit, effect: RandomEffect, seed: int) -> RandomEffect:
    """Give the effect the size at which simulated drives say what the measured ones do, and its interval."""
    draws, rate = RANDOM_EFFECTS[effect.effect], model.drives.rate_hz
    sizes = np.geomspace(SMALLEST * effect.value, min(LARGEST * effect.value, draws.sizes[1]), SIZES)
    simulated = [_simulate_innovations(model, effect, size, seed + n) for n in range(DRAWS) for size in sizes]
    answered = responses(model, np.stack(simulated, axis=1))
    likeliest = np.log([likeliest_size(draws, rate, one, answered.size)[0] for one in answered.others])
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
    """Innovations of the model on drives with the effect and with noise, as loud as those measured (3N,)."""
    drives = model.drives
    late = lateness({effect.effect: size}, drives.rate_hz)
    theta = {**model.theta, effect.effect: size, "delay": max(0.0, model.theta["delay"] - late)}
    drawn = increments_along(drives, drawn_paths(drives, theta, seed)) - increments(drives, model.theta)
    struck = model.whiten.whiten(drawn)
    noise = np.random.default_rng(seed).standard_normal(len(struck))
    share = max(QUIETEST, 1.0 - float(np.mean(struck**2)) / float(np.mean(model.innovations**2)))
    left: Floats = struck + np.sqrt(share * np.mean(model.innovations**2)) * noise
    # What is left once the model's free parameters have been fitted again.
    for _ in range(STEPS):
        weighted = model.slopes * (np.abs(left) < HUBER)[:, None]
        left = left - model.slopes @ (
            np.linalg.pinv(weighted.T @ model.slopes) @ (model.slopes.T @ clip_outliers(left))
        )
    return left
