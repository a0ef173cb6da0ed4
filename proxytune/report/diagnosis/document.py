"""A diagnosis of motion as one JSON document, and as tables for people."""

from collections.abc import Mapping
from typing import Any

from rich.console import Group
from rich.table import Table
from rich.text import Text

from proxytune.diagnosis import AdoptedEffect, Diagnosis, EffectSize, Estimate, HorizonError, Ratio, main_error
from proxytune.effects import Catalogue
from proxytune.report.diagnosis.clocks import clocks_document
from proxytune.report.diagnosis.learnt import learnt_document, ratio_document, ratios_document
from proxytune.report.diagnosis.likeness import unlike_document
from proxytune.report.diagnosis.notes import decisive, headline, may_matter, notes, per_cent
from proxytune.report.diagnosis.tables import parameters_table, plain_table


def document(diagnosis: Diagnosis) -> dict[str, Any]:
    """Everything that `diagnose --json` prints."""
    return {
        "log": diagnosis.log,
        "robot": diagnosis.robot.name,
        "verdict": diagnosis.verdict,
        "declared": {name: _estimate(estimate) for name, estimate in diagnosis.declared.items()},
        "effects": [_added_document(effect, diagnosis) for effect in diagnosis.effects],
        "immaterial": [_immaterial_document(effect, diagnosis) for effect in diagnosis.negligible],
        "extended": {name: _estimate(estimate) for name, estimate in diagnosis.theta.items()},
        "candidates": [
            {"name": tried.effect, "form": tried.form, "held_out_gain": tried.gain, "p_value": tried.p_value}
            for tried in diagnosis.found.tried
        ],
        "signals": [{"name": curve.group.name, "held_out_gain": curve.gain} for curve in diagnosis.found.curves],
        "residual_depends_on": list(diagnosis.residual_depends_on),
        "error": _error(main_error(diagnosis.errors)),
        "learnt": learnt_document(diagnosis.learning),
        "errors": [_error(error) for error in diagnosis.errors],
        "error_on_bullet": _error(diagnosis.confirmed) if diagnosis.confirmed else None,
        "fitted_to_windows": _polish(diagnosis),
        "noise": {"drive": list(diagnosis.noise.drive), "pose": list(diagnosis.noise.pose)},
        "could_not_be_seen": list(diagnosis.could_not_be_seen),
        "next_manoeuvre": _manoeuvre(diagnosis),
        "fitted_s": diagnosis.parts.fitted.seconds,
        "tested_s": diagnosis.parts.tested.seconds,
        "clocks": clocks_document(diagnosis.clocks),
        "unlike_drives": unlike_document(diagnosis.robot_clusters, diagnosis.drive_names),
    }


def _estimate(estimate: Estimate) -> dict[str, Any]:
    return {"value": estimate.value, "interval": list(estimate.interval), "unit": estimate.unit}


def _effect(effect: AdoptedEffect, theta: Mapping[str, Estimate], catalogue: Catalogue) -> dict[str, Any]:
    kind = catalogue.effect(effect.effect)
    names = dict(zip(catalogue.theta_names(effect.effect), (one.name for one in kind.parameters), strict=True))
    return {
        "name": effect.effect,
        "form": effect.form,
        "parameters": {names[name]: _estimate(theta[name]) for name in effect.names if name in theta},
        "held_out_gain": effect.gain,
        "p_value": effect.p_value,
        "indistinguishable_from": [rival.effect for rival in effect.rivals],
    }


def _added_document(effect: AdoptedEffect, diagnosis: Diagnosis) -> dict[str, Any]:
    worth = _worth(diagnosis.effect_sizes.get(effect.effect, {}))
    return _effect(effect, diagnosis.theta, diagnosis.robot.catalogue) | {
        "worth": worth,
        "at_edge": list(diagnosis.at_edge(effect)),
    }


