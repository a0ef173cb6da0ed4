"""Effects that strike at random: what they do to single commands, weighed as a mixture over all commands.

A mean model cannot see them: a command that is lost now and then changes the motion after it, not on average.
"""

import math
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from scipy.optimize import minimize_scalar

from proxytune.diagnosis.drives import Drives, Floats, Whole, sum_by
from proxytune.diagnosis.fitting import Fit
from proxytune.diagnosis.replay import RANDOM_EFFECTS, between, paths
from proxytune.effects.trace import Draws

MEMORY_S = 2.5
"""A command moves nothing any more after so long."""

SHIFTS = 99
"""How often the null distribution is drawn."""


class Responses(NamedTuple):
    """What would have happened had a command been lost: one row per command that changed anything.

    Attributes:
        pull: Inner product of the change of the innovations with the innovations.
        size: Inner product of the change with itself.
        shifted: The pull after the innovations were shifted in time, which chance alone could make (shifts, commands).
    """

    pull: Floats
    size: Floats
    shifted: Floats


class RandomEffect(NamedTuple):
    """A random effect weighed.

    Attributes:
        effect: Its name in the catalogue.
        parameter: The name of its parameter in θ.
        value: Its likeliest size.
        interval: Sizes that lose less than 1.92 nats, the 95 % interval of a likelihood.
        gain: Its gain in log-likelihood beyond what chance gives on average [nats].
        p_value: How often chance gains as much.
    """

    effect: str
    parameter: str
    value: float
    interval: tuple[float, float]
    gain: float
    p_value: float


def random_effects(fitted: Fit, seed: int) -> tuple[RandomEffect, ...]:
    """Every effect that draws, weighed on what the model leaves over."""
    answered = responses(fitted, seed)
    if len(answered.size) == 0:
        return ()
    rate = fitted.drives.rate_hz
    return tuple(_weighed(name, draws, rate, answered) for name, draws in RANDOM_EFFECTS.items())


def _mixture(late: Floats, weight: Floats, pull: Floats, size: Floats) -> Floats:
    """Log-likelihood ratio of being late by one of these times, in commands, with these log-weights."""
    ratios = [w - step * pull - 0.5 * step**2 * size for step, w in zip(late, weight, strict=True)]
    return np.asarray(np.logaddexp.reduce(ratios, axis=0))


def _weighed(effect: str, draws: Draws, rate_hz: float, answered: Responses) -> RandomEffect:
    def ratio(value: float, pull: Floats) -> Floats:
        late = draws.lateness(value, rate_hz)
        return _mixture(late.commands, late.log_weights, pull, answered.size)

    low, high = np.log(draws.sizes)
    grid = np.exp(np.linspace(low, high, 25))

    def total(value: float) -> float:
        return float(ratio(value, answered.pull).sum())

    here = int(np.argmax([total(value) for value in grid]))
    around = (float(np.log(grid[max(0, here - 1)])), float(np.log(grid[min(len(grid) - 1, here + 1)])))
    best = float(np.exp(minimize_scalar(lambda log: -total(np.exp(log)), bounds=around, method="bounded").x))
    chance = np.max([ratio(value, answered.shifted).sum(axis=1) for value in grid], axis=0)
    gain = total(best)
    likely = [value for value in grid if total(value) > gain - 1.92] + [best]
    p_value = float((1 + (chance >= gain).sum()) / (1 + len(chance)))
    return RandomEffect(
        effect, effect, best, (float(min(likely)), float(max(likely))), gain - max(0.0, float(chance.mean())), p_value
    )


