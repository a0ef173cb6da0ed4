"""Pages as HTML: nothing from elsewhere, everything escaped, for every screen and reader."""

import functools
import re
from dataclasses import replace
from html.parser import HTMLParser
from io import BytesIO

import pytest
from hypothesis import assume, given, strategies as st
from matplotlib.figure import Figure
from PIL import Image

from proxytune.report.html import MANY, WORDS, Shown, page_html, write_page
from proxytune.report.view import Column, Foot, Paragraphs, Picture, Table, View, columns_of, foot_of
from proxytune.report.writing import svg_of

EVIL = "<script>alert('\"&')</script>"


def png(width=20, form="png", **more):
    image = BytesIO()
    Image.new("P", (width, 10)).save(image, format=form, **more)
    return image.getvalue()


FOOT = Foot("python -m proxytune study a", (("seed", "1"),), (("numpy", "2"),), "2026-01-01")
TABLE = Table(
    "Numbers", columns_of(("name",), ("value",)), (("a", "1.5"), ("b", "−2 (−3 to 1)"), ("c", "")), ("a note",)
)
VIEW = View(
    "title", "An answer.", "do this", (Picture("Curve", png(), "See."), TABLE, Paragraphs("Words", ("One.", "Two.")))
)


def html_of(view):
    return page_html(view, FOOT)


class Reader(HTMLParser):
    """Keeps every element with its attributes, and checks that all are closed in order."""

    def __init__(self, text):
        super().__init__()
        self.elements, self.open = [], []
        self.feed(text)
        assert self.open == []

    def handle_starttag(self, tag, attrs):
        self.elements.append((tag, dict(attrs)))
        if tag not in {"meta", "link", "img", "br"}:
            self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def all(self, *tags):
        return [attrs for tag, attrs in self.elements if tag in tags]


def test_every_text_of_every_field_is_escaped_nothing_loaded_from_elsewhere_and_no_script_may_run():
    evil = View(
        EVIL,
        EVIL,
        EVIL,
        (
            Picture(EVIL, png(), EVIL),
            Table(EVIL, (Column(EVIL), Column(EVIL, numbers=True)), ((EVIL, EVIL),), (EVIL,)),
            Table(EVIL, (Column(""), Column("")), ((EVIL, EVIL),)),
            Paragraphs(EVIL, (EVIL, f"`{EVIL}`")),
        ),
    )
    shown = Shown()
    shown.view = lambda: replace(evil, parts=evil.parts * MANY)  # so many have a table of contents
    foot = Foot(EVIL, ((EVIL, EVIL),), ((EVIL, EVIL),), EVIL)
    for text in (page_html(evil, foot, 5), page_html(shown.view(), foot), shown._repr_html_()):
        elements = Reader(text)
        assert elements.all("script") == []
        assert text.count("alert(") >= 20
        assert all(EVIL in image["alt"] for image in elements.all("img"))
    text = html_of(replace(VIEW, next_step="see https://example.org"))
    elements = Reader(text)
    for attrs in elements.all(*{tag for tag, _ in elements.elements}):
        for key in {"src", "href", "srcset", "action", "data"} & attrs.keys():
            assert attrs[key].startswith(("data:", "#"))
    assert "url(" not in text
    assert "@import" not in text
    (policy,) = [one["content"] for one in elements.all("meta") if "Policy" in one.get("http-equiv", "")]
    assert policy.startswith("default-src 'none'; img-src data:;")
    assert "script-src" not in policy


@functools.cache
def _tags():
    return [tag for tag, _ in Reader(html_of(VIEW)).elements]


@given(st.text(max_size=40))
def test_no_text_breaks_the_page(text):
    assume(not any(word in text for word in WORDS))  # those are explained at the foot
    view = replace(VIEW, title=text, sentence=text.replace("`", ""), next_step="do " + text.replace("`", ""))
    assert [tag for tag, _ in Reader(html_of(view)).elements] == _tags()


def test_headings_and_contents_come_in_order_and_tables_have_scopes_captions_and_regions_for_the_keyboard():
    elements = Reader(html_of(VIEW))
    tags = [tag for tag, _ in elements.elements if re.fullmatch(r"h\d", tag)]
    assert tags[0] == "h1"
    assert tags.count("h1") == 1
    assert set(tags[1:]) == {"h2"}
    assert {attrs.get("scope") for attrs in elements.all("th")} == {"row", "col"}
    assert len(elements.all("caption")) == len(elements.all("table")) == 2
    regions = [attrs for attrs in elements.all("div") if attrs.get("class") == "scroll"]
    ids = {attrs["id"] for attrs in elements.all("h2")}
    assert len(regions) == 3
    assert all(one["tabindex"] == "0" and one["role"] == "region" and one["aria-labelledby"] in ids for one in regions)
    assert "<nav" not in html_of(replace(VIEW, parts=(TABLE,) * MANY))
    elements = Reader(html_of(replace(VIEW, parts=(TABLE,) * (MANY + 1))))
    ids = {attrs["id"] for attrs in elements.all("h2")}
    links = [attrs["href"] for attrs in elements.all("a")]
    assert len(links) == MANY + 1
    assert {link.removeprefix("#") for link in links} <= ids


