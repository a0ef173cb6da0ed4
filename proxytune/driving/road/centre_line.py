"""The road's centre line: its nearest point to a position, and how far round the map a point of it lies."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from proxytune.driving.road.layout import Layout

Values = NDArray[np.float64]
Numbers = NDArray[np.intp]

BEYOND = 1e-12
"""A point beyond a section's end counts as so much farther away [m]: rounding must not take it for the next one's."""


class Nearest(NamedTuple):
    """The nearest points of the centre line, each field of shape (…).

    Attributes:
        section: Number of the section it lies on.
        straight: How far from the origin it lies in the direction of the section's straight [m].
        turned: How much of the section's bend lies behind it [rad].
        normal: Direction away from the section's pivot there [rad].
        outside: Signed distance from the centre line, away from the pivot positive [m].
    """

    section: Numbers
    straight: Values
    turned: Values
    normal: Values
    outside: Values


def find_nearest(layout: Layout, positions: Values) -> Nearest:
    """Find the centre line's nearest points.

    Args:
        layout: Of the road.
        positions: x and y [m], shape (…, 2).
    """
    places = np.asarray(positions, dtype=float) - layout.origin
    section = _nearest_section(layout, places)
    view = _view(layout, section, places)
    away = view.out[..., None] * layout.across[section] + view.past[..., None] * layout.along[section]
    direction = np.mod(np.arctan2(away[..., 1], away[..., 0]), 2.0 * np.pi)
    normal = np.where(view.in_bend, direction, layout.normal[section])
    turned = layout.side[section] * (normal - layout.normal[section])
    turned -= 2.0 * np.pi * np.rint(turned / (2.0 * np.pi))
    return Nearest(section, view.straight, turned, normal, view.outside)


def way_round(layout: Layout, section: Numbers, straight: Values, turned: Values, offset: Values) -> Values:
    """How far round the map a point of a line beside the centre line lies, counter-clockwise [m].

    Args:
        layout: Of the road.
        section: Number of the section it lies on.
        straight: How far from the origin it lies in the direction of the section's straight [m].
        turned: How much of the section's bend lies behind it [rad].
        offset: How far right of the centre line that line is [m].
    """
    edges = layout.straights[section] + straight - layout.first[section]
    others = layout.other_arcs[section] + offset * layout.other_turns[section]
    return edges + others + bend_radius(layout, section, offset) * (layout.turned[section] + turned)


def bend_radius(layout: Layout, section: Numbers, offset: Values) -> Values:
    """Radius of a section's bend on a line so far right of the centre line [m]."""
    return layout.radius[section] + layout.side[section] * offset


class _View(NamedTuple):
    """Places as seen from a section's pivot, each field of shape (…).

    Attributes:
        out: How far they are from the pivot across the straight [m].
        straight: How far from the origin the straight's nearest point lies in its direction [m].
        past: How far they are ahead of that point in the same direction [m].
        in_bend: Whether the bend is nearer than the straight.
        outside: Signed distance from the section gone on with past its ends, away from the pivot positive [m].
    """

    out: Values
    straight: Values
    past: Values
    in_bend: NDArray[np.bool_]
    outside: Values


def _view(layout: Layout, section: Numbers, places: Values) -> _View:
    """See places (…, 2), relative to the origin [m], from one section each or from all."""
    x, y = places[..., 0], places[..., 1]
    across, along = layout.across[section], layout.along[section]
    out = x * across[..., 0] + y * across[..., 1] - layout.pivot[section]
    way = x * along[..., 0] + y * along[..., 1]
    straight = np.minimum(np.maximum(way, layout.first[section]), layout.last[section])
    past = way - straight
    in_bend = (past > 0.0) & (layout.turn[section] > 0.0)
    outside = np.where(in_bend, np.hypot(out, past), out) - layout.radius[section]
    return _View(out, straight, past, in_bend, outside)


def _nearest_section(layout: Layout, places: Values) -> Numbers:
    """Number of the nearest section; among equally near ones the one whose straight runs most north and south."""
    order = np.argsort(-np.abs(layout.across[:, 0]), kind="stable")
    view = _view(layout, order, places[..., None, :])
    over = np.maximum(np.arctan2(view.past, view.out) - layout.turn[order], 0.0)
    beyond = np.where(view.in_bend, layout.radius[order] * over, np.abs(view.past))
    distance = np.abs(view.outside) + beyond + BEYOND * (beyond > 0.0)
    return np.asarray(order[np.argmin(distance, axis=-1)])
