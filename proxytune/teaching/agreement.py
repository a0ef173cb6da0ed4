"""Whether one figure ranks proxies as another does: Kendall's τ with its interval, from draws of both."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from proxytune.learning.plv import LEVELS
from proxytune.scores import Array

SURE = 0.95
"""Two proxies are ordered where so many of the draws order them so."""


@dataclass(frozen=True)
class Agreement:
    """How far two rankings of the same proxies agree.

    Attributes:
        tau: Kendall's τ, the median over draws: 1 the same ranking, −1 its reverse.
        low: Lower end of its 95 % interval.
        high: Upper end.
        reversed: Pairs of proxies, by name, that the two figures order otherwise, each order sure; the first of a pair
            is ahead by the second figure.
        proxies: How many are ranked.
    """

    tau: float
    low: float
    high: float
    reversed: tuple[tuple[str, str], ...]
    proxies: int


def agreement(names: Sequence[str], first: Array, second: Array) -> Agreement:
    """Compare two rankings, each from draws (draws, proxies) in which more is better; ties count for neither order."""
    one, other = _orders(first), _orders(second)
    above, below = np.triu_indices(len(names), 1)
    pairs = one[:, above, below] * other[:, above, below]
    taus = pairs.sum(axis=1) / np.sqrt(_untied(one[:, above, below]) * _untied(other[:, above, below]))
    contrary = _sure(one) * _sure(other) < 0
    ahead = np.argwhere(contrary & (_sure(other) > 0))
    low, middle, high = np.quantile(taus, (LEVELS[0], 0.5, LEVELS[1]))
    named = tuple((names[better], names[worse]) for better, worse in ahead)
    return Agreement(float(middle), float(low), float(high), named, len(names))


def _orders(values: Array) -> Array:
    """1 where the first proxy is ahead of the second, −1 where it is behind, 0 where they are tied."""
    return np.asarray((values[:, :, None] > values[:, None]).astype(float) - (values[:, :, None] < values[:, None]))


def _untied(orders: Array) -> Array:
    return np.asarray(np.maximum(np.abs(orders).sum(axis=1), 1.0))


def _sure(orders: Array) -> Array:
    """1 or −1 where nearly all draws order two proxies so, else 0."""
    return np.asarray(((orders > 0).mean(axis=0) >= SURE).astype(float) - ((orders < 0).mean(axis=0) >= SURE))
