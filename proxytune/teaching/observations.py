"""The paper's two observations, held against a learning experiment: what zero-shot scores and PRPV tell of PLV."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from proxytune.learning.settings import NONE
from proxytune.scores import Array
from proxytune.teaching.agreement import Agreement, agreement
from proxytune.teaching.experiment import Experiment, TeacherResult
from proxytune.teaching.predictivity import Predictivity


@dataclass(frozen=True)
class Observations:
    """What a learning experiment says of the paper's two observations.

    Attributes:
        zero_shot: Whether proxies rank by zero-shot score (first) as they do by PLV (second).
        prpv: Whether they rank by PRPV, low first, as they do by PLV; None without intervals of PRPV.
        poor_predictors: Proxies that save samples though their PRPV is such as chance gives.
    """

    zero_shot: Agreement
    prpv: Agreement | None
    poor_predictors: tuple[str, ...]


def observe(experiment: Experiment, prpv: Mapping[str, Predictivity | None]) -> Observations | None:
    """Hold the two observations against an experiment; None where PLV is unknown or there is nothing to rank.

    Args:
        experiment: With the posterior of its learning curves.
        prpv: How well each proxy predicts, by name.
    """
    names = [teacher.name for teacher in experiment.teachers]
    if not experiment.settled or len(names) < 2:
        return None
    needs = experiment.needs
    starts = np.column_stack([needs.draws.scores[name][:, 0] for name in names])
    resampled = {name: one.resampled for name in names if (one := prpv.get(name)) and one.resampled is not None}
    ranked = [name for name in names if name in resampled]
    by_prpv = agreement(ranked, -_side_by_side(ranked, resampled), _plv(experiment, ranked)) if ranked[1:] else None
    return Observations(
        zero_shot=agreement(names, starts, _plv(experiment, names)),
        prpv=by_prpv,
        poor_predictors=tuple(one.name for one in experiment.teachers if _saves(one) and _by_chance(prpv, one.name)),
    )


def _plv(experiment: Experiment, names: Sequence[str]) -> Array:
    """PLV of each proxy in every draw (draws, proxies); what is not reached is the worst there is."""
    needed = experiment.needs.needed
    alone = np.minimum(needed[NONE], experiment.needs.last)
    return np.column_stack([alone - needed[name] for name in names])


def _side_by_side(names: Sequence[str], resampled: Mapping[str, Array]) -> Array:
    return np.column_stack([resampled[name] for name in names])


def _saves(teacher: TeacherResult) -> bool:
    return teacher.worth is not None and teacher.worth.plv.low is not None and teacher.worth.plv.low > 0.0


def _by_chance(prpv: Mapping[str, Predictivity | None], name: str) -> bool:
    known = prpv.get(name)
    return known is not None and known.chance.explains
