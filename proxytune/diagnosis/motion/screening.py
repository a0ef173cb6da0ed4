"""The score test of every candidate effect on the whitened innovations of a model.

Candidates are all motion effects of a catalogue in the forms they can take (`candidates`), each with a few probes;
effects that no slope leads to, steps and places, get the best of many more (`with_dense_probes`). With z the
innovations, ψ Huber's clipped z, w the weight of those that are no outliers, and D the change of z along a form's
coordinates with all that the free parameters can do projected out,

    gradient  g = Dᵀψ,    Hessian  H = Dᵀ(w·D),    step  m = −H⁺g,    gain = −(gᵀm + ½ mᵀHm)  [nats],

one Gauss–Newton step from each probe. Its null distribution flips the signs of z in stretches of a second and takes the
largest gain of all candidates, so that the p-value allows for having looked at many.
"""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product, repeat
from typing import NamedTuple

import numpy as np

from proxytune.diagnosis.motion.drives import Drives, Floats, Whole, sum_by
from proxytune.diagnosis.motion.fitting import Fit, evaluate, held_out_log_likelihood
from proxytune.diagnosis.motion.innovations import (
    HUBER,
    RANDOM_EFFECTS,
    Coordinate,
    clip_outliers,
    increments,
    span,
    theta_at,
)
from proxytune.driving import Robot
from proxytune.effects import DRIVES, Catalogue, Effect, Form, theta_names
from proxytune.space import Parameter, Theta

MOTION_EFFECTS = tuple(
    dict.fromkeys(name for effects in DRIVES.values() for name, effect in effects.items() if effect.trace)
)
"""The shipped effects that measured motion can show, of robots of any drive."""


def motion_effects(catalogue: Catalogue) -> tuple[str, ...]:
    """The effects of a catalogue that measured motion can show."""
    return tuple(name for name in catalogue.names if catalogue.effect(name).trace)


