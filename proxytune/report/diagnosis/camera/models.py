"""What the figures of a camera's diagnosis share: its models, their names and colours, places in the picture."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from proxytune.diagnosis import CameraDiagnosis, CameraFit
from proxytune.report.diagnosis.model_names import BEFORE, LONGEST
from proxytune.report.style import BLUE, VERMILLION, plain

COLOURS = (VERMILLION, BLUE)
"""Of the declared model, and of the one with effects added."""


def camera_models(diagnosis: CameraDiagnosis) -> Mapping[str, CameraFit]:
    """The declared camera, and the one with what bends it added; one model where only the pictures' look changed.

    Both look at the map as the second one has it, from the same poses: the declared one bends these to hide its faults.
    """
    bent = [effect.effect for effect in diagnosis.effects if effect.nats is not None]
    declared, model = diagnosis.named.declared, diagnosis.named.model
    before = replace(declared, state=replace(model.state, theta=declared.theta))
    return {BEFORE: before} | ({with_effects(bent): model} if bent else {})


def with_effects(effects: list[str]) -> str:
    """What a legend calls a model with these effects added."""
    names = ", ".join(map(plain, effects))
    return f"with {names}" if len(names) < LONGEST else f"with {len(effects)} effects added"


def label_places(panels: NDArray[np.object_]) -> None:
    """Say once along each side of a grid of pictures what its axes are."""
    for axes in panels.ravel():
        axes.tick_params(labelsize=7)
    for axes in panels[-1]:
        axes.set_xlabel("column [px]", fontsize=8)
    for axes in panels[:, 0]:
        axes.set_ylabel("row [px]", fontsize=8)
