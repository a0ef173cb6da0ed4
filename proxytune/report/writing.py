"""Writing a file whole or not at all; figures as PNG, SVG and PDF, and texts with values in them."""

import contextlib
import html
import re
import warnings
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextvars import ContextVar
from functools import partial
from io import BytesIO
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axis import Axis
from matplotlib.collections import PathCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.text import Text
from matplotlib.ticker import FixedFormatter
from numpy.typing import NDArray
from PIL import Image

from proxytune.files import fill_template, package_table, write_whole
from proxytune.report.view import Drawn, Picture

UNDATED: dict[str, dict[str, Any]] = {"svg": {"Date": None}, "pdf": {"CreationDate": None}}
"""Metadata left out of files, so that the same figure gives the same bytes."""
fill = partial(fill_template, "report")
CAPTIONS: Mapping[str, Mapping[str, Mapping[str, str]]] = package_table("report/templates/captions.toml")
"""Title and caption of each figure, by its subject."""
ABOUT: Mapping[str, str] = package_table("report/templates/about.toml")
"""What the numbers on a page are, by its subject."""
_beside: ContextVar[tuple[str, ...]] = ContextVar("beside", default=())


@contextlib.contextmanager
def figures_also_as(formats: Sequence[str]) -> Iterator[None]:
    """Have every figure that is saved meanwhile written in these formats too, of svg and pdf, beside its PNG."""
    before = _beside.set(tuple(formats))
    try:
        yield
    finally:
        _beside.reset(before)


def write_text(path: Path, text: str) -> None:
    """Write a text file, its folder made where missing; an interrupted write leaves the old file."""
    write_whole(path, text)


def save_figure(figure: Figure, path: Path) -> None:
    """Write a figure as PNG, and in the formats of `figures_also_as`; an interrupted write leaves the old file."""
    write_whole(path, lambda draft: _save_as(figure, draft, format="png", dpi=200), what="the figure ")
    for form in _beside.get():
        write_whole(path.with_suffix(f".{form}"), partial(_draw, figure, form), what="the figure ")


def save_figures(figures: Mapping[str, Figure], folder: Path) -> list[Path]:
    """Write figures as `save_figure` does, NAME.png each; their paths."""
    for name, figure in figures.items():
        save_figure(figure, folder / f"{name}.png")
    return [folder / f"{name}.png" for name in figures]


def picture_of(subject: str, name: str, image: Drawn, **words: str) -> Picture:
    """A figure of a subject with its title and what to see in it, in which these words are filled in."""
    said = CAPTIONS[subject][name]
    return Picture(said["title"].format(**words), image, said["caption"].format(**words))


def svg_of(figure: Figure) -> bytes:
    """A figure as an SVG for a page: without a background, and what a marker stands for as its title."""
    said = dict(_marks(figure))
    image = BytesIO()
    with mpl.rc_context({"svg.hashsalt": "proxytune"}):
        _save_as(figure, image, format="svg", metadata=UNDATED["svg"], transparent=True)
    head, *groups = re.split(r'(?=<g id=")', image.getvalue().decode("utf-8"))
    return "".join([head, *(_titled(group, said) for group in groups)]).encode("utf-8")


def _marks(figure: Figure) -> Iterator[tuple[str, list[str]]]:
    """Name whatever is drawn by markers; each name with the titles of its markers."""
    for axes in figure.axes:
        drawn: list[Any] = [line for line in axes.lines if line.get_transform() is axes.transData]
        for artist in (*drawn, *(one for one in axes.collections if isinstance(one, PathCollection))):
            points = np.asarray(artist.get_xydata() if isinstance(artist, Line2D) else artist.get_offsets())
            label, name = str(artist.get_label()), f"mark{id(artist)}"
            names = [] if label.startswith("_") else [label]
            shown = ([*names, *map(_place, (axes.xaxis, axes.yaxis), point)] for point in points)
            artist.set_gid(name)
            yield name, ["; ".join(filter(None, one)) for one in shown]


def _place(axis: Axis, value: float) -> str:
    """A value on an axis, by the axis' name; or the name that stands beside it."""
    if isinstance(axis.get_major_formatter(), FixedFormatter):
        ticks = {float(at): one.get_text() for at, one in zip(axis.get_ticklocs(), axis.get_ticklabels(), strict=True)}
        return ticks.get(round(float(value)), "")
    return f"{axis.get_label().get_text()} {value:.4g}".replace("\n", " ").replace("-", "−").strip()


def _titled(group: str, said: Mapping[str, list[str]]) -> str:
    """A group of an SVG with titles for its markers; without a name that differs from one time to the next."""
    name = group[len('<g id="') :].partition('"')[0]
    if name not in said:
        return group
    parts = iter(said[name])
    if len(re.findall(r"<use [^>]*/>", group)) == len(said[name]):
        group = re.sub(r"(<use [^>]*)/>", lambda it: f"{it[1]}><title>{html.escape(next(parts))}</title></use>", group)
    return group.replace(f' id="{name}"', "", 1)


def _draw(figure: Figure, form: str, draft: Path) -> None:
    """Write a vector file; journals refuse the fonts that Matplotlib's PDF has by default."""
    if form == "svg":
        draft.write_bytes(svg_of(figure))
        return
    with mpl.rc_context({"pdf.fonttype": 42}):
        _save_as(figure, draft, format=form, metadata=UNDATED[form])


def _save_as(figure: Figure, where: Path | BytesIO, **how: Any) -> None:
    """Save a figure with names as they are: a dollar begins no formula, and a letter without a glyph is no news.

    What Matplotlib writes itself at the ticks of an axis, such as powers of ten, stays a formula.
    """
    for text in figure.findobj(Text):
        if "$" in text.get_text() and r"\mathdefault" not in text.get_text():
            text.set_parse_math(False)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)
        figure.savefig(where, **how)


def file_names(names: Iterable[str]) -> dict[str, str]:
    """Names as file names have them; of those that would be alike, the later ones are numbered."""
    called: dict[str, str] = {}
    for name in names:
        plain = re.sub(r"[^\w.-]+", "_", name)
        others = (f"{plain}_{number}" for number in range(2, len(called) + 3))
        called[name] = next(one for one in (plain, *others) if one not in called.values())
    return called


def write_picture(path: Path, picture: NDArray[np.uint8]) -> None:
    """Write a picture (rows, columns, 3) as PNG, its folder made where missing; an interrupted write leaves the old."""
    write_whole(path, lambda draft: Image.fromarray(picture).save(draft, format="png"), what="the picture ")
