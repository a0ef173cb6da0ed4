"""JSON document of a diagnosis, of motion and camera, and the extended model as model.toml."""

import dataclasses
import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from proxytune.diagnosis import (
    AdoptedEffect,
    CameraDiagnosis,
    CameraEffect,
    Clocks,
    Comparison,
    Diagnosis,
    EffectSize,
    Estimate,
    HorizonError,
    Learning,
    LogDiagnosis,
    PictureError,
    Ratio,
    Rmse,
    RobotClusters,
    main_error,
)
from proxytune.driving import is_robot
from proxytune.effects import Catalogue, Model, is_learnt, model_text
from proxytune.report.diagnosis.notes import decisive, may_matter, per_cent
from proxytune.settings import GEOMETRY

TOP = ("verdict", "declared", "effects", "extended", "could_not_be_seen")
"""Keys of the camera that the document has above all, where there is nothing to say of motion."""


def diagnosis_document(found: LogDiagnosis) -> dict[str, Any]:
    """Everything that `diagnose --json` prints: motion above, `camera` beside it."""
    camera = None if found.camera is None else camera_document(found.camera)
    top = {"log": found.log, "robot": found.robot.name}
    if found.motion is not None:
        top |= motion_document(found.motion)
    elif camera is not None:
        top |= {key: camera[key] for key in TOP}
    refused = {"motion_refused": found.motion_refused or None, "camera_refused": found.camera_refused or None}
    return {**top, "camera": camera, **refused, "cautions": list(found.cautions)}


def extended_model_text(found: LogDiagnosis) -> str:
    """The extended model of both as model.toml."""
    robot, parts = found.robot, [part for part in (found.motion, found.camera) if part is not None]
    estimates = {name: one for part in parts for name, one in part.theta.items()}
    # Values moved along with learnt curves, which take the place of doubtful names.
    motion = found.motion
    learnt = motion.learning.model if motion else {}
    gone = motion.theta.keys() - learnt.keys() if motion and learnt else set()
    values = {name: float(learnt.get(name, one.value)) for name, one in estimates.items() if name not in gone}
    theta = {name: robot.catalogue.parameters[name].clipped(value) for name, value in values.items()}
    theta |= {name: value for name, value in learnt.items() if is_learnt(name)}
    bounds = {
        name: (float(one.interval[0]), float(one.interval[1]))
        for name, one in estimates.items()
        if values.get(name) == float(one.value)
    }
    in_robots = is_robot(robot.name, robot.catalogue.folder)
    geometry = {} if in_robots else {figure: robot.figures[figure] for figure in GEOMETRY.values()}
    comments = []
    for part in parts:
        added = ", ".join(effect.effect for effect in part.effects) or "nothing"
        kind = "" if part is found.motion else "camera: "
        comments.append(f"{kind}{part.verdict}: fitted to {found.log}; added to what was declared: {added}")
    return model_text(Model(robot.name, None, theta, bounds, geometry), comments, robot.catalogue)


def motion_document(diagnosis: Diagnosis) -> dict[str, Any]:
    """Everything that `diagnose --json` prints of motion."""
    polish, drive = diagnosis.multistep, diagnosis.next_drive
    manoeuvre = drive and {
        "name": drive.name,
        "description": drive.description,
        "tells_apart": list(drive.between),
        "nats_per_minute": drive.nats_per_minute,
        "times": drive.times,
        "seconds": drive.seconds,
        "room_m": list(drive.room),
        "library": drive.manoeuvre and dict(zip(("name", "nats_per_minute"), drive.manoeuvre, strict=True)),
    }
    return {
        "log": diagnosis.log,
        "robot": diagnosis.robot.name,
        "verdict": diagnosis.verdict,
        "declared": estimates_document(diagnosis.declared),
        "effects": motion_effects(diagnosis),
        "expected_false_names": diagnosis.expected_false_names,
        "immaterial": [_immaterial_document(effect, diagnosis) for effect in diagnosis.negligible],
        "extended": estimates_document(diagnosis.theta),
        "candidates": [
            {"name": tried.effect, "form": tried.form, "held_out_gain": tried.gain, "p_value": tried.p_value}
            for tried in diagnosis.found.tried
        ],
        "signals": [{"name": curve.group.name, "held_out_gain": curve.gain} for curve in diagnosis.found.curves],
        "residual_depends_on": list(diagnosis.residual_depends_on),
        "error": _error_document(main_error(diagnosis.errors)),
        "periodic": diagnosis.period and diagnosis.period._asdict(),
        "learnt": learnt_document(diagnosis.learning),
        "errors": [_error_document(error) for error in diagnosis.errors],
        "error_on_bullet": _error_document(diagnosis.confirmed) if diagnosis.confirmed else None,
        "fitted_to_windows": polish and {"horizon_s": polish.horizon_s, "error_ratio": ratios_document(polish.ratios)},
        "noise": _plain(diagnosis.noise),
        "could_not_be_seen": list(diagnosis.could_not_be_seen),
        "next_manoeuvre": manoeuvre,
        "fitted_s": diagnosis.parts.fitted.seconds,
        "tested_s": diagnosis.parts.tested.seconds,
        "clocks": clocks_document(diagnosis.clocks),
        "unlike_drives": unlike_document(diagnosis.robot_clusters, diagnosis.drive_names),
    }


