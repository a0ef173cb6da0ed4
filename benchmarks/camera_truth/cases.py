"""The cases of blind sets: what is wrong with the camera, and how the set was taken; all else is drawn from the seed.

A case is written as effects joined by "+" and maybe settings: "camera_roll", "camera_roll+blur horseshoe 20mm_tape".
"""

import itertools
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any
from zlib import crc32

import numpy as np

from camera_truth.lens import BENDS
from camera_truth.sight import COLUMNS, ROWS, Bend, Bumper, Sight, Spot

Random = np.random.Generator
Change = Callable[[Random], Mapping[str, Any]]
"""Draws the figures of Sight that a case sets."""


def _either(random: Random, low: float, high: float) -> float:
    """Between low and high, to either side."""
    return float(random.choice((-1.0, 1.0)) * random.uniform(low, high))


def _distortion(random: Random) -> Mapping[str, Any]:
    barrel = random.random() < 0.7
    return {"lens_distortion": float(random.uniform(-0.3, -0.08) if barrel else random.uniform(0.05, 0.15))}


def _centre(random: Random) -> Mapping[str, Any]:
    return {str(random.choice(("centre_right", "centre_down"))): _either(random, 0.04, 0.12)}


def _aspect(random: Random) -> Mapping[str, Any]:
    return {"pixel_aspect": float(random.choice((random.uniform(0.88, 0.95), random.uniform(1.05, 1.12))))}


def _exposure(random: Random) -> Mapping[str, Any]:
    return {"gain": float(random.uniform(0.7, 1.4)), "gamma": float(random.uniform(0.7, 1.5))}


def _dirt(random: Random) -> Mapping[str, Any]:
    spots = tuple(
        Spot(
            column=float(random.uniform(0.1, 0.9) * COLUMNS),
            row=float(random.uniform(0.4, 0.95) * ROWS),
            radius_px=float(random.uniform(10.0, 30.0) / 2.0),
            opacity=float(random.uniform(0.4, 0.9)),
            grey=float(random.uniform(20.0, 160.0)),
        )
        for _ in range(random.integers(2, 6))
    )
    return {"dirt": spots}


def _bumper(random: Random) -> Mapping[str, Any]:
    grey = float(random.choice((random.uniform(5.0, 40.0), random.uniform(140.0, 230.0))))
    return {"bumper": Bumper(float(random.uniform(8.0, 25.0)), float(random.uniform(0.0, 10.0)), grey)}


def _bend(random: Random) -> Mapping[str, Any]:
    form = str(random.choice(tuple(BENDS)))
    return {"bend": Bend(form, float(random.uniform(2.0, 4.0)), float(random.uniform(0.0, 6.28)))}


GEOMETRIC: Mapping[str, Change] = {
    "camera_roll": lambda random: {"camera_roll": _either(random, 2.0, 6.0)},
    "camera_yaw": lambda random: {"camera_yaw": _either(random, 2.0, 8.0)},
    "camera_height": lambda random: {"camera_height": 0.108 + _either(random, 0.006, 0.025)},
    "field_of_view": lambda random: {"field_of_view": 75.0 + _either(random, 3.0, 12.0)},
    "lens_distortion": _distortion,
    "camera_forward": lambda random: {"camera_forward": 0.066 + _either(random, 0.010, 0.040)},
    "lens_centre": _centre,
    "pixel_aspect": _aspect,
}
TIMED: Mapping[str, Change] = {
    "camera_latency": lambda random: {"camera_latency": float(random.uniform(0.04, 0.2))},
    "rolling_shutter": lambda random: {"rolling_shutter": float(random.uniform(0.03, 0.08))},
    "blur": lambda random: {"blur": float(random.uniform(0.04, 0.12))},
}
LIGHT: Mapping[str, Change] = {
    "defocus": lambda random: {"defocus": float(random.uniform(0.008, 0.02))},
    "vignetting": lambda random: {"vignetting": float(random.uniform(0.2, 0.5))},
    "exposure": _exposure,
    "image_noise": lambda random: {"image_noise": float(random.uniform(3.0, 12.0))},
}
OUTSIDE: Mapping[str, Change] = {"bent_lens": _bend, "dirt": _dirt, "bumper": _bumper}
DECLARED: Mapping[str, Change] = {"camera_pitch": lambda random: {"camera_pitch": 19.15 + _either(random, 2.0, 8.0)}}
CHANGES: Mapping[str, Change] = {**DECLARED, **GEOMETRIC, **TIMED, **LIGHT, **OUTSIDE}

