"""Selection of a camera's effects: fit everything, find the fewest effects that do as well, and fit those.

With θ̂ of the camera with every effect free, H its information and δ the way of all effects but a set S to their neutral
values, the set loses ½ δᵀ(H_δδ − H_δS H_SS⁻¹ H_Sδ)δ nats: exact near neutral values, and cheap enough for every set
(`rank_subsets`). The most promising sets of each size are fitted, until one costs no more than all effects together
(`select_camera_effects`). `fit_residual_field` tests whether anything fixed to the camera is left over, as a cubic
field of displacements fitted to one half of the frames and tested on the other. `check_match` tells whether frames,
poses and map belong together at all; `hidden_effects` and `next_views` what these frames cannot show, and what to take.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np

from proxytune.arrays import Flags, Floats
from proxytune.diagnosis.camera.edges import LATENCY, MAP_SCATTER, MOVING, READOUT, Views, effects_of
from proxytune.diagnosis.camera.fitting import (
    EVIDENCE,
    PASSES,
    SCALE_PX,
    CameraFit,
    common_slopes,
    count_points,
    eliminate,
    eliminate_poses,
    fit_camera,
    pose_scatter,
)
from proxytune.diagnosis.camera.model import Projection, neutral_state, project
from proxytune.effects import effect_of
from proxytune.errors import LogError

LEAST_NATS = 6.0
"""An effect is needed if leaving it out costs more evidence; by chance one in 2000 does."""
MOST = 4
"""No more than so many effects are named at once; a camera with more faults is better calibrated anew."""
TRIED = 3
"""So many sets of equal size are fitted, those that promise most."""


@dataclass(frozen=True)
class Subset:
    """A set of effects besides those declared, and what leaving all others out costs, at the least [nats]."""

    effects: tuple[str, ...]
    loss: float


def rank_subsets(full: CameraFit, declared: Sequence[str], size: int) -> list[Subset]:
    """Sets of so many effects besides those declared, the best first, by the quadratic form about the full fit."""
    others = [effect for effect in effects_of(full.names) if effect not in declared]
    off = np.array([full.theta[name] - full.views.optics.neutral(name) for name in full.names])
    sets = []
    for chosen in combinations(others, size):
        kept = np.array([effect_of(name) in (*declared, *chosen) for name in full.names])
        if kept.all():
            sets.append(Subset(chosen, 0.0))
            continue
        left = full.information[np.ix_(~kept, ~kept)]
        if kept.any():
            across, inner = full.information[np.ix_(~kept, kept)], full.information[np.ix_(kept, kept)]
            left = eliminate(left, across, inner + 1e-9 * np.diag(np.diag(inner)), across.T)
        sets.append(Subset(chosen, float(0.5 * off[~kept] @ left @ off[~kept])))
    return sorted(sets, key=lambda one: one.loss)


FIRST = ("camera_pitch", "camera_roll", "camera_yaw", "camera_height", "field_of_view", "camera_latency")
"""What is fitted first, from far away: nothing of it stands in for something else."""
FAR = tuple(16.0 * SCALE_PX * 2.0 ** (-step / 2.0) for step in range(7))
NEAR = (3.0 * SCALE_PX, 2.0 * SCALE_PX, *(SCALE_PX,) * 4)
AGAIN = (SCALE_PX,) * 2
FROM_ALL = (4.0 * SCALE_PX, 2.0 * SCALE_PX, *(SCALE_PX,) * 5)
"""Scales of the loss: from far, near the answer, once more, and from the answer of all effects together [pixel]."""
LEAST_SHARE = 0.01
"""Effects whose absence costs a smaller share of all cost are not needed either."""
RIVAL_NATS = 3.0
"""Sets of effects that cost no more beyond the best are its rivals."""


@dataclass(frozen=True)
class CameraSelection:
    """The effects that a camera was found to need besides those declared."""

    declared: CameraFit  # with the declared effects alone
    model: CameraFit  # with those that are needed besides
    full: CameraFit  # with every effect of the catalogue
    effects: tuple[str, ...]
    alone: tuple[Subset, ...]  # what each effect explains by itself [nats]
    rivals: tuple[tuple[str, ...], ...]  # sets of effects that do as well


def fit_everything(views: Views, names: Sequence[str], fixed: Mapping[str, float], *, learn_scatter: bool) -> CameraFit:
    """Fit all parameters from far away, but those fixed; the tracker's scatter is learnt where it is not known."""
    theta = {name: views.optics.neutral(name) for name in (*views.optics.mounting, *MOVING)} | dict(fixed)
    start = neutral_state(views, theta)
    # From far away an edge may be taken for another: the tape must not follow it
    fit = fit_camera(replace(views, tape_m=0.0), start, [name for name in names if name in FIRST], FAR)
    fit = fit_camera(views, fit.state, names, NEAR)
    for _ in range(PASSES if learn_scatter else 0):
        place, turn = pose_scatter(fit)
        fit = fit_camera(replace(views, position_m=place, heading_rad=turn), fit.state, names, AGAIN)
    return fit


