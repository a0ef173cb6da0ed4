"""The model of a camera on a map: edge points projected to the floor, and pictures drawn.

`project` gives the signed distance r of every edge point from the nearest marking of its colour [pixel]; the `…_slopes`
are ∂r by camera, pose, map and tape. `draw_pictures` draws what a model would have seen at a log's poses, with every
effect on camera and picture.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from proxytune.arrays import Flags, Floats
from proxytune.diagnosis.camera.edges import LATENCY, READOUT, Views
from proxytune.driving import LINES, CameraFigures, GroundPlaneCamera, Marks, draw_floor, floor_points
from proxytune.effects import FilterContext, Stage, effects_from, stage_chain

FARTHEST_M = 1.2
"""Edges farther ahead of the lens are too coarse to count [m]."""
NARROWEST_PX = 2.5
"""A marking must be wider in the picture, else its two edges are one [pixel]."""
ALIGNED = 0.5
"""The map's edge must run within 60° of the picture's, bright on the same side: this is the cosine."""


@dataclass(frozen=True)
class State:
    """What places an edge point: θ of the camera, errors of the `Tape` [m], offsets of map (3,) and poses (N, 3)."""

    theta: Mapping[str, float]
    tape: Floats
    offset: Floats
    poses: Floats


class Projection(NamedTuple):
    """Edge points on the floor (n), and the nearest markings of the map."""

    residual: Floats  # distance of the marking [pixel]
    near: Flags  # whether it is on the floor, near enough, by a marking wide enough
    valid: Flags  # whether besides the map's edge runs as the picture's does
    slope: Floats  # change of the residual with the place on the floor (n, 2) [pixel/m]
    lever: Floats  # from the robot to the place, in the world (n, 2) [m]
    place: Floats  # in the world (n, 2) [m]
    heading: Floats  # of the robot [rad]
    metres: Floats  # of a pixel on the floor along the edge's normal
    marks: Marks
    rates: Floats  # of the robot's pose (n, 3)


def neutral_state(views: Views, theta: Mapping[str, float]) -> State:
    """Tape, map and poses as they are said to be."""
    return State(theta, np.zeros(views.tape.size), np.zeros(3), np.zeros((views.count, 3)))


def project(views: Views, state: State) -> Projection:
    """Project every edge point to the floor and compare it with the map."""
    edges, figures = views.edges, views.optics.figures(state.theta)
    poses, rates = views.tracks.at(state.theta.get(LATENCY, 0.0))
    poses, rates = (each[edges.frame] for each in (poses + state.poses, rates))
    poses = poses + rates * (_row_share(views) * state.theta.get(READOUT, 0.0))[:, None]
    ground = [_ground(figures, views, half) for half in (0.0, 0.5, -0.5)]
    places = [(poses[:, :2] + _turned(points, poses[:, 2])) for points in ground]
    across = places[1] - places[2]
    on_floor = np.asarray(np.isfinite(across).all(axis=1) & np.isfinite(places[0]).all(axis=1))
    place, across = (np.where(on_floor[:, None], each, 1.0) for each in (places[0], across))
    metres = np.linalg.norm(across, axis=1)
    marks = _marks(views, place, state.offset)
    reach = np.linalg.norm(np.where(on_floor[:, None], ground[0], np.inf) - (figures.forward_m, 0.0), axis=1)
    paint = views.markings.road.paint
    wide = np.where(edges.white, paint.white_width, paint.yellow_width) / metres > NARROWEST_PX
    near = on_floor & (reach < FARTHEST_M) & wide
    outward = _turned(marks.slope, state.offset[2])
    aligned = -(outward * across).sum(axis=1) / metres > ALIGNED
    tape = views.tape
    shift = state.tape[tape.shift(marks.stretch, marks.line)]
    shift = shift + state.tape[tape.tilt(marks.stretch, marks.line)] * _askew(marks)
    shift = marks.side * shift - 0.5 * state.tape[tape.width(edges.white, marks.line)]
    residual = (marks.distance + shift) / metres
    slope = outward / metres[:, None]
    lever = place - poses[:, :2]
    return Projection(residual, near, near & aligned, slope, lever, place, poses[:, 2], metres, marks, rates)


def camera_slopes(views: Views, state: State, there: Projection, names: Sequence[str]) -> Floats:
    """Slopes of the residuals by parameters of the camera (n, names)."""
    points = _ground(views.optics.figures(state.theta), views, 0.0)
    ahead = _turned(there.slope, -there.heading)
    columns = []
    for name in names:
        if name in (LATENCY, READOUT):
            motion = (pose_slopes(there) * there.rates).sum(axis=1)
            columns.append(-motion if name == LATENCY else motion * _row_share(views))
            continue
        step = views.optics.step(name, state.theta[name])
        moved = views.optics.figures({**state.theta, name: state.theta[name] + step})
        change = np.nan_to_num((_ground(moved, views, 0.0) - points) / step)
        columns.append((ahead * change).sum(axis=1))
    return np.stack(columns, axis=-1) if columns else np.zeros((len(points), 0))


def pose_slopes(there: Projection) -> Floats:
    """Slopes of the residuals by the robot's x, y and heading (n, 3)."""
    slope, lever = there.slope, there.lever
    return np.column_stack((slope, slope[:, 1] * lever[:, 0] - slope[:, 0] * lever[:, 1]))


def map_slopes(views: Views, state: State, there: Projection) -> Floats:
    """Slopes by the whole map's x, y and heading about its middle (n, 3)."""
    from_middle = there.place - state.offset[:2] - np.array(views.markings.road.size) / 2.0
    turning = there.slope[:, 0] * from_middle[:, 1] - there.slope[:, 1] * from_middle[:, 0]
    return np.column_stack((-there.slope, turning))


