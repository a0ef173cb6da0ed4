"""The files of sweeps: a figure and tables of each curve, and figures and a page of all that hold the same values."""

import json
from collections.abc import Sequence
from itertools import groupby
from pathlib import Path

from matplotlib.figure import Figure

from proxytune.report.page.foot import foot_of
from proxytune.report.page.rendering import html_of
from proxytune.report.study.page import study_settings
from proxytune.report.sweep.bars import bars_figure
from proxytune.report.sweep.document import curve_csv, curve_document, curve_name, held_mark
from proxytune.report.sweep.figures import panels_figure, sweep_figure
from proxytune.report.sweep.page import sweep_page
from proxytune.report.writing import save, write_text
from proxytune.space import Theta
from proxytune.study import StudySettings
from proxytune.sweep import Curve


def draw_curves(curves: Sequence[Curve], folder: Path, truth: Theta | None) -> list[Path]:
    """Draw one figure per curve, and two of all curves with the same values of the others; return their paths."""
    figures = {curve_name(curve): panels_figure(curve, truth) for curve in curves}
    for alike in held_alike(curves):
        figures |= _together(alike, truth)
    for name, figure in figures.items():
        save(figure, folder / f"{name}.png")
    return [folder / f"{name}.png" for name in figures]


def write_curves(curves: Sequence[Curve], folder: Path) -> list[Path]:
    """Write each curve as CSV and as JSON; return the paths."""
    written = []
    for curve in curves:
        texts = {"csv": curve_csv(curve), "json": json.dumps(curve_document(curve), indent=2, allow_nan=False) + "\n"}
        for ending, text in texts.items():
            written.append(folder / f"{curve_name(curve)}.{ending}")
            write_text(written[-1], text)
    return written


def write_page(settings: StudySettings, curves: Sequence[Curve], folder: Path, held: str, command: str) -> Path:
    """Write the page of curves that hold the same values beside their figures; return its path.

    Args:
        settings: The study's.
        curves: At least one; their figures are in the folder.
        folder: Where figures and page are.
        held: What the other parameters are held at, in words.
        command: The command that makes the page, as typed in a shell.
    """
    names = [*_names_together(curves), *map(curve_name, curves)]
    drawn = {name: (folder / f"{name}.png").read_bytes() for name in names}
    page = sweep_page(
        settings.name, curves, drawn, f"{held[0].upper()}{held[1:]}", foot_of(command, study_settings(settings))
    )
    path = folder / f"{names[0]}.html"
    write_text(path, html_of(page))
    return path


def held_alike(curves: Sequence[Curve]) -> list[list[Curve]]:
    """Curves by what they hold the others at."""
    return [list(members) for _, members in groupby(sorted(curves, key=_base), key=_base)]


def held_values(base: Theta, whose: str = "") -> str:
    """What the others are held at, in words, and whose values these are."""
    values = ", ".join(f"{name}={value:g}" for name, value in sorted(base.items()))
    return f"the others are held at {whose}{values}" if values else "the others are nominal"


def _together(alike: Sequence[Curve], truth: Theta | None) -> dict[str, Figure]:
    """The figures of several parameters, by name."""
    last = list({curve.parameter: curve for curve in alike}.values())
    names = _names_together(alike)
    return dict(zip(names, (sweep_figure(last, truth), bars_figure(last)), strict=True)) if names else {}


def _names_together(alike: Sequence[Curve]) -> list[str]:
    """What the figures of several parameters are called; none where there is one parameter."""
    if len({curve.parameter for curve in alike}) < 2:
        return []
    mark = f"_{held_mark(dict(alike[0].base))}" if alike[0].base else ""
    return [f"sweep_all{mark}", f"sweep_bars{mark}"]


def _base(curve: Curve) -> tuple[tuple[str, float], ...]:
    return tuple(sorted(curve.base.items()))