def select_camera_effects(full: CameraFit, declared: Sequence[str]) -> CameraSelection:
    """Find the fewest effects besides those declared that explain what all together do."""
    least = cost_of(full)
    enough = max(LEAST_NATS, LEAST_SHARE * least)
    fits: list[CameraFit] = []
    for size in range(MOST + 1):
        sets = rank_subsets(full, declared, size)[:TRIED]
        if not sets:
            break
        tried = [(one, fit_set(full, (*declared, *one.effects))) for one in sets]
        # A set may really cost less beyond the full fit than was promised.
        costs = [(Subset(one.effects, min(one.loss, cost_of(fit) - least)), fit) for one, fit in tried]
        (best, fit), *others = sorted(costs, key=lambda pair: pair[0].loss)
        fits.append(fit)
        rivals = tuple(one.effects for one, _ in others if one.loss <= best.loss + RIVAL_NATS)
        if best.loss <= enough:
            break
    alone = tuple(rank_subsets(full, declared, 1))
    return CameraSelection(fits[0], fits[-1], full, best.effects, alone, rivals)


def cost_of(fit: CameraFit) -> float:
    """Cost of a fit: that of its edge points, as the loss has it, and of what is added to poses and tape [nats]."""
    there = project(fit.views, fit.state)
    squares = (there.residual / SCALE_PX) ** 2
    points = np.where(there.valid, squares / (1.0 + squares), 1.0)[there.near].sum()
    poses = ((fit.state.poses / fit.views.pose_scatter) ** 2).sum()
    tape = ((fit.state.tape / fit.views.tape_scatter) ** 2).sum()
    return float(0.5 * (EVIDENCE * points + poses + tape))


def fit_set(full: CameraFit, effects: Sequence[str]) -> CameraFit:
    """The camera with the parameters of these effects alone, from where all together have them."""
    names = [name for name in full.names if effect_of(name) in effects]
    optics = full.views.optics
    theta = {name: optics.neutral(name) if name in full.names else value for name, value in full.theta.items()}
    state = replace(full.state, theta={**theta, **{name: full.theta[name] for name in names}})
    return fit_camera(full.views, state, names, FROM_ALL)


POWERS = tuple((right, down) for right in range(4) for down in range(4) if right + down <= 3)
"""The terms of a cubic polynomial of the place in the picture."""
FIELD_PX = 1.0
"""Standard deviation that each term's coefficient is expected to have [pixel]."""
FIELD_NATS = 2.5
"""A field that explains less on frames that it was not fitted to is chance."""
FIELD_SHARE = 0.035
"""A field that explains a smaller share of the cost is of no matter."""
LEAST_PX = 0.1
"""A smaller field is of no matter either [pixel, root mean square over the points]."""


@dataclass(frozen=True)
class ResidualField:
    """A field of displacements that a fitted camera leaves over."""

    nats: float  # what it explains on frames that it was not fitted to
    share: float  # the same as a share of those frames' cost
    rms_px: float  # root mean square over the edge points [pixel]
    field: Floats  # coefficients of POWERS to the right and down (terms, 2) [pixel]

    @property
    def significant(self) -> bool:
        """Tell whether something fixed to the camera is left over."""
        return self.nats > FIELD_NATS and self.share > FIELD_SHARE and self.rms_px > LEAST_PX

    def displacement(self, right: Floats, down: Floats) -> Floats:
        """Displacement of the model's markings from those measured [pixel], at places from −1 to 1 in the picture."""
        return _terms(right, down) @ self.field


