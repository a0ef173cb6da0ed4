"""Errors of cameras on frames that they were not fitted to, and the size of effects by them.

Displacement of markings [pixel] of every edge point, by cameras fitted without its frame, and brightness of the floor
[grey levels], with intervals from a bootstrap over frames. An effect's size is the error without it over the error with
it; `weigh_effects` drops effects whose size is below MATERIAL. `CameraDiagnosis` is the answer.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from proxytune.arrays import NORMAL_95, Flags, Floats
from proxytune.diagnosis.answer import Estimate
from proxytune.diagnosis.camera.appearance import floor_pixels
from proxytune.diagnosis.camera.edges import Gathered, Views, effects_of
from proxytune.diagnosis.camera.fitting import SCALE_PX, CameraFit, count_points, eliminate_poses, fit_camera
from proxytune.diagnosis.camera.light import Blemish
from proxytune.diagnosis.camera.model import Pictures, State, draw_pictures, project
from proxytune.diagnosis.camera.selection import CameraSelection, ResidualField, Subset, cost_of, fit_set
from proxytune.effects import effect_of

FOLDS = 3
"""Every frame is left out once, a third of them at a time."""
SCALES = (2.0 * SCALE_PX, *(SCALE_PX,) * 4)
POSE_STEPS = 4
CAP_PX = 4.0
"""A marking that lies farther off counts as so far [pixel]: what is no marking has no distance."""
DRAWS = 400
"""Bootstrap samples over frames."""


@dataclass(frozen=True)
class PictureError:
    """Mean error on unseen frames."""

    value: float  # over all points, in pixels or grey levels
    interval: tuple[float, float]  # 95 %, from a bootstrap over frames
    frames: Floats  # mean of each frame, NaN where it shows no marking (N,)


def unseen_residuals(views: Views, state: State, names: Sequence[str]) -> Floats:
    """Residuals of every edge point (n,) [pixel], by cameras that were fitted without its frame."""
    residuals = np.full(len(views.edges.row), CAP_PX)
    for fold in range(FOLDS):
        out = np.arange(views.count) % FOLDS == fold
        fit = fit_camera(views, state, names, SCALES, ~out)
        own = out[views.edges.frame]
        # Poses of frames left out are fitted under the tracker's scatter.
        there = project(views, fit_poses(views, fit.state, out))
        residuals[own] = np.where(there.valid, np.clip(there.residual, -CAP_PX, CAP_PX), CAP_PX)[own]
    return residuals


def fit_poses(views: Views, state: State, frames: Flags) -> State:
    """Fit the poses of some frames (N,), everything else held."""
    state = replace(state, poses=np.where(frames[:, None], 0.0, state.poses))
    for scale in np.geomspace(4.0 * SCALE_PX, SCALE_PX, POSE_STEPS):
        there = project(views, state)
        points = count_points(views, there, scale, frames, least=0.0)
        own = eliminate_poses(views, state, there, points, np.zeros((len(points.rows), 0))).own
        state = replace(state, poses=state.poses - np.where(frames[:, None], own, 0.0))
    return state


def pixel_errors(views: Views, residuals: Sequence[Floats], seed: int) -> list[PictureError]:
    """Errors of several cameras over the same points: those that any of them brings to a marking."""
    sizes = np.abs(np.stack(residuals))
    chosen = (sizes < CAP_PX).any(axis=0)
    frame = views.edges.frame[chosen]
    counts = np.bincount(frame, minlength=views.count).astype(float)
    sums = [np.bincount(frame, each[chosen], minlength=views.count) for each in sizes]
    return [error_over(total.astype(float), counts, seed) for total in sums]


def error_over(sums: Floats, counts: Floats, seed: int) -> PictureError:
    """The mean over all points of frames, from each frame's sum and number of points (N,)."""
    draws = np.random.default_rng(seed).integers(0, len(sums), (DRAWS, len(sums)))
    means = sums[draws].sum(axis=1) / np.maximum(counts[draws].sum(axis=1), 1.0)
    low, high = np.quantile(means, (0.025, 0.975))
    with np.errstate(invalid="ignore", divide="ignore"):
        frames = np.where(counts > 0, sums / counts, np.nan)
    return PictureError(float(sums.sum() / max(counts.sum(), 1.0)), (float(low), float(high)), frames)


