"""Probes close together, for effects that no slope leads to, steps and places; tried on a part of the drives."""

from collections.abc import Iterable, Sequence
from dataclasses import replace
from itertools import product
from typing import NamedTuple

import numpy as np

from proxytune.diagnosis.measured.drives import Drives, Floats
from proxytune.diagnosis.model.coordinates import span, theta_at
from proxytune.diagnosis.model.fitting import Fit, evaluate
from proxytune.diagnosis.model.innovations import HUBER, clip_outliers
from proxytune.diagnosis.model.replay import increments
from proxytune.diagnosis.naming.candidates import Candidate
from proxytune.driving.robot import Robot

SIZES = 240
"""So many sizes of a step are tried: the loss over a step of the command is a spike 2 % wide."""

SMALLEST_SHARE = 0.02
"""The smallest of them, as a share of the largest."""

PART_S, STRETCH_S, WARM_UP_S = 60.0, 8.0, 2.0
"""They are tried on so much driving, in stretches of this length; the warm-up of each is not compared."""

CELL_M = 0.3
RADII_M = (0.4, 1.0)
"""Places lie so far apart, and patches of these radii are tried round each."""

MOST_PLACES = 40

FURTHEST = 1.5
"""A step may go so many times as far as its probe."""

Values = tuple[float, ...]


def with_dense_probes(base: Fit, forms: Sequence[Candidate]) -> list[Candidate]:
    """The forms, those of stepwise effects and of effects of a place with the best of many more probes."""
    dense = [form for form in forms if not form.form and _dense_along(form, base.drives.robot) is not None]
    if not dense:
        return list(forms)
    part = cut_part(base.drives)
    left = _residual_of(evaluate(part, base.theta, base.free, base.noise))
    best = {form.effect: _best_probe(left, form) for form in dense}
    return [replace(form, probes=(*form.probes, *best.get(form.effect, ()))) for form in forms]


def _dense_along(form: Candidate, robot: Robot) -> str | None:
    """What further probes of an effect lie along: its `steps`, or its `place`; None where it needs none."""
    trace = robot.catalogue.effect(form.effect).trace
    if trace is None:
        return None
    return "steps" if trace.stepwise else "place" if trace.placed else None


class _Residual(NamedTuple):
    """A model, its increments, which of its innovations count, and how its free parameters answer columns."""

    model: Fit
    predicted: Floats
    weight: Floats
    answer: Floats


def _residual_of(model: Fit) -> _Residual:
    weight = (np.abs(model.innovations) < HUBER).astype(float)
    weighted = model.slopes * weight[:, None]
    answer = np.linalg.pinv(model.slopes.T @ weighted, hermitian=True) @ weighted.T
    return _Residual(model, increments(model.drives, model.theta), weight, answer)


def _best_probe(left: _Residual, form: Candidate) -> tuple[Values, ...]:
    """The probe that gains most, none where none gains anything."""
    robot = left.model.drives.robot
    steps = _dense_along(form, robot) == "steps"
    offers = list(_sizes(form, robot) if steps else _places(left.model.drives, form))
    gains = [_gain(left, form, values) for values in offers]
    return (offers[int(np.argmax(gains))],) if gains and max(gains) > 0.0 else ()


def _sizes(form: Candidate, robot: Robot) -> Iterable[Values]:
    """Sizes of a step, its other coordinates where the model has them."""
    high = span(form.free[0], robot)[1]
    for size in np.geomspace(SMALLEST_SHARE * high, high, SIZES).tolist():
        yield (size, *form.neutral[1:])


def _places(drives: Drives, form: Candidate) -> Iterable[Values]:
    """Patches round places that were driven through, their first coordinate at its middle probe."""
    cells = np.round(drives.poses[:, 0, :2] / CELL_M)
    found, often = np.unique(cells, axis=0, return_counts=True)
    places = found[np.argsort(-often, kind="stable")[:MOST_PLACES]] * CELL_M
    size = form.probes[len(form.probes) // 2][0]
    for (x, y), radius in product(places.tolist(), RADII_M):
        yield (size, x, y, radius)


def _gain(left: _Residual, form: Candidate, values: Values) -> float:
    """What one step towards a probe gains, the free parameters having done what they can [nats]."""
    model = left.model
    theta = theta_at({**model.theta, **form.fixed}, form.free, np.array(values))
    column = model.whiten.whiten(left.predicted - increments(model.drives, theta))
    column = column - model.slopes @ (left.answer @ column)
    pull, size = float(column @ clip_outliers(model.innovations)), float(column**2 @ left.weight)
    step = min(max(-pull / size, 0.0), FURTHEST) if size > 1e-9 else 0.0
    return -step * pull - 0.5 * step**2 * size


def cut_part(drives: Drives) -> Drives:
    """Cut stretches out of drives, evenly spread, each an episode that goes on from the commands before it."""
    ticks, warm = round(STRETCH_S * drives.tick_hz), round(WARM_UP_S * drives.tick_hz)
    every = max(ticks, round(ticks * drives.seconds / PART_S))
    length = drives.duties.shape[1]
    begin = np.arange(0, max(1, length - ticks + 1), every)
    episode, start = (grid.ravel() for grid in np.meshgrid(np.arange(len(drives.duties)), begin, indexing="ij"))
    number = drives.episode * len(begin) + np.minimum(drives.first // every, len(begin) - 1)
    first, last = drives.first - start[number], drives.last - start[number]
    inside = (first >= np.where(start[number] > 0, warm, 0)) & (last <= ticks)
    kept, chosen = drives.only(inside), np.flatnonzero(inside)
    at = start[:, None] + np.arange(ticks)
    rows = episode[:, None], np.minimum(at, length - 1)
    before = drives.duties[episode, np.maximum(start - 1, 0)]
    return replace(
        kept,
        duties=drives.duties[rows],
        rest=np.where(start[:, None] > 0, before, drives.rest[episode]),
        headings=drives.headings[rows],
        episode=number[chosen],
        first=first[chosen],
        last=last[chosen],
        linked=kept.linked & np.concatenate(([False], np.diff(number[chosen]) == 0)),
        wheels=None if drives.wheels is None else drives.wheels[rows],
    )
