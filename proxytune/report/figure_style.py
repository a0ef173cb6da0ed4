"""Style that figures share: colours, axes, legends, and names of lines beside their ends."""

from collections.abc import Collection, Iterable, Sequence
from math import ceil
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.cm import plasma
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter
from numpy.typing import NDArray
from scipy.optimize import isotonic_regression

from proxytune.usefulness import NoiseFloor

# Okabe and Ito, safe for the colour-blind, darkened where a name or a line in them was too pale to be read.
BLUE, GREEN, VERMILLION, PURPLE, GREY = "#0072B2", "#008662", "#C25600", "#A36186", "0.45"
"""Of lines and of names: at least 4.5 times as dark as paper."""
LIGHT_BLUE, ORANGE = "#4B9DCB", "#C68900"
"""Of areas: at least 3 times as dark as paper."""
LIGHT_GREY = "0.75"
"""What stands behind the rest."""
SHADES = LinearSegmentedColormap.from_list("shades", plasma(np.linspace(0.0, 0.64, 256)))
"""Colours of numbers, from low to high: all as dark as areas are, which no whole map of Matplotlib's is."""
COLUMN = 85.0 / 25.4
"""Width in inches of a figure that is to be read at 85 mm, one column of a paper."""
CHARACTERS_PER_INCH, HANDLE = 19, 8
"""Characters of a legend that fit into an inch, and the space that a line beside them takes, in characters."""


def grid_of(height: float, rows: int, columns: int, **how: Any) -> tuple[Figure, NDArray[Any]]:
    """A figure for one column of a paper, so high [inch], and its panels (rows, columns), made as `subplots` does."""
    figure = Figure(figsize=(COLUMN, height), layout="constrained")
    return figure, figure.subplots(rows, columns, squeeze=False, **how)


def one_panel(height: float) -> tuple[Figure, Axes]:
    """A figure for one column of a paper, so high [inch], and its only panel."""
    figure, panels = grid_of(height, 1, 1)
    return figure, panels[0, 0]


def panel_grid(count: int, height: float, rest: float, **how: Any) -> tuple[Figure, list[Axes]]:
    """A figure of so many panels, two in a row, each so high, with so much for all else [inch]; and the panels."""
    rows = ceil(count / 2)
    figure, panels = grid_of(height * rows + rest, rows, min(2, count), **how)
    for axes in panels.flat[count:]:
        axes.remove()
    return figure, list(panels.flat[:count])


def draw_noise_floor(axes: Axes, floor: NoiseFloor, label: str = "") -> bool:
    """The noise floor, if there is one, as a line with the band of its interval; tells whether there is."""
    if floor.value is None or floor.low is None or floor.high is None:
        return False
    axes.axhspan(floor.low, floor.high, color=GREEN, alpha=0.15, linewidth=0)
    axes.axhline(floor.value, color=GREEN, linewidth=1.0, linestyle="--", label=label or floor_name(floor))
    return True


def floor_name(floor: NoiseFloor) -> str:
    """Name of the noise floor in a legend; halves of the target are no noise floor, and are not called so."""
    return "target's halves" if floor.kind == "halves" else floor.title


def dress(axes: Axes, across: str = "", up: str = "") -> None:
    """Small ticks, no frame, and labels of the axes where they are given."""
    axes.tick_params(labelsize=7)
    axes.spines[["top", "right"]].set_visible(False)
    if across:
        axes.set_xlabel(across, fontsize=8)
    if up:
        axes.set_ylabel(up, fontsize=8)


def label_sides(panels: NDArray[Any], across: str, up: str) -> None:
    """Small ticks in a grid of panels (rows, columns), and once along each of its sides what its axes are."""
    for axes in panels.flat:
        axes.tick_params(labelsize=7)
    for axes in panels[-1]:
        axes.set_xlabel(across, fontsize=8)
    for axes in panels[:, 0]:
        axes.set_ylabel(up, fontsize=8)


