"""Whatever is to be read on a page stands out from what is behind it, in light, in the dark and in print (WCAG 2.2)."""

import re

import numpy as np
import pytest
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure

from proxytune.report import figure_style
from proxytune.report.figure_style import show_photo
from proxytune.report.html import ENLARGED, SMALLEST, STYLE, page_html
from proxytune.report.view import Foot, Picture, View
from proxytune.report.writing import svg_of

TEXT, DRAWN = 4.5, 3.0
"""Least contrast of texts, and of lines and areas that mean something."""
LEAST_PX, LEAST_PT = 10.5, 7.0
"""Smallest letters on a phone, and in a figure."""
HALF_TURN = np.array([[-0.574, 1.430, 0.144], [0.426, 0.430, 0.144], [0.426, 1.430, -0.856]])
"""What hue-rotate(180deg) does to red, green and blue (CSS Filter Effects)."""
LINES = ("BLUE", "GREEN", "VERMILLION", "PURPLE", "GREY")


def schemes():
    """The colours of the style sheet by their names: in light, then what the dark and print have over them."""
    roots = [dict(re.findall(r"--(\w+): (#\w+)", one)) for one in re.findall(r":root \{([^}]*)\}", STYLE)]
    assert len(roots) == 3
    return {name: {**roots[0], **over} for name, over in zip(("light", "dark", "print"), roots, strict=True)}


def contrast(one, other):
    parts = np.array([to_rgb(one), to_rgb(other)])
    linear = np.where(parts <= 0.04045, parts / 12.92, ((parts + 0.055) / 1.055) ** 2.4)
    low, high = sorted(linear @ [0.2126, 0.7152, 0.0722])  # luminances
    return (high + 0.05) / (low + 0.05)


def turned_round(colour):
    """A colour of a figure as the page shows it in the dark."""
    return tuple(np.clip(HALF_TURN @ (1.0 - np.array(to_rgb(colour))), 0.0, 1.0))


def test_contrast_is_measured_as_defined_and_shades_stand_out_at_both_ends_and_between():
    assert contrast("#000", "#fff") == pytest.approx(21.0)
    assert contrast("#777", "#fff") == pytest.approx(4.48, abs=0.01)
    assert turned_round("white") == (0.0, 0.0, 0.0)
    dark = schemes()["dark"]["paper"]
    for share in np.linspace(0.0, 1.0, 20):
        colour = figure_style.SHADES(share)[:3]
        assert contrast(colour, "white") >= DRAWN
        assert contrast(turned_round(colour), dark) >= DRAWN


@pytest.mark.parametrize("scheme", ["light", "dark", "print"])
def test_every_text_of_a_page_stands_out_from_every_background(scheme):
    """Text has the colours ink, soft and accent, on paper or on a tint, and nothing else: no colour is written out."""
    known = schemes()[scheme]
    for text in ("ink", "soft", "accent"):
        for behind in ("paper", "tint"):
            assert contrast(known[text], known[behind]) >= TEXT, (text, behind)
    for line in ("accent", "late"):
        assert contrast(known[line], known["paper"]) >= DRAWN, line
    rules = re.sub(r":root \{[^}]*\}", "", STYLE)
    assert set(re.findall(r"(?<![-\w])color: ([^;}]+)", rules)) <= {"var(--ink)", "var(--soft)", "var(--accent)"}
    assert set(re.findall(r"#[0-9a-f]{3,6}", rules)) == {"#fff"}


@pytest.mark.parametrize("name", [*LINES, "LIGHT_BLUE", "ORANGE"])
def test_every_colour_of_a_figure_stands_out_on_paper_and_in_the_dark(name):
    """Names are written in the colours of their lines, so these are as dark as texts."""
    colour, least = getattr(figure_style, name), TEXT if name in LINES else DRAWN
    assert contrast(colour, "white") >= least
    assert contrast(turned_round(colour), schemes()["dark"]["paper"]) >= least


def test_letters_can_be_read_on_a_phone_and_only_photographs_keep_their_colours_in_the_dark():
    """7 points, the smallest that figures have, are some 11 pixels where a figure is as small as it gets."""
    assert LEAST_PT / 72.0 * ENLARGED * SMALLEST >= LEAST_PX
    assert 2.0 * 0.8 * 16.0 + SMALLEST * figure_style.COLUMN * ENLARGED <= 390.0 + 2.0 * 0.4 * 16.0
    # A bar of colours is turned round with the points that it explains; a camera's picture is not.
    figure = Figure()
    axes, shaded = figure.subplots(1, 2)
    show_photo(axes, np.zeros((2, 2, 3)))
    shaded.imshow(np.eye(2), cmap=figure_style.SHADES)
    page = page_html(View("t", "s", "", (Picture("p", svg_of(figure), "c"),)), Foot("", (), (), ""))
    names = re.findall(r'<image[^>]* id="([^"]*)"', page)
    assert len(names) == 2
    assert ["photo" in name for name in names] == [True, False]
    assert 'svg.drawn, svg.drawn image[id*="photo"]' in page
