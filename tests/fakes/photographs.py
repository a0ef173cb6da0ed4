"""Frames of a textured floor as a camera with known faults logs them, and the measured frames of the nominal one."""

import functools

import numpy as np
import pandas as pd
import pytest
from nominal_camera import CAMERA
from PIL import Image
from project import ROOT
from scipy.ndimage import gaussian_filter

from proxytune.diagnosis.camera.light import squared_radius
from proxytune.driving import GroundPlaneCamera, draw_floor, ground_points, shipped_map
from proxytune.driving.road_picture import Floor

LOG = ROOT / "../shared/data/logs/gym_duckietown_frames"
REACH_M = 1.2
FRAMES = 100
needs_measured = pytest.mark.skipif(not LOG.is_dir(), reason=f"needs measured data in {LOG.parent.name}/{LOG.name}")


@functools.cache
def floor():
    points = ground_points(CAMERA)
    return np.isfinite(points[..., 0]) & (np.linalg.norm(points, axis=-1) < REACH_M)


def on_the_road(count=FRAMES, seed=0):
    """Poses round the loop, a quarter of a lane beside its middle and 15° askew."""
    rng, road = np.random.default_rng(seed), shipped_map("small_loop")
    starts = np.array(road.starts)[rng.integers(0, len(road.starts), count)]
    poses = starts * (1.0, 1.0, np.pi / 180.0) + rng.normal(size=(count, 3)) * (0.05, 0.05, 0.26)
    return poses


@functools.cache
def textured(seed=0):
    """The floor's picture with grain as fine as its pixels, 6 %, and stains of 5 cm, 8 %."""
    plain, rng = draw_floor(shipped_map("small_loop")), np.random.default_rng(seed)
    side = len(plain.pixels)
    stains = gaussian_filter(rng.normal(size=(side, side)), 10.0)
    texture = 0.06 * rng.normal(size=(side, side)) + 0.08 * stains / stains.std()
    pixels = np.clip(np.rint(plain.pixels * (1.0 + texture[..., None])), 0, 255).astype(np.uint8)
    return Floor(pixels, plain.pixels_per_metre, plain.origin)


def drawn(poses, picture=None):
    picture = picture or draw_floor(shipped_map("small_loop"))
    return GroundPlaneCamera(CAMERA, picture).render(poses).astype(np.float32)


def photographed(poses, seed=0):
    """The textured floor, from poses that are 3 mm and 0.5° off."""
    off = np.random.default_rng(seed).normal(size=poses.shape) * (0.003, 0.003, 0.009)
    return drawn(poses + off, textured(seed))


def logged(pictures, gain=1.0, gamma=1.0, vignetting=0.0, drift=0.0, noise=0.0, seed=0):
    rng = np.random.default_rng(seed)
    shade = 1.0 - vignetting * squared_radius(CAMERA.rows, CAMERA.columns)
    levels = gain * np.exp(drift * rng.normal(size=len(pictures)))
    grey = 255.0 * levels[:, None, None, None] * (pictures * shade[..., None] / 255.0) ** gamma
    return np.clip(np.rint(grey + noise * rng.normal(size=grey.shape)), 0, 255).astype(np.uint8)


@functools.cache
def measured():
    return np.stack([np.asarray(Image.open(file).convert("RGB")) for file in sorted((LOG / "frames").glob("*.png"))])


@functools.cache
def predicted():
    return drawn(pd.read_csv(LOG / "samples.csv")[["x", "y", "heading"]].to_numpy())


@functools.cache
def scene():
    """What the model draws, and the photographs of the same places."""
    poses = on_the_road()
    return drawn(poses), photographed(poses)
