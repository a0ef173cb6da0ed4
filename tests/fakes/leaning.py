"""Pictures with a planted steering, and how far a learner is from it."""

import numpy as np

from proxytune.domain import Demonstration


def pictures(count, seed, rows=12, columns=16):
    """Pictures whose brightness leans to one side, and the steering that goes with it."""
    generator = np.random.default_rng(seed)
    lean = generator.uniform(-1, 1, count)
    ramp = 128 + 100 * lean[:, None] * np.linspace(-1, 1, columns)
    noisy = ramp[:, None, :, None] + generator.normal(0, 8, (count, rows, columns, 3))
    commands = 0.3 + 0.1 * np.stack((-lean, lean), axis=1)
    return Demonstration(np.clip(noisy, 0, 255).astype(np.uint8), commands)


def error(learner, weights, samples):
    answered = np.array([learner.act(weights, picture) for picture in samples.observations])
    return float(np.abs(answered - samples.commands).mean())