def fit_residual_field(fit: CameraFit) -> ResidualField:
    """Fit the field that all else leaves over to one half of the frames and test it on the other, both ways."""
    there = project(fit.views, fit.state)
    halves = [np.arange(fit.views.count) % 2 == part for part in (0, 1)]
    systems = [_system(fit, there, half) for half in halves]
    ridge = np.eye(len(systems[0][1])) / FIELD_PX**2
    fields = [np.asarray(-np.linalg.solve(matrix + ridge, right), dtype=float) for matrix, right, _ in systems]
    pairs = zip(systems, fields[::-1], strict=True)
    nats = sum(float(-(right @ field + 0.5 * field @ matrix @ field)) for (matrix, right, _), field in pairs)
    cost = sum(system[2] for system in systems)
    field = np.mean(fields, axis=0).reshape(2, -1).T
    moved = _terms_of(fit.views)[there.valid] @ field
    rms = float(np.sqrt((moved**2).sum(axis=1).mean())) if len(moved) else 0.0
    return ResidualField(float(nats), float(nats / max(cost, 1e-9)), rms, field)


def _system(fit: CameraFit, there: Projection, half: Flags) -> tuple[Floats, Floats, float]:
    """Normal equations of the field on some frames, all else eliminated, and those frames' cost [nats]."""
    views, names = fit.views, fit.names
    points = count_points(views, there, SCALE_PX, half)
    terms, normal = _terms_of(views)[points.rows], views.edges.normal[points.rows]
    field = np.concatenate((normal[:, :1] * terms, normal[:, 1:] * terms), axis=1)
    columns = np.concatenate((field, common_slopes(views, fit.state, there, names)[points.rows]), axis=1)
    matrix, right, *_ = eliminate_poses(views, fit.state, there, points, columns)
    own, rest = slice(field.shape[1]), slice(field.shape[1], None)
    precision = np.concatenate((np.full(len(names), 1e-9), MAP_SCATTER**-2.0, views.tape_scatter**-2.0))
    pull = precision * np.concatenate((np.zeros(len(names)), fit.state.offset, fit.state.tape))
    across, inner = matrix[own, rest], matrix[rest, rest] + np.diag(precision)
    cost = 0.5 * float((points.weight * there.residual[points.rows] ** 2).sum())
    return (
        eliminate(matrix[own, own], across, inner, matrix[rest, own]),
        eliminate(right[own], across, inner, right[rest] + pull),
        cost,
    )


def _terms_of(views: Views) -> Floats:
    """The terms at every edge point, whose places go from −1 to 1 across and down the picture."""
    optics, edges = views.optics, views.edges
    return _terms(2.0 * edges.column / optics.columns - 1.0, 2.0 * edges.row / optics.rows - 1.0)


def _terms(right: Floats, down: Floats) -> Floats:
    return np.stack([right**one * down**other for one, other in POWERS], axis=-1)


MATCHED_PX = 2.0
"""An edge that lies no farther from the map's is matched."""
FEWEST_MATCHED = 0.2
"""Frames of which a smaller share of edges is matched do not belong to these poses, or to this map."""
USUAL_MATCHED = 0.6
"""A smaller share is told."""
LIKELY = 0.4
"""A mistake that, undone, brings this share to the map is the cause where hardly any match as they are."""
ADVICE = (
    "check that frames and rows are the same instants, the map is the right one, heading is counter-clockwise in "
    "radians, and the pictures are not mirrored"
)


def matched_share(fit: CameraFit) -> float:
    """Share of edge points near markings that lie on the map's, as the fit has them."""
    there = project(fit.views, fit.state)
    matched = there.valid & (np.abs(there.residual) < MATCHED_PX)
    return float(matched.sum() / max(int(there.near.sum()), 1))


