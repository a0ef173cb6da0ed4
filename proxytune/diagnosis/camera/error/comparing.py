"""Errors of cameras on frames that they were not fitted to: displacement of markings, and brightness of the floor."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from proxytune.diagnosis.camera.error.unseen import FOLDS, SCALES, error_over, fit_poses, pixel_errors, unseen_residuals
from proxytune.diagnosis.camera.gathering import Gathered
from proxytune.diagnosis.camera.look.appearance import floor_pixels
from proxytune.diagnosis.camera.model.drawing import Pictures, draw_pictures
from proxytune.diagnosis.camera.model.fitting import CameraFit, fit_camera
from proxytune.diagnosis.camera.model.optics import effects_of
from proxytune.diagnosis.camera.naming.search import Named, fit_set
from proxytune.diagnosis.camera.result import Comparison

Floats = NDArray[np.float64]

Look = Mapping[str, float]
"""Values of effects on pictures, by name in θ."""


def compare_displacement(named: Named, seed: int) -> tuple[Comparison, dict[str, float]]:
    """Displacement of markings before and after, and the error without each effect over the error with all."""
    views = named.full.views
    without = {
        effect: fit_set(named.full, [one for one in effects_of(named.model.names) if one != effect])
        for effect in named.effects
    }
    fits = [named.declared, named.model, named.full, *without.values()]
    residuals = [unseen_residuals(views, fit.state, fit.names) for fit in fits]
    before, after, floor = pixel_errors(views, residuals[:3], seed)
    lowest = floor if floor.value < after.value else after
    ratios = {}
    for effect, residual in zip(without, residuals[3:], strict=True):
        with_all, missing = pixel_errors(views, (residuals[1], residual), seed)
        ratios[effect] = missing.value / max(with_all.value, 1e-9)
    return Comparison(before, after, lowest, "px"), ratios


def compare_brightness(gathered: Gathered, named: Named, looks: tuple[Look, Look], seed: int) -> Comparison:
    """Differences of brightness on the floor, of a third of the frames, before and after.

    Args:
        gathered: The measured pictures.
        named: The cameras that were fitted.
        looks: Effects on pictures before and after.
        seed: Of the bootstrap.
    """
    out = np.arange(named.full.views.count) % FOLDS == 0
    errors = [
        _grey_errors(gathered, fit, look, out) for fit, look in zip((named.declared, named.model), looks, strict=True)
    ]
    before, after = (error_over(sums, counts, seed) for sums, counts in errors)
    return Comparison(before, after, after if after.value < before.value else before, "grey levels")


def _grey_errors(gathered: Gathered, fit: CameraFit, look: Look, out: NDArray[np.bool_]) -> tuple[Floats, Floats]:
    """Sums of the floor's differences and how many pixels they are of, for each frame left out."""
    views, frames = fit.views, np.flatnonzero(out)
    state = fit_poses(views, fit_camera(views, fit.state, fit.names, SCALES, ~out).state, out)
    drawn = draw_pictures(views, state, look, frames)
    measured = gathered.pictures[frames].astype(np.float32)
    floor = floor_pixels(fit)
    if not gathered.frames.fixed_exposure:
        drawn = drawn * _levels(measured, drawn, floor)
    differences = np.abs(measured - np.clip(drawn, 0.0, 255.0)).mean(axis=-1)[:, floor]
    return differences.sum(axis=1).astype(float), np.full(len(frames), float(floor.sum()))


def _levels(measured: Pictures, drawn: Pictures, floor: NDArray[np.bool_]) -> Pictures:
    """How much brighter each frame was exposed than drawn (n, 1, 1, 1)."""
    ratio = np.median(measured[:, floor].mean(axis=-1) / np.maximum(drawn[:, floor].mean(axis=-1), 1.0), axis=1)
    return np.asarray(ratio[:, None, None, None], dtype=np.float32)
