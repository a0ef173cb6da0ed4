"""Errors of cameras on frames that they were not fitted to: displacement of markings, and brightness of the floor."""

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from proxytune.diagnosis.camera.error.unseen import FOLDS, SCALES, PictureError, error_over, fit_poses, pixel_errors
from proxytune.diagnosis.camera.gathering import Gathered
from proxytune.diagnosis.camera.look.appearance import floor_pixels
from proxytune.diagnosis.camera.model.drawing import Pictures, draw_pictures
from proxytune.diagnosis.camera.model.fitting import CameraFit, fit_camera
from proxytune.diagnosis.camera.model.optics import effects_of
from proxytune.diagnosis.camera.model.views import Views
from proxytune.diagnosis.camera.naming.search import Named
from proxytune.diagnosis.camera.result import Comparison
from proxytune.effects import effect_of

Floats = NDArray[np.float64]

Look = Mapping[str, float]
"""Values of effects on pictures, by name in θ."""


def compare_displacement(views: Views, residuals: tuple[Floats, Floats, Floats], seed: int) -> Comparison:
    """Displacement of markings before and after, from residuals on unseen frames.

    Args:
        views: Whose edge points these are.
        residuals: Of the declared camera, of the model's and of the one with every effect (n,) each [pixel].
        seed: Of the bootstrap.
    """
    before, after, floor = pixel_errors(views, residuals, seed)
    return Comparison(before, after, floor if floor.value < after.value else after, "px")


def displacement_ratio(views: Views, residuals: tuple[Floats, Floats], seed: int) -> float:
    """The error without an effect over the error with it, from residuals of both on unseen frames (n,) [pixel]."""
    without, with_it = pixel_errors(views, residuals, seed)
    return without.value / max(with_it.value, 1e-9)


def compare_brightness(
    gathered: Gathered, named: Named, looks: tuple[Look, Look], seed: int
) -> tuple[Comparison, dict[str, float]]:
    """Differences of brightness on the floor, of a third of the frames, and the error without each effect.

    Args:
        gathered: The measured pictures.
        named: The cameras that were fitted.
        looks: Effects on pictures before and after.
        seed: Of the bootstrap.

    Returns:
        The errors before and after, and by effect that was added the error without it over the error with all.
    """
    out = np.arange(named.full.views.count) % FOLDS == 0
    plain, full = looks
    added = [effect for effect in effects_of(tuple(full)) if effect not in effects_of(tuple(plain))]
    without = [{name: value for name, value in full.items() if effect_of(name) != effect} for effect in added]
    before = _grey_errors(gathered, named.declared, [plain], out, seed)[0]
    after, *others = _grey_errors(gathered, named.model, [full, *without], out, seed)
    ratios = {effect: one.value / max(after.value, 1e-9) for effect, one in zip(added, others, strict=True)}
    return Comparison(before, after, None, "grey levels"), ratios


def grey_differences(
    measured: Pictures, drawn: Pictures, floor: NDArray[np.bool_], *, fixed_exposure: bool
) -> Pictures:
    """Absolute differences on the floor (n, floor pixels, 3) [grey levels].

    Args:
        measured: Pictures (n, rows, columns, 3).
        drawn: The same as a model has them.
        floor: Pixels that look at the floor (rows, columns).
        fixed_exposure: Whether pictures compare as they are; else each at its own brightness, which no model knows.
    """
    measured, drawn = measured[:, floor], drawn[:, floor]
    levels = 1.0 if fixed_exposure else _levels(measured, drawn)
    return np.asarray(np.abs(measured - np.clip(drawn * levels, 0.0, 255.0)))


def _grey_errors(
    gathered: Gathered, fit: CameraFit, looks: Sequence[Look], out: NDArray[np.bool_], seed: int
) -> list[PictureError]:
    """Errors of frames left out (N,), by a camera that was fitted without them, for each look."""
    views, frames = fit.views, np.flatnonzero(out)
    state = fit_poses(views, fit_camera(views, fit.state, fit.names, SCALES, ~out).state, out)
    measured, floor = gathered.pictures[frames].astype(np.float32), floor_pixels(fit)
    counts, errors = np.full(len(frames), float(floor.sum())), []
    for look in looks:
        drawn = draw_pictures(views, state, look, frames)
        differences = grey_differences(measured, drawn, floor, fixed_exposure=gathered.frames.fixed_exposure)
        errors.append(error_over(differences.mean(axis=-1).sum(axis=1).astype(float), counts, seed))
    return errors


def _levels(measured: Pictures, drawn: Pictures) -> Pictures:
    """How much brighter each frame was exposed than drawn (n, 1, 1), of pixels (n, pixels, 3)."""
    ratios = measured.mean(axis=-1) / np.maximum(drawn.mean(axis=-1), 1.0)
    return np.asarray(np.median(ratios, axis=1)[:, None, None], dtype=np.float32)
