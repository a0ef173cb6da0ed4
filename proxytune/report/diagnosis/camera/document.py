"""A camera's diagnosis as `camera` of the JSON document: plain numbers, None where there is none."""

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from proxytune.diagnosis import Blemish, CameraDiagnosis, CameraEffect, Comparison, Estimate, LaidMap, ResidualField


def camera_document(diagnosis: CameraDiagnosis) -> dict[str, Any]:
    """Everything that `diagnose --json` prints of the camera."""
    return {
        "verdict": diagnosis.verdict,
        "declared": estimates_document(diagnosis.declared),
        "effects": [_effect(effect, diagnosis, diagnosis.theta) for effect in diagnosis.effects],
        "immaterial": [_effect(effect, diagnosis, diagnosis.dropped) for effect in diagnosis.negligible],
        "extended": estimates_document(diagnosis.theta),
        "candidates": [{"name": "+".join(one.effects), "loss": _number(one.loss)} for one in diagnosis.candidates],
        "error": _comparison(diagnosis.pixels),
        "grey_error": _comparison(diagnosis.grey),
        "fixed_to_camera": dict(zip(("before", "after"), map(_leftover, diagnosis.residual_fields), strict=True)),
        "blemishes": [_blemish(blemish) for blemish in diagnosis.blemishes],
        "could_not_be_seen": list(diagnosis.could_not_be_seen),
        "next_views": list(diagnosis.next_views),
        "map": _map(diagnosis.laid),
        "matched_share": _number(diagnosis.matched),
        "frames": {"used": len(diagnosis.gathered.numbers), "of": len(diagnosis.gathered.frames.paths)},
        "pose_scatter": _pose_scatter(diagnosis),
        "notes": list(diagnosis.notes),
    }


def estimates_document(estimates: Mapping[str, Estimate]) -> dict[str, Any]:
    """Values with their intervals and units, by name."""
    return {name: _estimate(one) for name, one in estimates.items()}


def _number(value: float) -> float | None:
    return float(value) if math.isfinite(value) else None


def _interval(ends: tuple[float, float]) -> list[float | None]:
    return [_number(end) for end in ends]


def _estimate(one: Estimate) -> dict[str, Any]:
    return {"value": _number(one.value), "interval": _interval(one.interval), "unit": one.unit}


def _effect(effect: CameraEffect, diagnosis: CameraDiagnosis, theta: Mapping[str, Estimate]) -> dict[str, Any]:
    catalogue = diagnosis.named.full.views.optics.robot.catalogue
    kind = catalogue.effect(effect.effect)
    own = dict(zip(catalogue.theta_names(effect.effect), (one.name for one in kind.parameters), strict=True))
    return {
        "name": effect.effect,
        "parameters": {own[name]: _estimate(theta[name]) for name in effect.names if name in theta},
        "held_out_gain": None if effect.nats is None else _number(effect.nats),
        "indistinguishable_from": list(effect.rivals),
        "error_without": _number(effect.error_without) if effect.error_without is not None else None,
    }


def noise_floor(error: Comparison) -> float | None:
    """The error that no camera could remove; None where it is not known."""
    return None if error.floor is None else _number(error.floor.value)


def _comparison(error: Comparison) -> dict[str, Any]:
    return {
        "before": _number(error.before.value),
        "before_interval": _interval(error.before.interval),
        "after": _number(error.after.value),
        "after_interval": _interval(error.after.interval),
        "noise_floor": noise_floor(error),
        "unit": error.unit,
        "frames": int(np.isfinite(error.before.frames).sum()),
    }


def _leftover(gate: ResidualField) -> dict[str, Any]:
    numbers = {"nats": _number(gate.nats), "share": _number(gate.share), "rms_px": _number(gate.rms_px)}
    return {**numbers, "open": bool(gate.significant)}


def _blemish(blemish: Blemish) -> dict[str, Any]:
    return {
        "columns": [int(end) for end in blemish.columns],
        "rows": [int(end) for end in blemish.rows],
        "contrast": _number(blemish.contrast),
        "share": _number(blemish.share),
    }


def _map(laid: LaidMap) -> dict[str, Any]:
    lines = [
        {
            "line": one.line,
            "stretch": int(one.stretch),
            "right_m": _number(one.right_m),
            "interval": _interval(one.interval),
        }
        for one in laid.lines
    ]
    return {"offset": estimates_document(laid.offset), "lines": lines, "widths": estimates_document(laid.widths)}


def _pose_scatter(diagnosis: CameraDiagnosis) -> dict[str, Any]:
    """The tracker's scatter before its poses are smoothed, as log.toml states it."""
    views = diagnosis.named.full.views
    place, turn = views.position_m / views.tracks.share, np.degrees(views.heading_rad) / views.tracks.share
    return {"position_m": _number(place), "heading_deg": _number(float(turn))}