def test_numbers_end_together_with_a_minus_and_texts_begin_together_long_cells_wrapped_and_parts_indented():
    columns = (Column("value", numbers=True), Column("text"))
    text = html_of(replace(VIEW, parts=(replace(TABLE, columns=columns, rows=(("1", "2"), ("2", "x"))),)))
    assert '<th scope="col" class="number">value</th><th scope="col">text</th>' in text
    assert '<th scope="row" class="number">1</th><td>2</td>' in text
    assert '<td class="number">−2 (−3 to 1)</td>' in html_of(VIEW)
    columns = columns_of(("a\nb",), ("value",))
    text = html_of(replace(VIEW, parts=(replace(TABLE, columns=columns, rows=(("x", "w" * 29),)),)))
    assert '<td class="prose">www' in text
    assert '<th scope="col">a b</th>' in text
    # A name with a hyphen keeps it; an indent holds where the name takes two lines.
    columns = columns_of(("name",), ("value",))
    page = html_of(replace(VIEW, parts=(Table("T", columns, (("  a-1", "-0.3 (-1 to 2)"),)),)))
    assert '<th scope="row" class="part">a-1</th><td class="number">−0.3 (−1 to 2)</td>' in page


def test_commands_are_code_words_are_explained_where_they_are_used_and_links_stay_beside_the_page():
    text = html_of(replace(VIEW, next_step="run `a < b`"))
    assert "run <code>a &lt; b</code>" in text
    assert "a `b" in html_of(replace(VIEW, next_step="a `b"))
    text = html_of(replace(VIEW, next_step="run `python -m proxytune study a --budget 2`"))
    assert "python -m proxytune study a <span>--budget</span> 2</code>" in text
    # Jargon has a meaning at the foot; a link goes to a file near the page and never elsewhere.
    said = Paragraphs(
        "P", ("The noise floor. [here](diagnosed/report.html) [there](https://x.org) [up](../report.html)",)
    )
    page = html_of(replace(VIEW, parts=(said,)))
    assert "<dt>noise floor</dt>" in page
    assert "<dt>nats</dt>" not in page
    assert re.findall(r'<a href="([^"#]+)', page) == ["diagnosed/report.html", "../report.html"]


def test_a_page_fits_every_screen_says_how_to_come_by_it_and_renews_itself_only_under_way():
    text = html_of(VIEW)
    assert 'name="viewport" content="width=device-width' in text
    for words in ("@media print", "@media (prefers-color-scheme: dark)", ".card { display: block;", "background: #fff"):
        assert words in text
    foot = html_of(VIEW).split("<footer>")[1]
    for words in ("python -m proxytune study a", "seed", "numpy 2", "Written 2026-01-01"):
        assert words in foot
    written = foot_of("a command", [("seed", "1")])
    assert dict(written.versions).keys() >= {"Python", "numpy", "scipy"}
    assert re.match(r"\d{4}-\d\d-\d\d \d\d:\d\d", written.date)
    assert 'http-equiv="refresh"' not in html_of(VIEW)
    text = page_html(VIEW, FOOT, 7)
    assert '<meta http-equiv="refresh" content="7">' in text
    assert "loads itself again every 7 s" in text
    assert "Next:" in html_of(VIEW)
    assert "Next:" not in html_of(replace(VIEW, next_step=""))


@pytest.mark.parametrize(
    ("kind", "more", "width"), [("png", {}, 400), ("png", {"dpi": (200, 200)}, 320), ("gif", {}, 400)]
)
def test_pictures_are_data_of_their_own_kind_drawn_at_160_pixels_to_the_inch(kind, more, width):
    (attrs,) = Reader(html_of(replace(VIEW, parts=(Picture("P", png(400, kind, **more), "C"),)))).all("img")
    assert attrs["width"] == str(width)
    assert attrs["src"].startswith(f"data:image/{kind};base64,")


def test_what_is_no_picture_is_refused_and_a_page_written_as_it_is_shown(tmp_path):
    with pytest.raises(ValueError, match="no PNG, GIF or SVG"):
        html_of(replace(VIEW, parts=(Picture("P", b"MZ", "C"),)))
    write_page(tmp_path / "new" / "report.html", VIEW, FOOT)
    assert (tmp_path / "new" / "report.html").read_text(encoding="utf-8") == html_of(VIEW)


def drawn(label="design", xlabel="trial"):
    figure = Figure(figsize=(3.0, 2.0))
    axes = figure.subplots()
    axes.plot([1.0, 2.0], [3.0, 4.5], "o", label=label)
    axes.set_xlabel(xlabel)
    axes.set_ylabel("PRPV")
    return svg_of(figure)


def test_a_figure_is_part_of_the_page_its_markers_say_their_values_and_its_names_are_text_and_its_own():
    """An SVG is drawn inline, 160 pixels to the inch, and hovering a marker tells what it stands for."""
    page = html_of(replace(VIEW, parts=(Picture("P", drawn(), "C"),)))
    assert "<title>design; trial 1; PRPV 3</title>" in page
    assert "<title>design; trial 2; PRPV 4.5</title>" in page
    assert "width:480px" in page
    assert 'role="img"' in page
    # Whatever a figure refers to is its own, so that no figure changes another.
    page = html_of(replace(VIEW, parts=(Picture("P", drawn(), "C"), Picture("Q", drawn(), "C"))))
    names = re.findall(r' id="([^"]+)"', page)
    assert len(names) == len(set(names))
    assert set(re.findall(r'(?:href="#|url\(#)([^")]+)', page)) <= set(names)
    page = html_of(replace(VIEW, parts=(Picture("P", drawn("<script>x</script>--><b>", "<i>&"), "C"),)))
    assert "<script" not in page
    assert "<b>" not in page
    assert "<i>" not in page
