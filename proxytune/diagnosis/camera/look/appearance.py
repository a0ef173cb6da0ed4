"""How a camera's pictures look besides where things are in them: brightness, sharpness, noise and blemishes."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from proxytune.diagnosis.camera.gathering import Gathered
from proxytune.diagnosis.camera.look.blemishes import Blemish, find_blemishes
from proxytune.diagnosis.camera.look.grain import Grain, fit_grain
from proxytune.diagnosis.camera.look.light import Fitted, Light, fit_light
from proxytune.diagnosis.camera.look.sharpness import Edges, Sharpness, fit_sharpness
from proxytune.diagnosis.camera.model.drawing import BLUR, NOISE, draw_pictures
from proxytune.diagnosis.camera.model.fitting import CameraFit
from proxytune.diagnosis.camera.model.projection import pose_slopes, project
from proxytune.driving.cameras import ground_points
from proxytune.effects import PARAMETERS, effect_of

SHARP_PX = 2.0
"""Edges that lie farther from the map's are not those that the model draws."""

HORIZON_ROWS = 3
"""So many rows beneath the horizon are left out: what a pixel covers there is a metre long."""


@dataclass(frozen=True)
class Appearance:
    """What the pictures' look says.

    Attributes:
        light: Exposure and vignetting.
        grain: Noise.
        sharpness: Blur and defocus.
        blemishes: What is fixed to the camera in its pictures.
    """

    light: Light
    grain: Grain
    sharpness: Sharpness
    blemishes: tuple[Blemish, ...]

    @property
    def figures(self) -> Mapping[str, Fitted]:
        """Every figure by its name in θ."""
        return {
            "vignetting": self.light.vignetting,
            "exposure.gain": self.light.gain,
            "exposure.gamma": self.light.gamma,
            "image_noise": self.grain.noise,
            "defocus": self.sharpness.defocus,
            "blur": self.sharpness.blur,
        }


LEAST: Mapping[str, float] = {
    "vignetting": 0.05,
    "exposure.gain": 0.08,
    "exposure.gamma": 0.1,
    "image_noise": 2.0,
    "defocus": 0.006,
    "blur": 0.01,
}
"""How far from its neutral value a figure must lie to matter for what an agent sees."""

NARROW = 0.12
"""Half of an interval of gain or gamma that is found only where every paint is as declared."""


def look_at(gathered: Gathered, fit: CameraFit) -> Appearance:
    """Fit the look of a log's pictures to a fitted camera's."""
    every = np.arange(fit.views.count)
    drawn = draw_pictures(fit.views, fit.state, {}, every)
    floor = floor_pixels(fit)
    light = fit_light(gathered.pictures, drawn, floor, gathered.frames.fixed_exposure)
    sharpness = fit_sharpness(
        gathered.pictures,
        _sharp_edges(fit),
        lambda blur, defocus: light.shine(draw_pictures(fit.views, fit.state, _soft(blur, defocus), every)),
    )
    grain = fit_grain(gathered.pictures, drawn, floor)
    soft = draw_pictures(fit.views, fit.state, _soft(sharpness.blur.value, sharpness.defocus.value), every)
    return Appearance(light, grain, sharpness, find_blemishes(gathered.pictures, soft, floor, light))


def floor_pixels(fit: CameraFit) -> NDArray[np.bool_]:
    """Pixels (rows, columns) that look at the floor, a little beneath the horizon."""
    on_floor = np.isfinite(ground_points(fit.views.optics.figures(fit.theta))[..., 0])
    below = np.ones_like(on_floor)
    below[HORIZON_ROWS:] = on_floor[:-HORIZON_ROWS]
    return np.asarray(on_floor & below)


def changes(look: Appearance) -> tuple[str, ...]:
    """The effects on pictures that there is no doubt of, and that matter, by name.

    Exposure is told where every paint says the same of it: else the paint may be another than the map declares. Noise
    is told by its size: no floor's texture is so strong everywhere.
    """
    names = [name for name in look.figures if _matters(name, look.figures[name])]
    exposure = [name for name in look.figures if name.startswith("exposure.")]
    if any(_half(look.figures[name]) > NARROW for name in exposure):
        names = [name for name in names if name not in exposure]
    return tuple(dict.fromkeys(effect_of(name) for name in names))


def _matters(name: str, figure: Fitted) -> bool:
    """Whether a figure differs from its neutral value beyond doubt, by enough, and to where a camera's can be."""
    parameter, (low, high) = PARAMETERS[name], figure.interval
    neutral = parameter.neutral_value({})
    sure = name == NOISE or not low <= neutral <= high
    possible = parameter.low <= figure.value <= parameter.high
    return sure and possible and abs(figure.value - neutral) >= LEAST[name]


def _half(figure: Fitted) -> float:
    return (figure.interval[1] - figure.interval[0]) / 2.0


def _soft(blur_s: float, defocus: float) -> dict[str, float]:
    values = {BLUR: blur_s, "defocus": defocus}
    return {name: PARAMETERS[name].clipped(float(value)) for name, value in values.items()}


def _sharp_edges(fit: CameraFit) -> Edges:
    """The edges that the model has too, with how fast each moves through the picture."""
    there, edges = project(fit.views, fit.state), fit.views.edges
    speed = (pose_slopes(there) * there.rates).sum(axis=1)
    same = there.valid & (np.abs(there.residual) < SHARP_PX)
    place = np.stack((edges.column, edges.row), axis=-1)
    return Edges(edges.frame[same], place[same], edges.normal[same], np.abs(speed[same]))
