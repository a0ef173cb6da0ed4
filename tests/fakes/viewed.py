"""Views of the small loop, still or driven, by a camera with known faults, and their edge points."""

import functools
from dataclasses import replace

import numpy as np
from pictured import ROAD, ROBOT, lane_poses, pictures

from proxytune.diagnosis.camera.edges import MOVING, Optics, Tracks, Views, find_edges
from proxytune.diagnosis.camera.model import draw_pictures, neutral_state
from proxytune.diagnosis.camera.selection import fit_everything
from proxytune.driving import Markings, lane_length, lane_point

OPTICS = Optics(ROBOT, 120, 160)
MARKINGS = Markings(ROAD)
SCATTER = (0.003, np.radians(0.5))
NEUTRAL = {name: OPTICS.neutral(name) for name in (*OPTICS.mounting, *MOVING)}
EVERY = 2


def still(poses):
    instants = np.arange(float(len(poses)))
    return Tracks(instants, poses, np.zeros_like(poses), instants, instants, 1.0)


def tracked(poses, seed=2, scatter=SCATTER):
    """Poses as a tracker has them."""
    place, turn = scatter
    return poses + np.random.default_rng(seed).normal(size=poses.shape) * (place, place, turn)


def views_of(shown, tracks, scatter=SCATTER, tape_m=0.001, markings=MARKINGS):
    edges = find_edges(shown)
    edges = edges.only(np.arange(len(edges.row)) % EVERY == 0)
    optics = replace(OPTICS, rows=shown.shape[1], columns=shown.shape[2])
    return Views(edges, tracks, markings, optics, *scatter, tape_m)


@functools.cache
def _stood(theta, count, seed, noisy):
    poses = lane_poses(count, seed)
    tracks = still(tracked(poses) if noisy else poses)
    return views_of(pictures(dict(theta), poses), tracks, SCATTER if noisy else (0.0, 0.0))


def stood(theta=None, count=50, seed=1, noisy=True):
    """Views standing still; the poses are 3 mm and 0.5° off, or exact."""
    return _stood(tuple(sorted((theta or {}).items())), count, seed, noisy)


@functools.cache
def drive(count=60, period_s=0.6):
    """Tracks of a weaving drive round the outer lane: exact poses 20 times a second, and their rates."""
    times = np.arange(0.0, count * period_s + 2.0, 0.05)
    along = 0.3 * times + 0.1 * np.sin(times)
    lap, ahead = lane_length(ROAD, True), 0.01
    places = lane_point(ROAD, True, along % lap)
    way = lane_point(ROAD, True, (along + ahead) % lap) - lane_point(ROAD, True, (along - ahead) % lap)
    course = np.unwrap(np.arctan2(way[:, 1], way[:, 0]))
    aside = 0.03 * np.sin(2.0 * along)
    places = places + aside[:, None] * np.stack((-np.sin(course), np.cos(course)), axis=-1)
    heading = course + np.arctan(0.06 * np.cos(2.0 * along))
    poses = np.column_stack((places, heading))
    instants = 1.0 + np.arange(count) * period_s
    return Tracks(times, poses, np.gradient(poses, times, axis=0), instants, np.zeros(count), 1.0)


@functools.cache
def _driven(theta, count):
    tracks, timed = drive(count), dict(theta)
    scene = replace(stood(count=1), tracks=tracks)
    shown = draw_pictures(scene, neutral_state(scene, NEUTRAL | timed), {}, np.arange(count))
    return views_of(np.rint(shown).astype(np.uint8), tracks, (0.001, np.radians(0.2)))


def driven(theta=None, count=40):
    """Views from a drive, drawn by the model itself: latency and rolling shutter among the faults."""
    return _driven(tuple(sorted((theta or {}).items())), count)


@functools.cache
def _everything(theta, count, moving):
    views = driven(dict(theta), count) if moving else stood(dict(theta), count)
    return fit_everything(views, (*OPTICS.mounting, *(MOVING if moving else ())), {}, learn_scatter=False)


def everything(theta=None, count=50, moving=False):
    """The fit of all parameters."""
    return _everything(tuple(sorted((theta or {}).items())), count, moving)


def at_truth(views, theta=None):
    return neutral_state(views, NEUTRAL | (theta or {}))


def pushed(views, by):
    """Views whose edge points lie so far along their normals (n,) [pixel]."""
    edges = views.edges
    return replace(
        views,
        edges=edges._replace(column=edges.column + by * edges.normal[:, 0], row=edges.row + by * edges.normal[:, 1]),
    )
