"""The figures of a camera's diagnosis: its markings, what each effect explains alone, and errors frame by frame."""

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from proxytune.diagnosis import LEAST_NATS, CameraDiagnosis, Comparison, effects_of, rank_subsets
from proxytune.report.diagnosis.camera.displacement_figure import displacement_figure
from proxytune.report.diagnosis.camera.markings_figure import markings_figure
from proxytune.report.diagnosis.model_names import BEFORE
from proxytune.report.style import BLUE, COLUMN, GREEN, GREY, LIGHT_BLUE, VERMILLION, dress, legend_below, plain

LEAST_LOSS = 1.0
"""Losses below this are all alike [nats]."""


def camera_figures(diagnosis: CameraDiagnosis) -> Mapping[str, Figure]:
    """Draw everything that a camera's diagnosis has to show, by the name of the figure."""
    figures = {
        "camera_markings": markings_figure(diagnosis),
        "camera_displacement": displacement_figure(diagnosis),
        "camera_ranking": _ranking(diagnosis),
        "camera_error": _errors(diagnosis),
    }
    return {name: figure for name, figure in figures.items() if figure is not None}


def _ranking(diagnosis: CameraDiagnosis) -> Figure | None:
    """What is lost with each effect alone, against all effects together; None where all are declared."""
    tried = diagnosis.candidates
    if not tried:
        return None
    nothing = loss_of_nothing(diagnosis)
    figure = Figure(figsize=(COLUMN, 1.3 + 0.16 * len(tried)), layout="constrained")
    axes = figure.subplots()
    for place, one in enumerate(tried):
        name, colour = _role(diagnosis, one.effects)
        loss = max(one.loss, 0.0)
        axes.plot([loss, nothing], [place, place], "-", color=colour, lw=0.9, alpha=0.6)
        axes.plot([loss], [place], "o", color=colour, ms=4, label=name)
    axes.axvline(max(nothing, 0.0), color=VERMILLION, lw=1.0, ls=":", label="nothing added")
    axes.axvline(LEAST_NATS, color="0.45", lw=1.0, ls=":", label=f"least that counts, {LEAST_NATS:g} nats")
    axes.set_yticks(range(len(tried)), [" and ".join(map(plain, one.effects)) for one in tried])
    axes.set_ylim(len(tried) - 0.4, -0.6)
    axes.set_xscale("symlog", linthresh=10.0 * LEAST_LOSS, linscale=0.7)
    axes.set_xlim(-0.5, 1.5 * max(10.0 * LEAST_LOSS, nothing, *(one.loss for one in tried)))
    label = "evidence lost if only this effect is added [nats]\n0: none against all effects"
    axes.set_xlabel(label, fontsize=8, loc="right")
    dress(axes)
    legend_below(figure, axes)
    return figure


def loss_of_nothing(diagnosis: CameraDiagnosis) -> float:
    """What is lost with the declared effects alone, in the measure that the candidates are ranked by [nats]."""
    named = diagnosis.named
    return rank_subsets(named.full, effects_of(named.declared.names), 0)[0].loss


def _role(diagnosis: CameraDiagnosis, effects: Sequence[str]) -> tuple[str, str]:
    if set(effects) <= {effect.effect for effect in diagnosis.effects}:
        return "added", BLUE
    if set(effects) <= {rival for effect in diagnosis.effects for rival in effect.rivals}:
        return "fits as well as what was added", LIGHT_BLUE
    return "other effect", GREY


def _errors(diagnosis: CameraDiagnosis) -> Figure:
    """Frame by frame on frames kept aside: displacement of markings, and brightness."""
    figure = Figure(figsize=(COLUMN, 2.4), layout="constrained")
    place, grey = figure.subplots(1, 2)
    bent = [effect.effect for effect in diagnosis.effects if effect.nats is not None]
    every = [effect.effect for effect in diagnosis.effects]
    _draw_frames(place, diagnosis.pixels, bent)
    if diagnosis.pixels.floor is not None:
        place.axhline(diagnosis.pixels.floor.value, color=GREEN, lw=1.4, label="floor: any camera, mean")
    _draw_frames(grey, diagnosis.grey, every)
    place.set_ylabel("displacement\nof markings [px]", fontsize=8)
    grey.set_ylabel("difference in brightness\n[grey levels]", fontsize=8)
    legend_below(figure, place, grey)
    return figure


def _draw_frames(axes: Axes, error: Comparison, effects: list[str]) -> None:
    """Each frame's error before, and after where something was added, the largest error before last."""
    before, after = error.before.frames, error.after.frames
    order = np.argsort(before)[: int(np.isfinite(before).sum())]
    spots = np.arange(1, len(order) + 1)
    if effects:
        axes.vlines(spots, before[order], after[order], color=GREY, lw=0.4, alpha=0.6)
    axes.plot(spots, before[order], ".", color=VERMILLION, ms=3, label=BEFORE)
    if effects:
        axes.plot(spots, after[order], ".", color=BLUE, ms=3, label="with effects added")
    axes.set_xlabel("frames kept aside,\nby error before", fontsize=8)
    axes.set_ylim(bottom=0.0)
    dress(axes)
