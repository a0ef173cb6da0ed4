"""Drives in small circles over a map, so that a camera sees its markings all the time."""

import numpy as np
from planted import RATE_HZ, driven_log

from proxytune.logs import Log


def circling_log(theta, *, noise, episodes: int = 6, seconds: float = 12.0, seed: int = 1) -> Log:
    """Duties that vary about a turn of half the road's width, one way round or the other."""
    random = np.random.default_rng(seed)
    rows = round(seconds * RATE_HZ)
    steps = random.normal(0.0, 0.06, (episodes, rows // 10 + 1, 2)).repeat(10, axis=1)[:, :rows]
    turn = np.where(np.arange(episodes)[:, None] % 2 == 0, (0.2, 0.34), (0.34, 0.2))
    places = np.array([(0.29, 0.88), (0.88, 0.29), (1.46, 0.88), (0.88, 1.46), (0.29, 0.5), (1.46, 1.2)])
    starts = np.column_stack((places[np.arange(episodes) % len(places)], random.uniform(-np.pi, np.pi, episodes)))
    return driven_log(theta, np.clip(turn[:, None] + steps, 0.0, 1.0), starts, seed=seed, noise=noise)
