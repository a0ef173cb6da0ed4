"""Which effects could explain what is left: one step from every probe value, and what chance would make of it."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from proxytune.diagnosis.measured.drives import Drives, Floats, Whole, sum_by
from proxytune.diagnosis.model.coordinates import theta_at
from proxytune.diagnosis.model.fitting import Fit, held_out_log_likelihood
from proxytune.diagnosis.model.innovations import HUBER, clip_outliers
from proxytune.diagnosis.model.replay import increments
from proxytune.diagnosis.naming.candidates import Candidate
from proxytune.diagnosis.naming.dense import with_dense_probes
from proxytune.space import Parameter

FLIPS = 499
"""How often the null distribution is drawn."""

FLIP_S = 1.0
"""Innovations keep their sign together for so long: longer than their correlation."""

FURTHEST = 2.0
"""A step may go so many times as far as its probe."""


class Lead(NamedTuple):
    """A form of an effect worth fitting.

    Attributes:
        candidate: The form.
        start: Values of its coordinates to start from.
        probe: The probe that the step set out for.
        gain: What one step gains in log-likelihood [nats].
        held_out: What it gains on blocks that it was not fitted to [nats].
        p_value: How often chance gains as much with any form of any effect.
        column: The direction in the innovations that it explains, declared parameters projected out (3N,).
    """

    candidate: Candidate
    start: tuple[float, ...]
    probe: tuple[float, ...]
    gain: float
    held_out: float
    p_value: float
    column: Floats


@dataclass(frozen=True)
class _Probe:
    """One probe of one form: where it sets out from, and the change of the innovations along each coordinate."""

    candidate: Candidate
    begin: tuple[float, ...]
    values: tuple[float, ...]
    columns: Floats


def screen(base: Fit, forms: Sequence[Candidate], seed: int) -> list[Lead]:
    """The leads, best first, one for every form that changes anything in these drives."""
    probes = [probe for form in with_dense_probes(base, forms) for probe in _probes(base, form)]
    if not probes:
        return []
    weight = np.abs(base.innovations) < HUBER
    projected = [project_out(base.slopes, probe.columns, weight) for probe in probes]
    number = number_stretches(base.drives)
    flips = _signs(int(number.max()) + 1, seed)
    best: dict[str, tuple[float, Floats, _Probe, Floats]] = {}
    chance = np.zeros(FLIPS)
    for probe, columns in zip(probes, projected, strict=True):
        pulls = _by_stretch(number, columns * clip_outliers(base.innovations)[:, None])
        curve = columns.T @ (columns * weight[:, None])
        gain, step = _step(pulls.sum(axis=0), curve)
        chance = np.maximum(chance, _gains(flips @ pulls, curve))
        old = best.get(probe.candidate.label)
        if old is None or gain > old[0]:
            best[probe.candidate.label] = (gain, step, probe, columns)
    plain = float(held_out_log_likelihood(base).sum())
    leads = [_lead(base, *found, chance, plain) for found in best.values()]
    return sorted(leads, key=lambda lead: -lead.gain)


def _lead(base: Fit, gain: float, step: Floats, probe: _Probe, columns: Floats, *null: Any) -> Lead:
    chance, plain = null
    stepped = replace(
        base,
        innovations=base.innovations + columns @ step,
        slopes=np.concatenate((base.slopes, columns), axis=1) if step.any() else base.slopes,
    )
    p_value = float((1 + (chance >= gain).sum()) / (1 + FLIPS))
    held_out = float(held_out_log_likelihood(stepped).sum()) - plain
    return Lead(probe.candidate, _values_after(probe, step), probe.values, gain, held_out, p_value, columns @ step)


def _probes(base: Fit, form: Candidate) -> list[_Probe]:
    start = {**base.theta, **form.fixed}
    here = increments(base.drives, base.theta)
    found = []
    for values in form.probes:
        begin = _begin(form, values, base.drives.robot.catalogue.parameters)
        moved = [theta_at(start, form.free, np.array((*begin[:j], v, *begin[j + 1 :]))) for j, v in enumerate(values)]
        columns = np.stack([here - increments(base.drives, theta) for theta in moved], -1)
        if np.abs(columns).max() > 1e-9:
            found.append(_Probe(form, begin, values, base.whiten.whiten(columns)))
    return found


def _begin(form: Candidate, values: tuple[float, ...], parameters: Mapping[str, Parameter]) -> tuple[float, ...]:
    """Where the model has a form's coordinates; what shapes an effect that is still to come may be at its probe."""
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


def _by_stretch(number: Whole, values: Floats) -> Floats:
    return sum_by(number, values.reshape(len(number), 3, -1).sum(axis=1), int(number.max()) + 1)


def _signs(count: int, seed: int) -> Floats:
    return np.random.default_rng(seed).choice((-1.0, 1.0), size=(FLIPS, count))


def _step(pull: Floats, curve: Floats) -> tuple[float, Floats]:
    """The gain of the best step along the columns, and the step: forwards only where one column moves anything."""
    best = -np.linalg.pinv(curve, hermitian=True) @ pull
    if np.count_nonzero(curve.diagonal()) == 1:
        best = np.clip(best, 0.0, FURTHEST)
    return float(-(pull @ best + 0.5 * best @ curve @ best)), best


def _gains(pulls: Floats, curve: Floats) -> Floats:
    """The same gain for many pulls (draws, columns)."""
    best = -pulls @ np.linalg.pinv(curve, hermitian=True)
    if np.count_nonzero(curve.diagonal()) == 1:
        best = np.clip(best, 0.0, FURTHEST)
    return np.asarray(-((pulls * best).sum(axis=1) + 0.5 * np.einsum("ni,ij,nj->n", best, curve, best)))


def _values_after(probe: _Probe, step: Floats) -> tuple[float, ...]:
    """The values at which a step ends; to a probe is one step."""
    pairs = zip(probe.begin, probe.values, step, strict=True)
    return tuple(float(begin + m * (value - begin)) for begin, value, m in pairs)
