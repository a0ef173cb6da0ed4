"""The box that is searched for learning value: centre and width of each parameter's distribution p(θ)."""

from collections.abc import Mapping

from proxytune.learning.lessons import Distribution
from proxytune.space import Interval, Space, Theta
from proxytune.study.settings import StudySettings
from proxytune.teaching.points import TeachingSetup

WIDTH = " width"
"""What the width of a parameter's distribution is called, after the parameter."""

ROUNDING = 1e-9
"""Share of a box by which a width may be larger."""

SLACK = 1.0 / 30.0
"""A parameter that PRPV has pinned down is still searched over this share of its box, to both sides."""


def search_space(
    settings: StudySettings, widths: Mapping[str, tuple[float, float]], left: Mapping[str, tuple[float, float]]
) -> Space:
    """The box that is searched for PLV: centres where PRPV cannot tell θ from the best, and widths as asked for.

    Args:
        settings: Of the study.
        widths: Bounds of the width of each parameter's distribution, by parameter.
        left: The ends of what PRPV cannot tell from the best, by parameter; empty where the box is not narrowed.

    Raises:
        SettingsError: If a width is of a parameter that is not searched, or wider than its box.
    """
    for name, (_, widest) in widths.items():
        _check_width(settings, name, widest)
    centres = [_narrowed(box, left.get(box.name)) for box in settings.space.intervals]
    return Space((*centres, *(Interval(name + WIDTH, *bounds) for name, bounds in sorted(widths.items()))))


def _check_width(settings: StudySettings, name: str, widest: float) -> None:
    key = f"teaching.width.{name}"
    box = next((box for box in settings.space.intervals if box.name == name), None)
    if box is None:
        raise settings.error(key, "is not among [parameters]; add it there, or take this out")
    whole = box.high - box.low
    # 0.3 − 0.1 is a little less than 0.2.
    if widest > whole * (1.0 + ROUNDING):
        raise settings.error(key, f"must be at most {whole:g}, all of its box in [parameters], got {widest:g}")


def _narrowed(box: Interval, left: tuple[float, float] | None) -> Interval:
    if left is None:
        return box
    step = SLACK * (box.high - box.low)
    slack = step if left[1] - left[0] < step else 0.0
    return Interval(box.name, max(box.low, left[0] - slack), min(box.high, left[1] + slack), box.unit)


def distribution(setup: TeachingSetup, theta: Theta) -> Distribution:
    """p(θ) with these centres and widths, cut off at what each parameter can be."""
    bounds = {}
    for name, centre in theta.items():
        if not name.endswith(WIDTH):
            half, known = theta.get(name + WIDTH, 0.0) / 2.0, setup.proxy.parameters[name]
            bounds[name] = (max(known.low, centre - half), min(known.high, centre + half))
    return Distribution(bounds)
