"""The planar plant from the origin on, as a diagnosis replays it thousands of times."""

import numpy as np

from proxytune.diagnosis.measured.drives import Floats


def walk(twists: Floats, tick_s: float) -> Floats:
    """The poses before the first tick and after each, from the origin on.

    They are those of the planar plant but for rounding. Episodes are driven by the plant itself: they stay what they
    were to the last bit.

    Args:
        twists: Twists (…, time, 3), each held for a tick.
        tick_s: Length of a tick [s].

    Returns:
        Poses (…, time + 1, 3), headings unwrapped.
    """
    poses = np.zeros((*twists.shape[:-2], twists.shape[-2] + 1, 3))
    turns = twists[..., 2] * tick_s
    headings = turns.cumsum(axis=-1)
    turns[turns == 0.0] = np.finfo(float).eps
    # Tangents of half the angles, for numpy has a fast tangent: cos α = (1 − t²)/(1 + t²), sin α = 2t/(1 + t²).
    middle, quarter = np.tan(0.5 * headings - 0.25 * turns), np.tan(0.25 * turns)
    square = middle * middle
    chord = 4.0 * tick_s * quarter / ((1.0 + quarter * quarter) * (1.0 + square) * turns)
    forward, cosine, sine = twists[..., 0] * chord, 1.0 - square, 2.0 * middle
    x, y = forward * cosine, forward * sine
    if twists[..., 1].any():
        sideways = twists[..., 1] * chord
        x, y = x - sideways * sine, y + sideways * cosine
    for channel, way in enumerate((x, y)):
        way.cumsum(axis=-1, out=poses[..., 1:, channel])
    poses[..., 1:, 2] = headings
    return poses