def estimates_document(estimates: Mapping[str, Estimate]) -> dict[str, Any]:
    """Values with their intervals and units, by name; None where one is not finite."""
    return {name: _plain(one) for name, one in estimates.items()}


def _parameters_document(
    effect: AdoptedEffect | CameraEffect, theta: Mapping[str, Estimate], catalogue: Catalogue
) -> dict[str, Any]:
    """The values of an effect that was added, by its own names of them."""
    kind = catalogue.effect(effect.effect)
    names = dict(zip(catalogue.theta_names(effect.effect), (one.name for one in kind.parameters), strict=True))
    return estimates_document({names[name]: theta[name] for name in effect.names if name in theta})


def _effect_document(effect: AdoptedEffect, diagnosis: Diagnosis, theta: Mapping[str, Estimate]) -> dict[str, Any]:
    return {
        "name": effect.effect,
        "form": effect.form,
        "parameters": _parameters_document(effect, theta, diagnosis.robot.catalogue),
        "held_out_gain": effect.gain,
        "p_value": effect.p_value,
        "indistinguishable_from": [rival.effect for rival in effect.rivals],
    }


def motion_effects(diagnosis: Diagnosis) -> list[dict[str, Any]]:
    """The effects of motion that were added, as `diagnose --json` has them."""
    return [
        {
            **_effect_document(effect, diagnosis, diagnosis.theta),
            "worth": _worth_document(diagnosis.effect_sizes.get(effect.effect, {})),
            "at_edge": list(diagnosis.at_edge(effect)),
        }
        for effect in diagnosis.effects
    ]


def _immaterial_document(effect: AdoptedEffect, diagnosis: Diagnosis) -> dict[str, Any]:
    """An effect that was dropped; `changes_error_by` is for the horizon where it matters most."""
    worth = diagnosis.effect_sizes.get(effect.effect, {})
    horizon = decisive(worth) if worth else None
    change = _percent(worth[horizon]) if horizon is not None else {"value": None, "interval": None, "unit": "%"}
    evidence = {"nats": effect.gain, "changes_error_by": change["value"], "interval": change["interval"], "unit": "%"}
    open_ = {
        "horizon_s": horizon,
        "may_matter": not worth or may_matter(worth, diagnosis.rules.material_factor),
        "worth": _worth_document(worth),
    }
    return _effect_document(effect, diagnosis, diagnosis.dropped_values) | evidence | open_


def _worth_document(worth: EffectSize) -> dict[str, Any]:
    return {f"{horizon:g}": _percent(one) for horizon, one in worth.items()}


def _percent(one: Ratio) -> dict[str, Any]:
    value, interval = per_cent(one)
    return {"value": value, "interval": list(interval), "unit": "%"}