PAIRS = tuple("+".join(pair) for pair in itertools.combinations(GEOMETRIC, 2))
CASES = ("none", *CHANGES, *PAIRS)

POSES = {"exact": (0.0, 0.0), "5mm": (0.005, 1.0), "10mm": (0.010, 2.0)}
"""Scatter of measured poses [m], [deg]."""

TAPE = {"5mm_tape": 0.005, "20mm_tape": 0.02}


@dataclass(frozen=True)
class Case:
    """A case with everything that is not drawn frame by frame."""

    name: str  # as it was asked for
    seed: int  # of all that is random
    effects: tuple[str, ...]  # what is wrong with the camera, by the names of CHANGES
    sight: Sight  # the camera
    moves: bool  # whether the frames are of drives
    road: str  # name of the map
    tape_m: float  # how far lines lie from their places [m]: standard deviation, or the largest for 20 mm
    scatter: str  # of measured poses, key of POSES
    plain: bool  # whether the floor is drawn as the package draws it
    walls: bool  # whether there are walls above the horizon, or the sky
    fixed: bool  # whether all frames are exposed alike
    quality: int  # of JPEG, 0 for PNG
    noise: float  # of the sensor, whatever the case [grey levels]

    @property
    def seeds(self) -> np.random.SeedSequence:
        """Of all that is drawn besides what is here."""
        return _seeds(self.name.split()[0], self.seed)


WORDS = ("still", "drive", "small_loop", "horseshoe", "plain", "sky", "walls", "fixed", "auto", *POSES, *TAPE)
"""The settings that a case may state."""


def draw_case(name: str, seed: int) -> Case:
    """The case of this name and seed.

    Raises:
        ValueError: If no case has this name.
    """
    what, *words = name.split()
    effects = () if what == "none" else tuple(what.split("+"))
    if unknown := [word for word in (*effects, *words) if word not in (*CHANGES, *WORDS)]:
        raise ValueError(f"no case '{unknown[0]}'; effects: {', '.join(CHANGES)}; settings: {', '.join(WORDS)}")
    random = np.random.default_rng(_seeds(what, seed))
    sight = Sight()
    for effect in effects:
        sight = replace(sight, **CHANGES[effect](random))
    drawn = _settings(effects, random)
    return Case(name, seed, effects, sight, **{**drawn, **_stated(words)})


def _seeds(what: str, seed: int) -> np.random.SeedSequence:
    return np.random.SeedSequence((seed, crc32(what.encode())))


def _settings(effects: tuple[str, ...], random: Random) -> dict[str, Any]:
    """How the set was taken, where the case states nothing."""
    chance = random.random(7)
    return {
        "moves": bool(set(effects) & set(TIMED) or (chance[0] < 0.3 and not set(effects) & set(LIGHT))),
        "road": "horseshoe" if chance[1] < 0.2 else "small_loop",
        "tape_m": 0.02 if chance[2] < 0.2 else 0.005,
        "scatter": "5mm" if chance[3] < 0.6 else "exact" if chance[3] < 0.8 else "10mm",
        "plain": False,
        "walls": bool(chance[4] < 0.5),
        "fixed": bool(chance[5] < 0.5) or "exposure" in effects,
        "quality": 0 if chance[6] < 0.25 else int(random.integers(50, 96)),
        "noise": 0.0 if "image_noise" in effects else float(random.uniform(0.5, 1.5)),
    }


def _stated(words: list[str]) -> dict[str, Any]:
    """What the words of a case say."""
    meaning: dict[str, dict[str, Any]] = {
        "still": {"moves": False},
        "drive": {"moves": True},
        "small_loop": {"road": "small_loop"},
        "horseshoe": {"road": "horseshoe"},
        "plain": {"plain": True, "walls": False, "fixed": True, "quality": 0, "noise": 0.0},
        "sky": {"walls": False},
        "walls": {"walls": True},
        "fixed": {"fixed": True},
        "auto": {"fixed": False},
        **{word: {"scatter": word} for word in POSES},
        **{word: {"tape_m": tape_m} for word, tape_m in TAPE.items()},
    }
    return {key: value for word in words for key, value in meaning[word].items()}