def _immaterial_document(effect: AdoptedEffect, diagnosis: Diagnosis) -> dict[str, Any]:
    """An effect that was dropped; `changes_error_by` is for the horizon where it matters most."""
    worth = diagnosis.effect_sizes.get(effect.effect, {})
    horizon = decisive(worth) if worth else None
    change = _percent(worth[horizon]) if horizon is not None else {"value": None, "interval": None, "unit": "%"}
    evidence = {"nats": effect.gain, "changes_error_by": change["value"], "interval": change["interval"], "unit": "%"}
    open_ = {"horizon_s": horizon, "may_matter": not worth or may_matter(worth), "worth": _worth(worth)}
    return _effect(effect, diagnosis.dropped_values, diagnosis.robot.catalogue) | evidence | open_


def _worth(worth: EffectSize) -> dict[str, Any]:
    return {f"{horizon:g}": _percent(one) for horizon, one in worth.items()}


def _percent(one: Ratio) -> dict[str, Any]:
    value, interval = per_cent(one)
    return {"value": value, "interval": list(interval), "unit": "%"}


def _polish(diagnosis: Diagnosis) -> dict[str, Any] | None:
    polish = diagnosis.multistep
    if polish is None:
        return None
    return {
        "horizon_s": polish.horizon_s,
        "error_ratio": ratios_document(polish.ratios),
    }


def _error(error: HorizonError) -> dict[str, Any]:
    return {
        "horizon_s": error.horizon_s,
        "windows": error.windows,
        "before": error.before.value,
        "before_interval": list(error.before.interval),
        "after": error.after.value,
        "after_interval": list(error.after.interval),
        "ratio": error.ratio.value,
        "ratio_interval": list(error.ratio.interval),
        "noise_floor": error.floor.lower,
        "noise_floor_upper": error.floor.upper,
        "not_repeated": ratio_document(error.floor.again.share) if error.floor.again else None,
        "removable_left": error.removable_left,
        "unit": "m",
        "heading": {
            "before": error.heading_before.value,
            "after": error.heading_after.value,
            "noise_floor": error.heading_floor,
            "unit": "rad",
        },
    }


def _manoeuvre(diagnosis: Diagnosis) -> dict[str, Any] | None:
    manoeuvre = diagnosis.manoeuvre
    if manoeuvre is None:
        return None
    return {
        "name": manoeuvre.name,
        "description": manoeuvre.description,
        "tells_apart": list(manoeuvre.between),
        "nats_per_minute": manoeuvre.nats_per_minute,
        "times": manoeuvre.times,
    }


def tables_and_notes(diagnosis: Diagnosis) -> Group:
    """The diagnosis as `diagnose` prints it: the verdict, tables and notes."""
    parts = [
        parameters_table("Fitted parameters", diagnosis.declared, diagnosis.theta),
        _errors(diagnosis),
        _candidates(diagnosis),
    ]
    return Group(Text(headline(diagnosis), style="bold"), *parts, *(Text(note) for note in notes(diagnosis)))


def _errors(diagnosis: Diagnosis) -> Table:
    table = plain_table(
        "Error on held-out drives: RMSE of position [mm] (heading [deg])",
        ("window", "before", "after", "after / before", "noise floor"),
    )
    confirmed = [(diagnosis.confirmed, ", bullet")] if diagnosis.confirmed else []
    for error, plant in [*((error, "") for error in diagnosis.errors), *confirmed]:
        table.add_row(
            f"{error.horizon_s:g} s{plant}",
            _millimetres(error.before.value, error.before.interval, error.heading_before.value),
            _millimetres(error.after.value, error.after.interval, error.heading_after.value),
            f"{error.ratio.value:.2f} ({error.ratio.interval[0]:.2f} … {error.ratio.interval[1]:.2f})",
            f"{1e3 * error.floor.lower:.1f} to {1e3 * error.floor.upper:.1f} ({57.2958 * error.heading_floor:.2f})",
        )
    return table


def _millimetres(value: float, interval: tuple[float, float], heading: float) -> str:
    return f"{1e3 * value:.1f} [{1e3 * interval[0]:.1f} … {1e3 * interval[1]:.1f}] ({57.2958 * heading:.2f})"


def _candidates(diagnosis: Diagnosis) -> Table:
    table = plain_table("Effects tried, best first", ("effect", "form", "log-likelihood gain [nats]", "p"))
    for tried in diagnosis.found.tried[:8]:
        table.add_row(tried.effect, tried.form, f"{tried.gain:.1f}", f"{tried.p_value:.3f}")
    return table
