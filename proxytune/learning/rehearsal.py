"""Rehearsal: what a proxy taught is gone over again beside the target's samples, so that it is not forgotten."""

import numpy as np

from proxytune.domain import Demonstration


def mix_samples(new: Demonstration, earlier: Demonstration, share: float) -> Demonstration:
    """The new samples, then so many of the earlier ones that these are this share of all, or all that there are.

    Those taken lie evenly over the earlier ones, and so over their lessons.

    Args:
        new: Samples of the target.
        earlier: Samples of the proxy.
        share: Share of the earlier ones among all, from 0 to below 1.
    """
    wanted = min(len(earlier.commands), round(len(new.commands) * share / (1.0 - share)))
    rows = np.linspace(0, len(earlier.commands) - 1, wanted).round().astype(int)
    return Demonstration(
        np.concatenate((new.observations, earlier.observations[rows])),
        np.concatenate((new.commands, earlier.commands[rows])),
    )
