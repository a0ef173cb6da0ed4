"""Sweeps as a page."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

from rich.console import Group

from proxytune.report.page.parts import Foot, Page, Picture, Table, Words
from proxytune.report.page.tables import terminal_tables
from proxytune.report.sweep.document import curve_lines, curve_name, curve_tables, failures
from proxytune.sweep import Curve, series_of, shape_of

BANDS = "Bands are 95 % intervals: where they overlap, the values cannot be told apart."
LINES = (
    "The dashed vertical line is where the parameter is held when others are swept; the triangle, where the truth is "
    "known, is the target's own value, where a good measure is at its best."
)
CAPTION = f"{BANDS} {LINES} PRPV, PPV and POD are better low, SRCC is better high."
TOGETHER = (
    f"Each row is a parameter; lower is better. {BANDS} Green is the noise floor or, as the key says, the target's "
    f"halves; the dotted line is chance. {LINES}"
)
BARS = (
    "PRPV at a lower, the held (dark) and a higher value of each parameter. Where the 95 % intervals (lines) of a "
    "parameter's bars overlap, it is not shown to matter."
)


def sweep_page(study: str, curves: Sequence[Curve], figures: Mapping[str, bytes], held: str, foot: Foot) -> Page:
    """Curves as a page: what the terminal shows, and the figures.

    Args:
        study: The study's name.
        curves: What was swept, at least one.
        figures: PNG files by the name of the figure.
        held: What the other parameters are held at, in a sentence.
        foot: The page's.
    """
    names = ", ".join(curve.parameter for curve in curves)
    wrong = failures(curves)
    parts: list[Picture | Table | Words] = [*_together(curves, figures)]
    for curve in curves:
        parts += [*_own(curve, figures), *_tables(curve)]
    parts += [Words("What failed", tuple(wrong))] if wrong else []
    answer = " ".join(f"{_lowest(curve)}." for curve in curves)
    return Page(f"{study}: usefulness along {names}", f"{answer} {held}.", _next_step(curves), tuple(parts), foot)


def _lowest(curve: Curve) -> str:
    """Where PRPV is lowest, and which other values these episodes leave open."""
    prpv = series_of(curve)[0]
    shape = shape_of(prpv, curve.base.get(curve.parameter))
    if shape.score is None:
        return f"{curve.parameter}: {prpv.name} is undefined at every point"
    best, points = ", ".join(f"{value:.4g}" for value in shape.best), len(curve.points)
    worse = points - len(shape.near_best)
    beyond = f"worse beyond noise at {worse} of {points} values" if worse else "at no other value worse beyond noise"
    return f"{curve.parameter}: {prpv.name} is lowest ({shape.score:.3g}) at {best}, and {beyond}"


def _next_step(curves: Sequence[Curve]) -> str:
    flat = [one.parameter for one in curves if len(shape_of(series_of(one)[0], None).near_best) == len(one.points)]
    if flat:
        return f"raise starts, or add agents whose scores change with {' or '.join(flat)}: noise hides a difference."
    return "search all parameters at once with `python -m proxytune study`."


def _tables(curve: Curve) -> list[Table]:
    first, *others = terminal_tables(Group(*curve_tables(curve)))
    measured = replace(first, title=f"Along {curve.parameter}: the paper's measures", notes=tuple(curve_lines(curve)))
    rest = f"Along {curve.parameter}: other measures"
    return [measured, *(replace(one, title=rest) for one in others if one.columns[1:])]


def _together(curves: Sequence[Curve], figures: Mapping[str, bytes]) -> list[Picture]:
    """The figures of all parameters."""
    own = [curve_name(curve) for curve in curves]
    return [_of_all(name, image) for name, image in figures.items() if name not in own]


def _of_all(name: str, image: bytes) -> Picture:
    if name.startswith("sweep_bars"):
        return Picture("How much each parameter matters", image, BARS)
    return Picture("All parameters", image, TOGETHER)


def _own(curve: Curve, figures: Mapping[str, bytes]) -> list[Picture]:
    image = figures.get(curve_name(curve))
    return [Picture(f"Usefulness along {curve.parameter}", image, CAPTION)] if image else []