@dataclass(frozen=True)
class Candidate:
    """One form of an effect: what is free in it, what is fixed, where the model has it, and where a search starts."""

    effect: str
    form: str
    free: tuple[Coordinate, ...]
    fixed: Mapping[str, float]
    neutral: tuple[float, ...]
    probes: tuple[tuple[float, ...], ...]

    @property
    def label(self) -> str:
        """The name that people read: `dead_band (left wheel)`."""
        return f"{self.effect} ({self.form})" if self.form else self.effect

    @property
    def middle_probe(self) -> tuple[float, ...]:
        """The probe in the middle, a usual size of the effect."""
        return self.probes[len(self.probes) // 2]

    def theta_at(self, theta: Theta, values: Sequence[float] | Floats) -> dict[str, float]:
        """A model's θ with the effect in this form, its coordinates at these values."""
        return theta_at({**theta, **self.fixed}, self.free, values)


def candidates(robot: Robot, theta: Theta, taken: Iterable[str]) -> tuple[Candidate, ...]:
    """List every form of every deterministic motion effect that is not taken, from where θ has it."""
    left_out = {*taken, *RANDOM_EFFECTS}
    names = (name for name in motion_effects(robot.catalogue) if name not in left_out)
    return tuple(form for name in names for form in _forms(name, robot, theta))


def _forms(effect: str, robot: Robot, theta: Theta) -> list[Candidate]:
    """The forms of an effect: with every parameter free, unless it says otherwise."""
    kind = robot.catalogue.effect(effect)
    known = {
        parameter.name: theta.get(name, parameter.neutral_value(robot.figures))
        for name, parameter in zip(theta_names(kind, effect), kind.parameters, strict=True)
    }
    present = known[kind.parameters[0].name] != kind.parameters[0].neutral
    stated = kind.trace.forms if kind.trace else ()
    forms = stated or (Form(tuple((parameter.name,) for parameter in kind.parameters)),)
    return [_candidate(effect, kind, form, known) for form in forms if form.present in (None, present)]


def _candidate(effect: str, kind: type[Effect], form: Form, known: Mapping[str, float]) -> Candidate:
    names = {parameter.name: name for parameter, name in zip(kind.parameters, theta_names(kind, effect), strict=True)}
    parameters = {parameter.name: parameter for parameter in kind.parameters}
    held = {name for coordinate in form.free for name in coordinate}
    tried = [
        [value for value in parameters[first].probes if not math.isclose(value, known[first], abs_tol=1e-9)]
        if first in form.moved or not form.moved
        else repeat(known[first])
        for first, *_ in form.free
    ]
    return Candidate(
        effect=effect,
        form=form.name,
        free=tuple(tuple(names[name] for name in coordinate) for coordinate in form.free),
        fixed={names[name]: form.fixed.get(name, value) for name, value in known.items() if name not in held},
        neutral=tuple(known[first] for first, *_ in form.free),
        probes=tuple(zip(*tried, strict=False)),
    )


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

LARGEST_STEP = 1.5
"""A step may go so many times as far as its probe."""


def with_dense_probes(base: Fit, forms: Sequence[Candidate]) -> list[Candidate]:
    """The forms, those of stepwise effects and of effects of a place with the best of many more probes."""
    catalogue = base.drives.robot.catalogue
    plain = [(form, catalogue.effect(form.effect).trace) for form in forms if not form.form]
    dense = [(form, trace) for form, trace in plain if trace and (trace.stepwise or trace.placed)]
    if not dense:
        return list(forms)
    part = evaluate(cut_part(base.drives), base.theta, base.free, base.noise)
    predicted, best = increments(part.drives, part.theta), dict[str, tuple[tuple[float, ...], ...]]()
    weight = (np.abs(part.innovations) < HUBER).astype(float)
    weighted = part.slopes * weight[:, None]
    answer = np.linalg.pinv(part.slopes.T @ weighted, hermitian=True) @ weighted.T
    for form, trace in dense:
        if trace.stepwise:
            high = span(form.free[0], part.drives)[1]
            sizes = np.geomspace(SMALLEST_SHARE * high, high, SIZES).tolist()
            offers = [(size, *form.neutral[1:]) for size in sizes]
        else:
            offers = _places(part.drives, form)
        gains = []
        for values in offers:
            theta = form.theta_at(part.theta, values)
            column = part.whiten.whiten(predicted - increments(part.drives, theta))
            column = column - part.slopes @ (answer @ column)
            gradient, hessian = float(column @ clip_outliers(part.innovations)), float(column**2 @ weight)
            step = min(max(-gradient / hessian, 0.0), LARGEST_STEP) if hessian > 1e-9 else 0.0
            gains.append(-step * gradient - 0.5 * step**2 * hessian)
        best[form.effect] = (offers[int(np.argmax(gains))],) if gains and max(gains) > 0.0 else ()
    return [replace(form, probes=(*form.probes, *best.get(form.effect, ()))) for form in forms]


def _places(drives: Drives, form: Candidate) -> list[tuple[float, ...]]:
    """Patches round places that were driven through, their first coordinate at its middle probe."""
    found, often = np.unique(np.round(drives.poses[:, 0, :2] / CELL_M), axis=0, return_counts=True)
    places = found[np.argsort(-often, kind="stable")[:MOST_PLACES]] * CELL_M
    size = form.middle_probe[0]
    return [(size, x, y, radius) for (x, y), radius in product(places.tolist(), RADII_M)]


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


FLIPS = 499
"""How often the null distribution is drawn."""
FLIP_S = 1.0
"""Innovations keep their sign together for so long: longer than their correlation."""
FURTHEST = 2.0
"""A step may go so many times as far as its probe."""


class ScreenedCandidate(NamedTuple):
    """A candidate with its score test."""

    candidate: Candidate
    start: tuple[float, ...]  # its coordinates after the step
    probe: tuple[float, ...]  # what the step set out for
    gain: float  # in log-likelihood [nats]
    held_out: float  # the same on blocks that were not fitted
    p_value: float  # how often chance gains as much with any form of any effect
    column: Floats  # direction in the innovations that it explains (3N,)


_Probe = tuple[Candidate, tuple[float, ...], tuple[float, ...], Floats]
"""A form, where one of its probes sets out from and goes to, and the innovations' change along each coordinate."""


def screen(base: Fit, forms: Sequence[Candidate], seed: int) -> list[ScreenedCandidate]:
    """Screen candidates: one for every form that changes anything in these drives, by its best probe, best first."""
    probes = [probe for form in with_dense_probes(base, forms) for probe in _probes(base, form)]
    if not probes:
        return []
    weight, clipped = np.abs(base.innovations) < HUBER, clip_outliers(base.innovations)[:, None]
    projected = [project_out(base.slopes, columns, weight) for *_, columns in probes]
    stretch = number_stretches(base.drives)
    count = int(stretch.max()) + 1
    flips = np.random.default_rng(seed).choice((-1.0, 1.0), size=(FLIPS, count))
    best: dict[str, tuple[float, Floats, _Probe, Floats]] = {}
    chance = np.zeros(FLIPS)
    for probe, columns in zip(probes, projected, strict=True):
        gradients = sum_by(stretch, (columns * clipped).reshape(len(stretch), 3, -1).sum(axis=1), count)
        hessian = columns.T @ (columns * weight[:, None])
        gain, step = _step(gradients.sum(axis=0), hessian)
        chance = np.maximum(chance, _gains(flips @ gradients, hessian))
        label = probe[0].label
        if label not in best or gain > best[label][0]:
            best[label] = (gain, step, probe, columns)
    plain = float(held_out_log_likelihood(base).sum())
    found = []
    for gain, step, (form, begin, values, _), columns in best.values():
        slopes = np.concatenate((base.slopes, columns), axis=1) if step.any() else base.slopes
        stepped = replace(base, innovations=base.innovations + columns @ step, slopes=slopes)
        p_value = float((1 + (chance >= gain).sum()) / (1 + FLIPS))
        held_out = float(held_out_log_likelihood(stepped).sum()) - plain
        start = tuple(float(one + m * (value - one)) for one, value, m in zip(begin, values, step, strict=True))
        found.append(ScreenedCandidate(form, start, values, gain, held_out, p_value, columns @ step))
    return sorted(found, key=lambda one: -one.gain)


def _probes(base: Fit, form: Candidate) -> list[_Probe]:
    here = increments(base.drives, base.theta)
    found = []
    for values in form.probes:
        begin = _begin(form, values, base.drives.robot.catalogue.parameters)
        moved = [form.theta_at(base.theta, (*begin[:j], v, *begin[j + 1 :])) for j, v in enumerate(values)]
        columns = np.stack([here - increments(base.drives, theta) for theta in moved], -1)
        if np.abs(columns).max() > 1e-9:
            found.append((form, begin, values, base.whiten.whiten(columns)))
    return found


def _begin(form: Candidate, values: tuple[float, ...], parameters: Mapping[str, Parameter]) -> tuple[float, ...]:
    """The model's values of a form's coordinates; what shapes an effect that is still to come may be at its probe."""
    if values[0] == form.neutral[0]:
        return form.neutral
    pairs = zip(form.free, values, form.neutral, strict=True)
    return tuple(value if parameters[first].shape else neutral for (first, *_), value, neutral in pairs)


def project_out(slopes: Floats, columns: Floats, weight: Floats) -> Floats:
    """Project out of columns everything that the free parameters can do."""
    if slopes.shape[1] == 0:
        return columns
    weighted = slopes * weight[:, None]
    inverse = np.linalg.pinv(slopes.T @ weighted, hermitian=True)
    return np.asarray(columns - slopes @ (inverse @ (weighted.T @ columns)))


def number_stretches(drives: Drives) -> Whole:
    """Number the stretches of FLIP_S that the increments are in (N,)."""
    second = np.floor(drives.first / drives.tick_hz / FLIP_S).astype(int)
    _, number = np.unique(drives.episode * (second.max() + 1) + second, return_inverse=True)
    return number


def _step(gradient: Floats, hessian: Floats) -> tuple[float, Floats]:
    """The gain of the best step along the columns, and the step: forwards only where one column moves anything."""
    best = -np.linalg.pinv(hessian, hermitian=True) @ gradient
    if np.count_nonzero(hessian.diagonal()) == 1:
        best = np.clip(best, 0.0, FURTHEST)
    return float(-(gradient @ best + 0.5 * best @ hessian @ best)), best


def _gains(gradients: Floats, hessian: Floats) -> Floats:
    """Gains of many gradients (draws, columns)."""
    best = -gradients @ np.linalg.pinv(hessian, hermitian=True)
    if np.count_nonzero(hessian.diagonal()) == 1:
        best = np.clip(best, 0.0, FURTHEST)
    return np.asarray(-((gradients * best).sum(axis=1) + 0.5 * np.einsum("ni,ij,nj->n", best, hessian, best)))