@dataclass(frozen=True)
class CameraEffect:
    """An effect on the camera or its pictures that the model lacked."""

    effect: str  # its name
    names: tuple[str, ...]  # its parameters by name in θ
    nats: float | None  # what leaving it out costs, None for what shows in brightness or sharpness
    # error on unseen frames without it over the error with it; None for noise, which no model predicts
    error_without: float | None
    rivals: tuple[str, ...]  # effects, the tracker's among them, that explain the same pictures


@dataclass(frozen=True)
class Comparison:
    """Errors on unseen frames."""

    before: PictureError  # of the declared model
    after: PictureError  # of the model with the effects that were found
    # of the most flexible camera there is, what no camera could remove; None where none is known
    floor: PictureError | None
    unit: str  # "px" or "grey levels"


@dataclass(frozen=True)
class LaidLine:
    """A line that lies beside its place on the map."""

    line: str  # which, as in "left white line"
    stretch: int  # on which of the road's segments, from 0
    right_m: float  # how far to the right of its place, seen driving counter-clockwise; dashes: how far ahead [m]
    interval: tuple[float, float]  # 95 % [m]


@dataclass(frozen=True)
class LaidMap:
    """The map as it was laid."""

    offset: Mapping[str, Estimate]  # of the whole map by name: x_m, y_m, heading_deg
    lines: tuple[LaidLine, ...]  # lines that lie measurably beside their places, the farthest first
    widths: Mapping[str, Estimate]  # how much wider lines and dashes are [m], by what they are


@dataclass(frozen=True)
class CameraDiagnosis:
    """The diagnosis of a camera, from one log's frames."""

    verdict: str  # as a diagnosis of motion has it
    declared: Mapping[str, Estimate]  # declared parameters, fitted without any other effect, by name in θ
    theta: Mapping[str, Estimate]  # all parameters of the extended model, by name in θ
    effects: tuple[CameraEffect, ...]  # the effects that were added
    # effects that there is evidence for, and which hardly change the error: no part of the model
    negligible: tuple[CameraEffect, ...]
    # parameters of those effects, as they were fitted before they were dropped, by name in θ
    dropped: Mapping[str, Estimate]
    # what each effect of the catalogue costs if it is the only one added [nats], the best first
    candidates: Sequence[Subset]
    pixels: Comparison  # displacement of markings
    grey: Comparison  # differences in brightness on the floor
    residual_fields: tuple[ResidualField, ResidualField]  # what is fixed to the camera and left over, before and after
    blemishes: tuple[Blemish, ...]  # places in the picture that no camera effect explains: dirt, a bumper in view
    could_not_be_seen: tuple[str, ...]  # effects that these frames could not have shown
    next_views: tuple[str, ...]  # what to take to tell what could not be told
    laid: LaidMap  # how the map was laid
    matched: float  # share of the markings' edges that lie within 2 pixels of the map's
    notes: tuple[str, ...]  # what else is to be known, a line each
    named: CameraSelection  # all fits
    gathered: Gathered  # all frames that were used
    # names in θ of what was added that lies at an end of all that is possible: it then stands for something else
    at_ends: tuple[str, ...] = ()


def estimate_of(value: float, sd: float, unit: str) -> Estimate:
    """A value with this standard deviation as an estimate with its 95 % interval."""
    return Estimate(float(value), (float(value - NORMAL_95 * sd), float(value + NORMAL_95 * sd)), unit)


Look = Mapping[str, float]
"""Values of effects on pictures, by name in θ."""


