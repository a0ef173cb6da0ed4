"""A floor as a photograph would have it: worn paint on grained asphalt, stained and unevenly lit."""

import math

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter, zoom

from camera_truth.tape import Tape, lay_tape, line_distances
from proxytune.driving import COLOURS, Road
from proxytune.driving.road_picture import MARGIN, Floor

PIXELS_PER_METRE = 600
STRIP = 64

Values = NDArray[np.float64]


def photographed_floor(road: Road, tape_m: float, random: np.random.Generator) -> Floor:
    """Draw a map with lines so far from their places [m]."""
    longest = max(road.size)
    side = MARGIN * math.ceil(longest * PIXELS_PER_METRE / MARGIN + 2.0)
    origin = (longest - side / PIXELS_PER_METRE) / 2.0
    places = origin + (np.arange(side) + 0.5) / PIXELS_PER_METRE
    tape = lay_tape(road, tape_m, random)
    worn = _wear(side, random)
    shades = _shades(road, random)
    picture = np.empty((side, side, 3))
    for first in range(0, side, STRIP):
        rows = slice(first, first + STRIP)
        positions = np.stack(np.meshgrid(places, places[rows]), axis=-1)
        picture[rows] = _painted(road, tape, positions, worn[rows], shades)
    lit = picture * (_grain(side, random) * _light(places, random))[..., None]
    return Floor(np.rint(np.clip(lit, 0.0, 255.0)).astype(np.uint8), PIXELS_PER_METRE, origin)


def _shades(road: Road, random: np.random.Generator) -> dict[str, Values]:
    """Colours (tiles, 3): those of the map's paint, up to 15 % lighter or darker, and uneven from tile to tile."""
    tiles = len(road.segments)
    return {
        name: np.array(colour)
        * random.uniform(0.85, 1.15)
        * random.uniform(0.96, 1.04, 3)
        * random.normal(1.0, 0.03, (tiles, 1))
        for name, colour in COLOURS.items()
    }


def _painted(road: Road, tape: Tape, positions: Values, worn: Values, shades: dict[str, Values]) -> Values:
    white, yellow, tile = line_distances(road, tape, positions)
    half = np.array(road.size) / 2.0
    asphalt = (np.abs(positions - half) - half).max(axis=-1)
    picture = shades["off_map"][tile]
    for name, distance in (("asphalt", asphalt), ("white", white), ("yellow", yellow)):
        cover = np.clip(0.5 - distance * PIXELS_PER_METRE, 0.0, 1.0)
        cover = cover if name == "asphalt" else cover * worn
        picture = picture + cover[..., None] * (shades[name][tile] - picture)
    return picture


def _wear(side: int, random: np.random.Generator) -> Values:
    """How much of the paint is left: most of it, less in blots."""
    blots = noise(side, 0.03, random) + 0.5 * noise(side, 0.006, random)
    return 1.0 - random.uniform(0.1, 0.5) * np.clip(blots - 1.2, 0.0, 1.0)


def _grain(side: int, random: np.random.Generator) -> Values:
    """Asphalt's brightness over its mean: grain, patches and a few stains."""
    strength = random.uniform(0.5, 1.3)
    parts = ((0.0, 0.05), (0.008, 0.04), (0.05, 0.04), (0.25, 0.05))
    grain = sum(share * noise(side, scale_m, random) for scale_m, share in parts)
    stains = np.clip(noise(side, 0.08, random) - 1.6, 0.0, 1.0) * random.uniform(-0.4, 0.4)
    return np.clip(1.0 + strength * grain + stains, 0.3, 1.7)


def _light(places: Values, random: np.random.Generator) -> Values:
    """Brightness of the light: smooth over the map, with up to three soft shadow edges."""
    smooth = noise(len(places), 0.7, random)
    light = 1.0 + random.uniform(0.05, 0.25) * smooth / np.abs(smooth).max()
    x, y = np.meshgrid(places, places)
    for _ in range(random.integers(0, 4)):
        angle, place = random.uniform(0.0, 2.0 * np.pi), random.uniform(places[0], places[-1], 2)
        beyond = (x - place[0]) * np.cos(angle) + (y - place[1]) * np.sin(angle)
        soft = np.clip(beyond / random.uniform(0.01, 0.06), -30.0, 30.0)
        light *= 1.0 - random.uniform(0.1, 0.35) / (1.0 + np.exp(soft))
    return light


def noise(side: int, scale_m: float, random: np.random.Generator) -> Values:
    """A field (side, side) of mean 0 and standard deviation 1; its values are alike over so many metres."""
    step = scale_m * PIXELS_PER_METRE
    if step < 2.0:
        field = gaussian_filter(random.normal(size=(side, side)), 0.7)
    else:
        coarse = random.normal(size=(math.ceil(side / step) + 3,) * 2)
        field = zoom(coarse, step, order=2 if step < 50.0 else 3)[:side, :side]
    return np.asarray((field - field.mean()) / field.std())
