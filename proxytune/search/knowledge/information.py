"""Which agents tell what of θ, and what stands between them and a sharper answer."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from proxytune.search.knowledge.likelihood import Likelihood
from proxytune.search.surrogate import Array

STEP = 0.02
"""In widths of the box, to both sides."""

Limit = Literal["trials", "starts"]


@dataclass(frozen=True)
class Information:
    """What the outputs tell of one parameter where θ is most probable.

    Attributes:
        name: The parameter.
        agents: Share of each agent in what is told, all its metrics together, most first; they add up to 1.
        metrics: Share of each metric, all agents together, most first.
        limit: What keeps more from being told: too few "trials" near the answer, so that the outputs are not known
            there; or too few "starts", so that their means are rough and noisy.
    """

    name: str
    agents: tuple[tuple[str, float], ...]
    metrics: tuple[tuple[str, float], ...]
    limit: Limit


def information_of(likelihood: Likelihood, point: Array) -> tuple[Information, ...]:
    """What each output tells of each parameter at a point of the unit cube: squared slope over variance.

    That is Fisher's information of a normal output; what outputs tell together is not counted twice by taking shares.
    """
    slopes, total = _slopes(likelihood, point), likelihood.standardised(point[None])[1][0]
    _, unknown = likelihood.model.predict(point[None])
    by_trials = unknown[0, likelihood.columns] / total
    names = [likelihood.goal.outputs[column] for column in likelihood.columns]
    found = []
    for name, slope in zip(likelihood.model.space.names, slopes, strict=True):
        told = slope**2 / total
        shares = told / max(float(told.sum()), 1e-300)
        limit: Limit = "trials" if float(shares @ by_trials) > 0.5 else "starts"
        agents, metrics = (_summed([pair[side] for pair in names], shares) for side in (0, 1))
        found.append(Information(name, agents, metrics, limit))
    return tuple(found)


def _slopes(likelihood: Likelihood, point: Array) -> Array:
    """How each output changes with each parameter, per width of the box, shape (parameters, outputs)."""
    steps = STEP * np.eye(len(point))
    ends = np.clip(np.concatenate([point + steps, point - steps]), 0.0, 1.0)
    mean, _ = likelihood.model.predict(ends)
    above, below = mean[:, likelihood.columns].reshape(2, len(point), -1)
    width = np.diag(ends[: len(point)] - ends[len(point) :])
    return np.asarray((above - below) / width[:, None])


def _summed(names: Sequence[str], shares: Array) -> tuple[tuple[str, float], ...]:
    sums: dict[str, float] = {}
    for name, share in zip(names, shares, strict=True):
        sums[name] = sums.get(name, 0.0) + float(share)
    return tuple(sorted(sums.items(), key=lambda pair: (-pair[1], pair[0])))
