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
        zero_shot: Whether proxies rank by zero-shot score (first) as they do by PLV (second); None of a single one.
        prpv: Whether they rank by PRPV, low first, as they do by PLV; None without intervals of PRPV.
        poor_predictors: Proxies that save samples though their PRPV is such as chance gives.
    """

    zero_shot: Agreement | None
    prpv: Agreement | None
    poor_predictors: tuple[str, ...]


def observe(experiment: Experiment, prpv: Mapping[str, Predictivity | None]) -> Observations | None:
    """Hold the two observations against an experiment; None where PLV is unknown.

    Args:
        experiment: With the posterior of its learning curves.
        prpv: How well each proxy predicts, by name.
    """
    names = [teacher.name for teacher in experiment.teachers]
    if not experiment.settled:
        return None
    starts = {name: experiment.needs.draws.scores[name][:, 0] for name in names}
    lowest = {name: -one.resampled for name in names if (one := prpv.get(name)) and one.resampled is not None}
    return Observations(
        zero_shot=_agreement(experiment, starts),
        prpv=_agreement(experiment, lowest),
        poor_predictors=tuple(one.name for one in experiment.teachers if _saves(one) and _by_chance(prpv, one.name)),
    )


def _agreement(experiment: Experiment, figures: Mapping[str, Array]) -> Agreement | None:
    """How proxies rank by a figure of which more is better, its draws by name, and by PLV; None of fewer than two."""
    names = list(figures)
    if len(names) < 2:
        return None
    return agreement(names, np.column_stack(list(figures.values())), _plv(experiment, names))


def _plv(experiment: Experiment, names: Sequence[str]) -> Array:
    """PLV of each proxy in every draw (draws, proxies); what is not reached is the worst there is."""
    needed = experiment.needs.needed
    alone = np.minimum(needed[NONE], experiment.needs.last)
    return np.column_stack([alone - needed[name] for name in names])


def _saves(teacher: TeacherResult) -> bool:
    return teacher.worth is not None and teacher.worth.plv.above_zero


def _by_chance(prpv: Mapping[str, Predictivity | None], name: str) -> bool:
    known = prpv.get(name)
    return known is not None and known.chance.explains