def responses(fitted: Fit, seed: int) -> Responses:
    """What the loss of each command would have changed.

    Commands far apart are lost together, so that one replay tells of many.
    """
    drives = fitted.drives
    changed, phase = _changed(drives)
    here = between(drives, paths(drives, fitted.theta))
    shifts = _shifts(len(drives.episode), seed)
    z = fitted.innovations.reshape(-1, 3)
    moved = np.stack([np.roll(z, shift, axis=0).ravel() for shift in shifts], axis=1)
    found = [_lost_together(fitted, changed[phase == number], here, moved) for number in np.unique(phase)]
    if not found:
        return Responses(np.empty(0), np.empty(0), np.empty((SHIFTS, 0)))
    pull, size, shifted = (np.concatenate(part, axis=-1) for part in zip(*found, strict=True))
    kept = size > 1e-3
    return Responses(pull[kept], size[kept], shifted[:, kept])


def _changed(drives: Drives) -> tuple[Whole, Whole]:
    """Episode and tick of every command that differs from the one before it (C, 2), and its phase (C,).

    Those of one phase are at least MEMORY_S apart: of commands closer together than usual the first counts.
    """
    before = np.concatenate((drives.rest[:, None], drives.duties[:, :-1]), axis=1)
    found = np.argwhere(drives.issued & np.any(np.abs(drives.duties - before) > 1e-9, axis=-1))
    number = np.floor(found[:, 1] * drives.rate_hz / drives.tick_hz + 1e-6).astype(int)
    _, first = np.unique(found[:, 0] * (number.max(initial=0) + 1) + number, return_index=True)
    return found[first], number[first] % math.ceil(MEMORY_S * drives.rate_hz)


def _without(drives: Drives, lost: Whole) -> Floats:
    """Duties without some commands: the one before stays in force until the next."""
    duties = drives.duties.copy()
    for episode, tick in lost:
        later = np.flatnonzero(drives.issued[episode, tick + 1 :])
        end = tick + 1 + int(later[0]) if len(later) else duties.shape[1]
        duties[episode, tick:end] = drives.rest[episode] if tick == 0 else drives.duties[episode, tick - 1]
    return duties


def _lost_together(fitted: Fit, lost: Whole, here: Floats, moved: Floats) -> tuple[Floats, Floats, Floats]:
    """Pull, size and shifted pulls of commands of one phase."""
    drives = fitted.drives
    other = replace(drives, duties=_without(drives, lost))
    change = fitted.whiten.whiten(here - between(other, paths(other, fitted.theta)))
    label = np.repeat(_label(drives, lost), 3)
    size = sum_by(label, change**2, len(lost))
    both = np.concatenate((fitted.innovations[:, None], moved), axis=1)
    pulls = sum_by(label, change[:, None] * both, len(lost))
    pulls /= _loudness(label, change, both, pulls / (size[:, None] + 1e-12))
    return pulls[:, 0], size, pulls[:, 1:].T


def _loudness(label: Whole, change: Floats, innovations: Floats, share: Floats) -> Floats:
    """Standard deviation of what the loss of a command does not explain, where it acts, at least 1 (commands, columns).

    After a command all motion may be harder to predict: only what points its way speaks for its loss.
    """
    weight = np.abs(change)
    count = len(share)
    total = sum_by(label, weight, count)[:, None] + 1e-12
    along = sum_by(label, (weight * change)[:, None] * innovations, count)
    cubes = sum_by(label, weight * change**2, count)[:, None]
    energy = sum_by(label, weight[:, None] * innovations**2, count) - 2.0 * share * along + share**2 * cubes
    return np.asarray(np.sqrt(np.maximum(1.0, energy / total)))


def _label(drives: Drives, lost: Whole) -> Whole:
    """Which lost command each increment comes after, −1 where none (N,)."""
    length = drives.duties.shape[1]
    at = np.searchsorted(lost @ (length, 1), drives.episode * length + drives.last - 1, side="right") - 1
    return np.where((at >= 0) & (lost[np.maximum(at, 0), 0] == drives.episode), at, -1)


def _shifts(length: int, seed: int) -> Whole:
    return np.random.default_rng(seed).integers(length // 20 + 1, length - length // 20, size=SHIFTS)