def _error_document(error: HorizonError) -> dict[str, Any]:
    return {
        "horizon_s": error.horizon_s,
        "windows": error.windows,
        **_with_interval("before", error.before),
        **_with_interval("after", error.after),
        **_with_interval("ratio", error.ratio),
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


def clocks_document(clocks: Sequence[Clocks]) -> dict[str, Any]:
    """The clocks of the log, and under `test` those of the log to test on where that is another."""
    own, *test = clocks
    own_document = {
        "offset_s": own.offset.value,
        "interval": list(own.offset.interval),
        "latency_s": own.latency.value,
        "latency_interval": list(own.latency.interval),
        "assumed_delay_s": own.assumed_delay_s,
        "declared_offset_s": own.declared_s,
        "drift": {"rate": own.drift.value, "interval": list(own.drift.interval)},
        "drives": {name: {"offset_s": one.value, "interval": list(one.interval)} for name, one in own.drives.items()},
        "jumps": [jump._asdict() for jump in own.jumps],
    }
    return own_document | ({"test": clocks_document(test)} if test else {})


def unlike_document(unlike: RobotClusters | None, names: Sequence[str]) -> dict[str, Any] | None:
    """The wheel that differs, and its gain in each of two groups of drives; None where all drives are alike."""
    if unlike is None:
        return None
    groups = [
        {"gain": gain, "drives": [names[number] for number in group]}
        for gain, group in zip(unlike.gains, unlike.groups, strict=True)
    ]
    return {"wheel": unlike.wheel, "groups": groups}


def learnt_document(learning: Learning) -> dict[str, Any]:
    """The `learnt` part of `diagnose --json`: what the guard saw, and the error on drives that were not fitted.

    Keys of `ratio` and `guard` are horizons in seconds. `groups` and `share` are empty where nothing is used.
    """
    beside, like = learning.discrepancy, learning.looks_like
    return {
        "used": beside.used,
        "groups": list(learning.depends_on(())),
        "share": dict(beside.share if beside.used else {}),
        "ratio": ratios_document({error.horizon_s: error.ratio for error in learning.errors}),
        "guard": ratios_document(beside.guard),
        "errors": [
            {"horizon_s": error.horizon_s, **_with_interval("after", error.after), "heading": error.heading.value}
            for error in learning.errors
        ],
        "names_doubtful": learning.names_doubtful,
        "looks_like": like
        and {"name": like.effect, "form": like.form, "values": dict(like.theta), "share": like.share},
    }


def ratio_document(one: Ratio) -> dict[str, Any]:
    """One error by another, with its interval."""
    return {"value": one.value, "interval": list(one.interval)}


def ratios_document(ratios: Mapping[float, Ratio]) -> dict[str, dict[str, Any]]:
    """Such ratios by horizon in seconds."""
    return {f"{horizon_s:g}": ratio_document(one) for horizon_s, one in ratios.items()}


def camera_document(diagnosis: CameraDiagnosis) -> dict[str, Any]:
    """Everything that `diagnose --json` prints of the camera: plain numbers, None where there is none."""
    views = diagnosis.named.full.views
    place, turn = views.position_m / views.tracks.share, np.degrees(views.heading_rad) / views.tracks.share
    keys = ("nats", "share", "rms_px")
    left = [
        {key: _plain(getattr(one, key)) for key in keys} | {"open": bool(one.significant)}
        for one in diagnosis.residual_fields
    ]
    return {
        "verdict": diagnosis.verdict,
        "declared": estimates_document(diagnosis.declared),
        "effects": camera_effects(diagnosis),
        "immaterial": [_camera_effect_document(one, diagnosis, diagnosis.dropped) for one in diagnosis.negligible],
        "extended": estimates_document(diagnosis.theta),
        "candidates": [{"name": "+".join(one.effects), "loss": _plain(one.loss)} for one in diagnosis.candidates],
        "error": _comparison_document(diagnosis.pixels),
        "grey_error": _comparison_document(diagnosis.grey),
        "fixed_to_camera": dict(zip(("before", "after"), left, strict=True)),
        "blemishes": _plain(diagnosis.blemishes),
        "could_not_be_seen": list(diagnosis.could_not_be_seen),
        "next_views": list(diagnosis.next_views),
        "map": _plain(diagnosis.laid),
        "matched_share": _plain(diagnosis.matched),
        "frames": {"used": len(diagnosis.gathered.numbers), "of": len(diagnosis.gathered.frames.paths)},
        # The tracker's, before its poses are smoothed, as log.toml states it.
        "pose_scatter": {"position_m": _plain(place), "heading_deg": _plain(turn)},
        "notes": list(diagnosis.notes),
    }


def camera_effects(diagnosis: CameraDiagnosis) -> list[dict[str, Any]]:
    """The effects of the camera that were added, as `diagnose --json` has them."""
    return [
        _camera_effect_document(effect, diagnosis, diagnosis.theta)
        | {"at_edge": [name for name in effect.names if name in diagnosis.at_ends]}
        for effect in diagnosis.effects
    ]


def _plain(value: Any) -> Any:
    """A record by its own names, a sequence or a number as JSON has them; None where a number is not finite."""
    if dataclasses.is_dataclass(value):
        return {field.name: _plain(getattr(value, field.name)) for field in dataclasses.fields(value)}
    if isinstance(value, Mapping):
        return {name: _plain(one) for name, one in value.items()}
    if isinstance(value, tuple):
        return [_plain(one) for one in value]
    value = value.item() if isinstance(value, np.generic) else value
    return None if isinstance(value, float) and not math.isfinite(value) else value


def _with_interval(name: str, one: Rmse | Ratio | PictureError) -> dict[str, Any]:
    """A figure and, under a name of its own, its interval."""
    return {name: _plain(one.value), f"{name}_interval": _plain(one.interval)}


def _camera_effect_document(
    effect: CameraEffect, diagnosis: CameraDiagnosis, theta: Mapping[str, Estimate]
) -> dict[str, Any]:
    return {
        "name": effect.effect,
        "parameters": _parameters_document(effect, theta, diagnosis.named.full.views.optics.robot.catalogue),
        "held_out_gain": _plain(effect.nats),
        "indistinguishable_from": list(effect.rivals),
        "error_without": _plain(effect.error_without),
    }


def camera_noise_floor(error: Comparison) -> float | None:
    """The error that no camera could remove; None where it is not known."""
    return None if error.floor is None else _plain(error.floor.value)


def _comparison_document(error: Comparison) -> dict[str, Any]:
    return {
        **_with_interval("before", error.before),
        **_with_interval("after", error.after),
        "noise_floor": camera_noise_floor(error),
        "unit": error.unit,
        "frames": int(np.isfinite(error.before.frames).sum()),
    }
