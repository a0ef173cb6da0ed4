"""What figures share: colours, axes, legends, and what those of a diagnosis call models."""

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from proxytune.diagnosis.result import Diagnosis
from proxytune.usefulness import NoiseFloor

BLUE, LIGHT_BLUE, GREEN = "#0072B2", "#56B4E9", "#009E73"  # Okabe and Ito, safe for the colour-blind
ORANGE, VERMILLION, PURPLE = "#E69F00", "#D55E00", "#CC79A7"
GREY, LIGHT_GREY = "0.55", "0.9"

COLUMN = 85.0 / 25.4
"""Width in inches of a figure that is to be read at 85 mm, one column of a paper."""

BEFORE = "declared model"
LONGEST = 45
"""Characters of added effects that are named one by one."""

CHARACTERS_PER_INCH, HANDLE = 19, 8
"""Characters of a legend that fit into an inch, and the space that a line beside them takes, in characters."""


def after(diagnosis: Diagnosis) -> str:
    """What a legend calls the extended model."""
    added = ", ".join(plain(effect.effect) for effect in diagnosis.effects)
    return f"with {added}" if len(added) < LONGEST else f"with {len(diagnosis.effects)} effects added"


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


def legend_below(figure: Figure, *panels: Axes) -> None:
    """One legend under the figure with everything that has a name, each name once, in the columns that fit."""
    named = {label: handle for axes in panels for handle, label in zip(*axes.get_legend_handles_labels(), strict=True)}
    longest = max((len(name) for name in named), default=0) + HANDLE
    columns = max(1, min(3, int(figure.get_figwidth() * CHARACTERS_PER_INCH / longest)))
    if named:
        figure.legend(
            list(named.values()), list(named), loc="outside lower center", ncols=columns, fontsize=7, frameon=False
        )