def check_match(name: str, fit: CameraFit, *, grey: bool = False) -> tuple[str, ...]:
    """Refuse frames that do not belong to the poses, with what would make them, or note that they match poorly.

    In grey pictures edges of yellow markings match nothing, so that a poor match says nothing of poses and map.
    """
    share = matched_share(fit)
    if share >= USUAL_MATCHED:
        return ()
    causes = {}
    for cause, change in MISTAKES.items():
        views = change(fit.views)
        mounting = views.optics.mounting
        start = neutral_state(views, {one: views.optics.neutral(one) for one in mounting})
        causes[cause] = matched_share(fit_camera(views, start, [one for one in FIRST if one in mounting], FAR))
    likely = max(causes, key=causes.__getitem__)
    problem = f"{name}: frames do not fit the poses: {100 * share:.0f} % of the markings' edges match at best"
    if causes[likely] > max(2.0 * share, LIKELY if share < FEWEST_MATCHED else USUAL_MATCHED):
        raise LogError(f"{problem}; {100 * causes[likely]:.0f} % match if {likely}; correct that")
    if share < FEWEST_MATCHED:
        raise LogError(f"{problem}; {ADVICE}")
    if grey:
        return ()
    usual = f"{100 * USUAL_MATCHED:.0f} % or more is usual"
    return (f"{100 * share:.0f} % of the markings' edges match ({usual}): poses or map are off by centimetres",)


def _mirrored(down: float) -> Callable[[Views], Views]:
    """Mirror pictures left to right, and top to bottom too where `down` is −1."""

    def turn(views: Views) -> Views:
        edges, optics = views.edges, views.optics
        column, row = optics.columns - edges.column, optics.rows - edges.row if down < 0.0 else edges.row
        return replace(views, edges=edges._replace(column=column, row=row, normal=edges.normal * (-1.0, down)))

    return turn


def _posed(change: Callable[[Floats], Floats]) -> Callable[[Views], Views]:
    return lambda views: replace(views, tracks=replace(views.tracks, poses=change(views.tracks.poses)))


MISTAKES: Mapping[str, Callable[[Views], Views]] = {
    "the pictures are mirrored": _mirrored(1.0),
    "the pictures are upside down": _mirrored(-1.0),
    "heading is clockwise": _posed(lambda poses: poses * (1.0, 1.0, -1.0)),
    "headings are in degrees": _posed(lambda poses: poses * (1.0, 1.0, np.radians(1.0))),
    "x and y are swapped": _posed(lambda poses: poses[:, (1, 0, 2)]),
    "each frame belongs to the next row": _posed(lambda poses: np.roll(poses, -1, axis=0)),
    "each frame belongs to the row before": _posed(lambda poses: np.roll(poses, 1, axis=0)),
}
"""Usual mistakes in logs, and what undoes each."""
ALWAYS: Mapping[str, str] = {
    "camera_yaw": "heading_offset",
    "camera_forward": "marker_offset",
    LATENCY: "clock offset",
}
"""Effects of the tracker that frames cannot tell from one of the camera."""


def hidden_effects(full: CameraFit, model: Sequence[str]) -> tuple[str, ...]:
    """Geometric effects that these frames could not show beside the model's, at their smallest usual size."""
    hidden = [] if full.views.tracks.moving else list(MOVING)
    kept = [name for name in full.names if effect_of(name) in model]
    for name in (one for one in full.names if one not in kept):
        # The standard deviation of a parameter that is free beside those kept, against its nearest probe.
        chosen = [full.names.index(one) for one in (*kept, name)]
        matrix = full.information[np.ix_(chosen, chosen)]
        sd = float(np.sqrt(np.linalg.pinv(matrix, rcond=1e-12)[-1, -1])) if matrix[-1, -1] > 0.0 else float("inf")
        parameter = full.views.optics.robot.catalogue.parameters[name]
        neutral = full.views.optics.neutral(name)
        away = (abs(probe - neutral) for probe in parameter.probes if probe != neutral)
        if 2.0 * sd > min(away, default=parameter.high):
            hidden.append(name)
    return effects_of(hidden)


def next_views(hidden: Sequence[str], *, repeated: bool) -> tuple[str, ...]:
    """Advise what to take to see what was hidden; repeated frames were taken standing still at one place."""
    views = []
    if {LATENCY, READOUT, "blur"} & set(hidden):
        views.append("frames while driving bends at 0.3 m/s and more, for what shows in motion alone")
    if {"camera_height", "camera_forward", "field_of_view", "pixel_aspect", "lens_centre"} & set(hidden):
        views.append("frames with markings nearer than 0.4 m and others far ahead, on straights and in bends")
    if {"camera_yaw", "camera_roll"} & set(hidden):
        views.append("frames from both lanes, driven both ways round")
    if "image_noise" in hidden and not repeated:
        views.append("ten frames standing still at one place, for the noise")
    return tuple(views)
