"""What a log's frames say of a robot's camera."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from proxytune.diagnosis.camera.error.unseen import PictureError
from proxytune.diagnosis.camera.gathering import Gathered
from proxytune.diagnosis.camera.look.blemishes import Blemish
from proxytune.diagnosis.camera.naming.choice import Subset
from proxytune.diagnosis.camera.naming.gate import Leftover
from proxytune.diagnosis.camera.naming.search import Named
from proxytune.diagnosis.result import Estimate

Floats = NDArray[np.float64]

TWO_SIDED = 1.96
"""Standard deviations on either side of a 95 % interval."""


@dataclass(frozen=True)
class CameraEffect:
    """An effect on the camera or its pictures that the model lacked.

    Attributes:
        effect: Its name.
        names: Its parameters by name in θ.
        nats: What leaving it out costs, None for what shows in brightness or sharpness.
        error_without: Error on unseen frames without it over the error with it; None for noise, which no
            model predicts.
        rivals: Effects, the tracker's among them, that explain the same pictures.
    """

    effect: str
    names: tuple[str, ...]
    nats: float | None
    error_without: float | None
    rivals: tuple[str, ...]


@dataclass(frozen=True)
class Comparison:
    """Errors on unseen frames.

    Attributes:
        before: Of the declared model.
        after: Of the model with the effects that were found.
        floor: Of the most flexible camera there is, what no camera could remove; None where none is known.
        unit: "px" or "grey levels".
    """

    before: PictureError
    after: PictureError
    floor: PictureError | None
    unit: str


@dataclass(frozen=True)
class LaidLine:
    """A line that lies beside its place on the map.

    Attributes:
        line: Which, as in "left white line".
        stretch: On which of the road's segments, from 0.
        right_m: How far to the right of its place, seen driving counter-clockwise; dashes: how far ahead [m].
        interval: 95 % [m].
    """

    line: str
    stretch: int
    right_m: float
    interval: tuple[float, float]


@dataclass(frozen=True)
class LaidMap:
    """How the map was laid.

    Attributes:
        offset: Of the whole map by name: x_m, y_m, heading_deg.
        lines: Lines that lie measurably beside their places, the farthest first.
        widths: How much wider lines and dashes are [m], by what they are.
    """

    offset: Mapping[str, Estimate]
    lines: tuple[LaidLine, ...]
    widths: Mapping[str, Estimate]


@dataclass(frozen=True)
class CameraDiagnosis:
    """What frames say of a camera.

    Attributes:
        verdict: As a diagnosis of motion has it.
        declared: Declared parameters, fitted without any other effect, by name in θ.
        theta: All parameters of the extended model, by name in θ.
        effects: The effects that were added.
        immaterial: Effects that there is evidence for, and which hardly change the error: no part of the model.
        dropped: Parameters of those effects, as they were fitted before they were dropped, by name in θ.
        candidates: What each effect of the catalogue costs if it is the only one added [nats], the best first.
        pixels: Displacement of markings.
        grey: Differences in brightness on the floor.
        gates: What is fixed to the camera and left over, before and after.
        blemishes: Places in the picture that no camera effect explains: dirt, a bumper in view.
        could_not_be_seen: Effects that these frames could not have shown.
        next_views: What to take to tell what could not be told.
        laid: How the map was laid.
        matched: Share of the markings' edges that lie within 2 pixels of the map's.
        notes: What else is to be known, a line each.
        named: All fits.
        gathered: All frames that were used.
    """

    verdict: str
    declared: Mapping[str, Estimate]
    theta: Mapping[str, Estimate]
    effects: tuple[CameraEffect, ...]
    immaterial: tuple[CameraEffect, ...]
    dropped: Mapping[str, Estimate]
    candidates: Sequence[Subset]
    pixels: Comparison
    grey: Comparison
    gates: tuple[Leftover, Leftover]
    blemishes: tuple[Blemish, ...]
    could_not_be_seen: tuple[str, ...]
    next_views: tuple[str, ...]
    laid: LaidMap
    matched: float
    notes: tuple[str, ...]
    named: Named
    gathered: Gathered


def interval_of(value: float, sd: float) -> tuple[float, float]:
    """The 95 % interval of a value with this standard deviation."""
    return float(value - TWO_SIDED * sd), float(value + TWO_SIDED * sd)


def estimate_of(value: float, sd: float, unit: str) -> Estimate:
    """A value with this standard deviation as an estimate."""
    return Estimate(float(value), interval_of(value, sd), unit)
