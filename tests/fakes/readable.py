"""Figures as the column of a paper takes them, and texts as a terminal shows them."""

import io
import warnings

import pytest
from matplotlib.text import Text
from rich.console import Console


def assert_readable(*figures, points=6.0):
    """They are a column wide, with letters of so many points; no label is cut, and no legend stands on one."""
    for figure in figures:
        figure.draw_without_rendering()
        assert figure.get_figwidth() * 25.4 == pytest.approx(85.0)
        assert min(text.get_fontsize() for text in figure.findobj(Text) if text.get_text()) >= points
        labels = [label for axes in figure.axes for label in (axes.xaxis.label, axes.yaxis.label, axes.title)]
        boxes = [label.get_window_extent() for label in labels if label.get_text()]
        legends = [legend.get_window_extent() for legend in figure.legends]
        assert all(figure.bbox.x0 - 1 <= box.x0 <= box.x1 <= figure.bbox.x1 + 1 for box in (*boxes, *legends))
        assert not any(legend.overlaps(box) for legend in legends for box in boxes)


def drawn_without_a_warning(make):
    """Figures by name, as they are made, each drawn once."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        figures = make()
        for figure in figures.values():
            figure.draw_without_rendering()
    return figures


def on_terminal(*texts, width=160):
    """What a terminal so wide shows."""
    console = Console(width=width, file=io.StringIO(), color_system=None)
    console.print(*texts, crop=False)
    return console.file.getvalue()