def mark_truth(axes: Axes, value: float) -> None:
    """A triangle at the top at the value of the θ that made the target."""
    (mark,) = axes.plot(value, 1.0, "v", color="black", transform=axes.get_xaxis_transform(), label="truth")
    mark.set(markersize=5, clip_on=False, zorder=4)


def show_photo(axes: Axes, picture: NDArray[Any], **look: Any) -> None:
    """Draw a picture that keeps its colours in the dark, where a page turns those of figures round."""
    number = f"{axes.figure.axes.index(axes)}.{len(axes.images)}"  # the same in every run
    axes.imshow(picture, **look).set_gid(f"photo{number}")


def write_plain(axis: Axis) -> None:
    """Ticks of a logarithmic axis at 1, 2 and 5, as plain numbers."""
    axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axis.set_minor_formatter(NullFormatter())


def named_handles(panels: Iterable[Axes]) -> dict[str, Any]:
    """Everything in panels that has a name, each name once."""
    return {label: handle for axes in panels for handle, label in zip(*axes.get_legend_handles_labels(), strict=True)}


def legend_below(figure: Figure, *panels: Axes, without: Collection[str] = ()) -> None:
    """One legend under the figure with every name in its panels once, but for those beside their lines already."""
    named = {label: handle for label, handle in named_handles(panels).items() if label not in without}
    longest = max((len(name) for name in named), default=0) + HANDLE
    columns = max(1, min(3, int(figure.get_figwidth() * CHARACTERS_PER_INCH / longest)))
    if named:
        look: dict[str, Any] = {"loc": "outside lower center", "fontsize": 7, "frameon": False}
        figure.legend(list(named.values()), list(named), ncols=columns, **look)


ONE_LINE = 0.05
"""Least distance between names of one line, as a share of the panel's height; two lines take more."""


class Role(NamedTuple):
    """Meaning of a dot: its name in a legend, its colour, and that of its face where it is another."""

    name: str
    colour: str
    face: str | None = None


def draw_ranked(axes: Axes, rows: Sequence[tuple[str, float, Role]], start: float = 0.0) -> None:
    """Draw names with values as dots, the first on top, each with a thin line to it from where they start."""
    for place, (_, value, role) in enumerate(rows):
        axes.plot([start, value], [place, place], "-", color=role.colour, lw=0.9, alpha=0.6)
        axes.plot([value], [place], "o", color=role.colour, mfc=role.face or role.colour, ms=4, label=role.name)
    axes.set_yticks(range(len(rows)), [name for name, _, _ in rows])
    axes.set_ylim(len(rows) - 0.4, -0.6)
    dress(axes)


class LineName(NamedTuple):
    """The name of a line, its colour, and the value at which the line ends."""

    text: str
    colour: str
    end: float

    @property
    def words(self) -> str:
        """The name on one line."""
        return self.text.replace("\n", " ")


def name_lines(axes: Axes, names: Sequence[LineName], apart: float = ONE_LINE) -> None:
    """Write names right of a panel whose limits are final, moved apart where lines end together."""
    bottom, top = axes.get_ylim()
    places = spread_places([(min(max(name.end, bottom), top) - bottom) / (top - bottom) for name in names], apart)
    for name, place in zip(names, places, strict=True):
        axes.text(1.02, place, name.text, transform=axes.transAxes, fontsize=7, color=name.colour, va="center")


def spread_places(places: Sequence[float], apart: float) -> list[float]:
    """Places moved as little as it takes to be so far apart, in the same order, from 0 to 1 where they fit there."""
    order, steps, moved = np.argsort(places, kind="stable"), apart * np.arange(len(places)), np.empty(len(places))
    # Least squares with the order kept: places that would touch share the mean of theirs.
    most = max(0.0, 1.0 - apart * (len(places) - 1))
    moved[order] = np.clip(isotonic_regression(np.asarray(places)[order] - steps).x, 0.0, most) + steps
    return moved.tolist()