def tape_slopes(views: Views, there: Projection) -> tuple[tuple[NDArray[np.intp], Floats], ...]:
    """Slopes by the tape: places in the row of `Tape` and slopes (n,), for shift, tilt and width."""
    tape, marks = views.tape, there.marks
    across = marks.side / there.metres
    return (
        (tape.shift(marks.stretch, marks.line), across),
        (tape.tilt(marks.stretch, marks.line), across * _askew(marks)),
        (tape.width(views.edges.white, marks.line), -0.5 / there.metres),
    )


def _askew(marks: Marks) -> Floats:
    """From −1 at a stretch's beginning to 1 at its end; the ends of dashes move as one."""
    return np.where(marks.line == len(LINES) - 1, 0.0, 2.0 * marks.share - 1.0)


def _row_share(views: Views) -> Floats:
    """Distance of each point below the picture's middle, as a share of its height: rows are read from the top."""
    return views.edges.row / views.optics.rows - 0.5


def _ground(figures: CameraFigures, views: Views, along: float) -> Floats:
    """Floor points (n, 2) in the robot's frame, of edge points moved along their normals [pixel]."""
    edges = views.edges
    return floor_points(figures, edges.column + along * edges.normal[:, 0], edges.row + along * edges.normal[:, 1])


def _turned(vectors: Floats, angle: Floats | float) -> Floats:
    cos, sin = np.cos(angle), np.sin(angle)
    x, y = vectors[:, 0], vectors[:, 1]
    return np.stack((cos * x - sin * y, sin * x + cos * y), axis=-1)


def _marks(views: Views, places: Floats, offset: Floats) -> Marks:
    """The nearest markings of each point's colour, on a map that lies `offset` off."""
    middle, white = np.array(views.markings.road.size) / 2.0, views.edges.white
    own = _turned(places - offset[:2] - middle, -offset[2]) + middle
    merged = []
    for one, other in zip(views.markings.white(own[white]), views.markings.yellow(own[~white]), strict=True):
        both = np.empty((len(white), *one.shape[1:]), dtype=one.dtype)
        both[white], both[~white] = one, other
        merged.append(both)
    return Marks._make(merged)


Pictures = NDArray[np.float32]

BLUR = "blur"
NOISE = "image_noise"
TIMED = (LATENCY, READOUT, BLUR)
"""Effects that say when a picture is taken: they are drawn by moving the camera."""
SHOTS = 9
"""Pictures that the mean over an exposure is taken of; as many instants of a rolling shutter."""


def draw_pictures(views: Views, state: State, theta: Mapping[str, float], frames: NDArray[np.intp]) -> Pictures:
    """Draw what a model would have seen in some frames: red, green and blue (n, rows, columns, 3), 0 to 255.

    θ is of effects on pictures; noise is left out, since no model knows it.
    """
    camera = GroundPlaneCamera(views.optics.figures(state.theta), draw_floor(views.markings.road))
    poses, rates = (each[frames] for each in views.tracks.at(state.theta.get(LATENCY, 0.0)))
    poses = poses + state.poses[frames]
    readout, blur = theta.get(READOUT, state.theta.get(READOUT, 0.0)), theta.get(BLUR, 0.0)
    if np.any(rates) and readout != 0.0:
        instants = (np.arange(SHOTS) / (SHOTS - 1) - 0.5) * readout
        shots = np.stack([_exposed(camera, poses + late * rates, rates, blur) for late in instants])
        # Each row is of the instant at which it is read out
        row = np.arange(shots.shape[2])
        when = (row + 0.5) / len(row) * (SHOTS - 1)
        first = np.clip(np.floor(when).astype(int), 0, SHOTS - 2)
        share = (when - first)[:, None, None, None].astype(np.float32)
        mixed = (1.0 - share) * shots[first, :, row] + share * shots[first + 1, :, row]
        return _develop(views, theta, np.moveaxis(mixed, 0, 1))
    return _develop(views, theta, _exposed(camera, poses, rates, blur))


def _exposed(camera: GroundPlaneCamera, poses: Floats, rates: Floats, blur_s: float) -> Pictures:
    """The mean over an exposure about the poses' instants."""
    if blur_s == 0.0 or not np.any(rates):
        return camera.render(poses).astype(np.float32)
    total = np.zeros((), dtype=np.float32)
    for late in ((np.arange(SHOTS) + 0.5) / SHOTS - 0.5) * blur_s:
        total = total + camera.render(poses + late * rates).astype(np.float32)
    return np.asarray(total / SHOTS, dtype=np.float32)


def _develop(views: Views, theta: Mapping[str, float], pictures: Pictures) -> Pictures:
    """Apply the effects on pictures that have nothing to do with time."""
    robot, optics = views.optics.robot, views.optics
    own = {name: value for name, value in theta.items() if name not in (*TIMED, NOISE)}
    chain = stage_chain(effects_from(own, robot.figures, robot.catalogue), Stage.IMAGE)
    if not chain.effects:
        return pictures
    figures = {**robot.figures, "camera_columns": float(optics.columns), "camera_rows": float(optics.rows)}
    signal = pictures.reshape(len(pictures), 1, -1)
    developed, _ = chain.apply(signal, chain.begin(FilterContext(60.0, signal[:, 0], figures)))
    return np.clip(developed, 0.0, 255.0).reshape(pictures.shape).astype(np.float32)
