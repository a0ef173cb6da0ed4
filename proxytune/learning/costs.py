"""What target samples cost: those that the expert's driving gives, those that the learner's own gives, and labels."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from proxytune.learning.plv import general_plv
from proxytune.settings import Section

Array = NDArray[np.float64]
KEYS = ("off_policy", "on_policy", "label")


@dataclass(frozen=True)
class Costs:
    """What one target sample costs, in any one unit.

    Attributes:
        off_policy: One that the expert's driving gives.
        on_policy: One that the learner's own driving gives.
        label: One answer of the expert, on top of either.
    """

    off_policy: float = 1.0
    on_policy: float = 1.0
    label: float = 0.0

    @property
    def per_sample(self) -> tuple[float, float]:
        """All that one on-policy sample costs, and one off-policy sample."""
        return self.on_policy + self.label, self.off_policy + self.label


def read_costs(section: Section) -> Costs:
    """Read the table [teaching.costs].

    Raises:
        SettingsError: With file, key and remedy.
    """
    section.only(KEYS)
    return Costs(**{key: section.number(key, getattr(Costs, key), low=0.0) for key in KEYS})


def split_samples(count: Array | float, expert_drives: float) -> tuple[Array, Array]:
    """On-policy and off-policy samples among so many, of which the expert drives for the first ones.

    Args:
        count: How many samples, of any shape.
        expert_drives: The number from which on the learner drives itself; infinite where it never does.
    """
    off = np.minimum(count, expert_drives)
    with np.errstate(invalid="ignore"):
        return np.where(off < count, np.subtract(count, off), 0.0), off


def cost_saved(costs: Costs, *, without: tuple[Array, Array], with_proxy: tuple[Array, Array]) -> Array:
    """PLV in cost: what the target samples cost that are needed without a proxy, less those needed with it.

    Args:
        costs: Of one sample and label.
        without: On-policy and off-policy samples needed without the proxy, as `split_samples` has them.
        with_proxy: The same with it.
    """
    cost_on, cost_off = costs.per_sample
    paid, paid_with = _with_a_price(costs, without), _with_a_price(costs, with_proxy)
    return general_plv(without=paid, with_proxy=paid_with, cost_on=cost_on, cost_off=cost_off)  # eq. (6)


def _with_a_price(costs: Costs, samples: tuple[Array, Array]) -> tuple[Array, Array]:
    """Samples without those that cost nothing, of which there may be infinitely many."""
    on, off = (np.where(price > 0.0, count, 0.0) for price, count in zip(costs.per_sample, samples, strict=True))
    return on, off
