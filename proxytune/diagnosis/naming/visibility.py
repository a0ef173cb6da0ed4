"""The effects that these drives could not have shown: their usual sizes leave too little trace."""

import numpy as np

from proxytune.diagnosis.measured.drives import Floats
from proxytune.diagnosis.model.coordinates import theta_at
from proxytune.diagnosis.model.events import responses
from proxytune.diagnosis.model.fitting import Fit
from proxytune.diagnosis.model.replay import RANDOM_EFFECTS, increments
from proxytune.diagnosis.naming.candidates import Candidate, candidates, motion_effects
from proxytune.diagnosis.naming.screening import project_out
from proxytune.diagnosis.rules import RULES


def invisible_effects(model: Fit, taken: set[str]) -> tuple[str, ...]:
    """The motion effects that would have left too few nats to be seen at the middle of their probes."""
    forms = candidates(model.drives.robot, model.theta, taken)
    best: dict[str, float] = {}
    plain = {form.effect for form in forms if not form.form}
    for form in (form for form in forms if not form.form or form.effect not in plain):
        best[form.effect] = max(best.get(form.effect, 0.0), _nats_of_trace(model, form))
    strike = RULES.struck_share * float(responses(model, np.empty((len(model.innovations), 0))).size.sum()) / 2.0
    best |= {name: strike for name in RANDOM_EFFECTS if name not in taken}
    return tuple(
        name
        for name in motion_effects(model.drives.robot.catalogue)
        if name not in taken and best.get(name, 0.0) < RULES.visible_nats
    )


def _nats_of_trace(model: Fit, form: Candidate) -> float:
    """Nats that the middle probe would have changed, free parameters having done what they can."""
    if not form.probes:
        return 0.0
    direction = trace_of(model, form, form.probes[len(form.probes) // 2])
    return 0.5 * float(direction @ direction)


def trace_of(model: Fit, form: Candidate, values: tuple[float, ...]) -> Floats:
    """What a form of an effect does to the innovations that the free parameters cannot (3N,)."""
    moved = theta_at({**model.theta, **form.fixed}, form.free, np.array(values))
    change = increments(model.drives, model.theta) - increments(model.drives, moved)
    column = model.whiten.whiten(change)[:, None]
    return project_out(model.slopes, column, np.ones(len(column)))[:, 0]