def compare_brightness(
    gathered: Gathered, named: CameraSelection, looks: tuple[Look, Look], seed: int
) -> tuple[Comparison, dict[str, float]]:
    """Differences of brightness on the floor, of a third of the frames, and the error without each effect.

    Returns:
        The errors before and after, and by effect that was added the error without it over the error with all.
    """
    out = np.arange(named.full.views.count) % FOLDS == 0
    plain, full = looks
    added = [effect for effect in effects_of(full) if effect not in effects_of(plain)]
    without = [{name: value for name, value in full.items() if effect_of(name) != effect} for effect in added]
    before = _grey_errors(gathered, named.declared, [plain], out, seed)[0]
    after, *others = _grey_errors(gathered, named.model, [full, *without], out, seed)
    ratios = {effect: one.value / max(after.value, 1e-9) for effect, one in zip(added, others, strict=True)}
    return Comparison(before, after, None, "grey levels"), ratios


def grey_differences(measured: Pictures, drawn: Pictures, floor: Flags, *, fixed_exposure: bool) -> Pictures:
    """Absolute differences on the floor (n, floor pixels, 3) of pictures (n, rows, columns, 3) [grey levels]."""
    measured, drawn = measured[:, floor], drawn[:, floor]
    # Each is compared at its own brightness, which no model knows.
    if not fixed_exposure:
        ratios = measured.mean(axis=-1) / np.maximum(drawn.mean(axis=-1), 1.0)
        drawn = drawn * np.asarray(np.median(ratios, axis=1)[:, None, None], dtype=np.float32)
    return np.asarray(np.abs(measured - np.clip(drawn, 0.0, 255.0)))


def _grey_errors(
    gathered: Gathered, fit: CameraFit, looks: Sequence[Look], out: Flags, seed: int
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


MATERIAL = 1.03
"""An effect matters if the error on unseen frames is larger by this factor without it."""


@dataclass(frozen=True)
class Weighed:
    """A camera with those effects alone that matter."""

    named: CameraSelection
    with_dropped: CameraFit
    pixels: Comparison  # errors on unseen frames, before and after
    ratios: Mapping[str, float]  # errors without each named effect, dropped ones too, over that with all
    nats: Mapping[str, float]  # what leaving each out costs
    dropped: tuple[str, ...]  # effects that had evidence, and hardly change the error


def weigh_effects(named: CameraSelection, seed: int) -> Weighed:
    """Weigh every effect that was named, and fit the camera again without those of no matter."""

    def tested(fit: CameraFit) -> tuple[CameraFit, Floats]:
        return fit, unseen_residuals(fit.views, fit.state, fit.names)

    def without(effects: Sequence[str]) -> tuple[CameraFit, Floats]:
        return tested(fit_set(named.full, [one for one in effects_of(named.model.names) if one not in effects]))

    views, cost = named.full.views, cost_of(named.model)
    model, residuals = tested(named.model)
    others = {effect: without((effect,)) for effect in named.effects}
    nats = {effect: cost_of(fit) - cost for effect, (fit, _) in others.items()}
    ratios = {}
    for effect, (_, left) in others.items():
        lacking, complete = pixel_errors(views, (left, residuals), seed)
        ratios[effect] = lacking.value / max(complete.value, 1e-9)
    dropped = tuple(effect for effect in named.effects if ratios[effect] < MATERIAL)
    kept = tuple(effect for effect in named.effects if effect not in dropped)
    if dropped:
        model, residuals = others[dropped[0]] if len(dropped) == 1 else without(dropped)
    declared, full = tested(named.declared)[1], tested(named.full)[1]
    before, after, floor = pixel_errors(views, (declared, residuals, full), seed)
    pixels = Comparison(before, after, floor if floor.value < after.value else after, "px")
    return Weighed(replace(named, model=model, effects=kept), named.model, pixels, ratios, nats, dropped)
