"""What figures share: colours, axes and legends."""

from collections.abc import Collection

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from proxytune.usefulness import NoiseFloor

BLUE, LIGHT_BLUE, GREEN = "#0072B2", "#56B4E9", "#009E73"  # Okabe and Ito, safe for the colour-blind
ORANGE, VERMILLION, PURPLE = "#E69F00", "#D55E00", "#CC79A7"
GREY, LIGHT_GREY = "0.55", "0.9"

COLUMN = 85.0 / 25.4
"""Width in inches of a figure that is to be read at 85 mm, one column of a paper."""

CHARACTERS_PER_INCH, HANDLE = 19, 8
"""Characters of a legend that fit into an inch, and the space that a line beside them takes, in characters."""


def plain(name: str) -> str:
    """The name of an effect as words."""
    return name.replace("_", " ")


def with_unit(name: str, unit: str) -> str:
    """What an axis calls a parameter."""
    return f"{plain(name)} [{unit}]" if unit else plain(name)


def floor_name(floor: NoiseFloor) -> str:
    """What a legend calls the noise floor; halves of the target are no noise floor, and are not called so."""
    return "target's halves" if floor.kind == "halves" else floor.title


def dress(axes: Axes) -> None:
    """Small ticks and no frame."""
    axes.tick_params(labelsize=7)
    axes.spines[["top", "right"]].set_visible(False)


def legend_below(figure: Figure, *panels: Axes, without: Collection[str] = ()) -> None:
    """One legend under the figure with everything that has a name, each name once, in the columns that fit.

    Args:
        figure: What it goes under.
        panels: Whose names are listed.
        without: Names that stand beside their lines already.
    """
    named = {label: handle for axes in panels for handle, label in zip(*axes.get_legend_handles_labels(), strict=True)}
    named = {label: handle for label, handle in named.items() if label not in without}
    longest = max((len(name) for name in named), default=0) + HANDLE
    columns = max(1, min(3, int(figure.get_figwidth() * CHARACTERS_PER_INCH / longest)))
    if named:
        figure.legend(
            list(named.values()), list(named), loc="outside lower center", ncols=columns, fontsize=7, frameon=False
        )
