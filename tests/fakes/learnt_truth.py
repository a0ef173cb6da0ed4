"""A robot whose hidden motion is a learnt effect: what a fit should find again."""

from proxytune.effects import FittedRange, Learnt, LearntCurve, learnt_theta

SEEN = FittedRange((-0.6, 0.6), (-6.0, 6.0))


def learnt(*curves):
    return learnt_theta(Learnt(SEEN, tuple(LearntCurve(*curve) for curve in curves)))


TURNING = learnt(("turn_rate", "yaw", (-2.0, -0.5, 0.5, 2.0), (0.5, 0.3, -0.3, -0.5)))
"""The robot turns too little, most of all slowly: more or less a yaw scrub."""

VEERING = learnt(("turn_rate", "yaw", (-2.0, -0.5, 0.5, 2.0), (0.3, 0.5, 0.5, 0.3)))
"""The robot veers to the left whichever way it turns: no named effect does so."""

MANY = learnt(
    ("transients", "left", (0.1, 0.5), (0.3, -0.2)),
    ("transients", "right", (0.1, 0.5), (-0.1, 0.2)),
    ("time", "left", (4.0, 9.0), (-0.2, 0.1)),
    ("use", "right", (0.02, 0.05), (-0.2, -0.3)),
    ("load", "left", (2.0,), (-0.3,)),
    ("heading", "sideways_cos", (1.0, 2.0), (0.05, 0.02)),
)
"""Groups that remember, and one that looks at the heading."""
