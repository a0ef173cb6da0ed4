"""Views as one HTML file that needs nothing else: on a desk, on a phone, in the dark and in print."""

import base64
import html
import re
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING

from PIL import Image

from proxytune.files import package_table
from proxytune.report.view import Column, Foot, Paragraphs, Part, Picture, Table, View, foot_of
from proxytune.report.writing import fill, svg_of, write_text

if TYPE_CHECKING:
    from pandas import DataFrame

MANY = 12
"""A page of more parts than this has a table of contents."""
SMALLEST = 0.7
"""A picture is made no smaller than this share of its width, so that 7 pt are 11 pixels; beyond that it scrolls."""
ENLARGED = 160.0
"""Pixels of the page to an inch of a figure, where 7 pt are about the page's 16 pixels."""
ABOUT = ("robot", "log", "target", "targets")
"""Settings that stand at the top of a page too."""
PROSE = 28
"""A cell of more characters than this is wrapped, and kept wide enough to be read."""
WORDS: dict[str, str] = package_table("report/templates/words.toml")
"""What a page explains at its foot of the words that it uses."""
STYLE = fill("page.css")


def write_page(path: Path, view: View, foot: Foot, renew_s: int = 0) -> None:
    """Write a view as a page; while the work is under way it loads itself again so often [s], 0 once it has ended."""
    write_text(path, page_html(view, foot, renew_s))


class Shown:
    """What has a view shows itself in a notebook, and has a page."""

    def view(self) -> View:
        """Sentence, next step, figures and tables."""
        raise NotImplementedError

    def _repr_html_(self) -> str:
        view = self.view()
        following = f"<p><strong>Next:</strong> {_text(view.next_step)}</p>" if view.next_step else ""
        return f"<h3>{html.escape(view.title)}</h3>\n<p>{_text(view.sentence)}</p>\n{following}\n{_parts(view)}"

    def page(self, path: str | Path | None = None) -> str:
        """The page as HTML; also written where a path is given.

        Raises:
            RunError: If it cannot be written.
        """
        text = page_html(self.view(), foot_of(""))
        if path is not None:
            write_text(Path(path), text)
        return text


def frame_html(sentence: str, frame: "DataFrame") -> str:
    """A sentence and a DataFrame as a piece of HTML for a notebook."""
    return f"<p>{_text(sentence)}</p>\n{frame.to_html(max_rows=20)}"


def page_html(view: View, foot: Foot, renew_s: int = 0) -> str:
    """A view as HTML; every text in it is escaped, and its policy forbids scripts and all that is elsewhere.

    Raises:
        ValueError: If a picture is no PNG, GIF or SVG.
    """
    renews = f"Under way: this page loads itself again every {renew_s} s."
    following = f'<p class="following"><strong>Next:</strong> {_text(view.next_step)}</p>\n'
    stated, parts = dict(foot.settings), _parts(view)
    about = [*(f"{name} {stated[name]}" for name in ABOUT if stated.get(name)), foot.date]
    titles = (html.escape(one.title) for one in view.parts)
    items = "".join(f'<li><a href="#part-{n}">{title}</a></li>' for n, title in enumerate(titles, start=1))
    return fill(
        "page.html.txt",
        title=html.escape(view.title),
        about=f'<p class="about">{html.escape(" · ".join(filter(None, about)))}</p>\n',
        style=STYLE,
        renew=f'<meta http-equiv="refresh" content="{renew_s}">\n' if renew_s else "",
        under_way=f'<p class="under-way" role="status">{renews}</p>\n' if renew_s else "",
        answer=_text(view.sentence),
        following=following if view.next_step else "",
        contents=f'<nav aria-label="Contents"><ol>{items}</ol></nav>\n' if len(view.parts) > MANY else "",
        parts=parts,
        foot=_foot(foot, parts + _text(view.sentence)),
    )


def _foot(foot: Foot, page: str) -> str:
    """How to come by the page again, and what the words of WORDS mean that it uses."""
    said = re.sub(r"<svg.*?</svg>|<[^>]*>", " ", page, flags=re.DOTALL)
    used = [f"<dt>{word}</dt><dd>{means}</dd>" for word, means in WORDS.items() if re.search(rf"\b{word}", said)]
    settings = Table("Settings", (Column(""), Column("")), foot.settings)
    parts = [_part(settings, "settings")] if foot.settings else []
    if foot.command:
        command = f"<pre><code>{html.escape(foot.command)}</code></pre>"
        parts.append(f'<section><h2 id="again">The command that makes this page</h2>{command}</section>')
    parts += [f'<section><h2 id="words">Words on this page</h2><dl>{"".join(used)}</dl></section>'] if used else []
    versions = ", ".join(f"{name} {version}" for name, version in foot.versions)
    written = [f"Written {foot.date}"] * bool(foot.date) + [f"with {versions}"] * bool(versions)
    return "\n".join([*parts, f"<p>{html.escape(' '.join(written))}.</p>" if written else ""])


def _parts(view: View) -> str:
    return "\n".join(_part(part, f"part-{number}") for number, part in enumerate(view.parts, start=1))


def _part(part: Part, place: str) -> str:
    heading = f'<h2 id="{place}">{html.escape(part.title)}</h2>'
    match part:
        case Picture():
            return f"<section>{heading}{_picture(part, place)}</section>"
        case Table():
            notes = "".join(f"<li>{_text(note)}</li>" for note in part.notes)
            below = f'<ul class="notes">{notes}</ul>' if notes else ""
            return f"<section>{heading}{_table(part, place)}{below}</section>"
        case Paragraphs():
            return f"<section>{heading}{''.join(f'<p>{_text(text)}</p>' for text in part.paragraphs)}</section>"


def _picture(part: Picture, place: str) -> str:
    alt = html.escape(f"{part.title}. {part.caption}".strip())
    image = part.image if isinstance(part.image, bytes) else svg_of(part.image)
    if b"<svg" in image[:1000]:
        drawing = _inline_svg(image.decode("utf-8"), place, alt)
    else:
        kind = "png" if image.startswith(b"\x89PNG\r\n") else "gif" if image.startswith(b"GIF8") else ""
        if not kind:
            raise ValueError("the picture is no PNG, GIF or SVG")
        source = f"data:image/{kind};base64,{base64.b64encode(image).decode('ascii')}"
        with Image.open(BytesIO(image)) as opened:  # It is drawn so wide where there is room
            dots = opened.info.get("dpi")
            width = round(opened.width * ENLARGED / dots[0]) if dots and dots[0] else opened.width
        size = f' width="{width}" style="--wide:{width}px;min-width:{SMALLEST * width:.0f}px"' if width else ""
        drawing = f'<span class="card"><img alt="{alt}" src="{source}"{size}></span>'
    card = f'<div class="scroll" role="region" tabindex="0" aria-labelledby="{place}">{drawing}</div>'
    # The alternative text says the same, so that it is not read twice.
    caption = f'<figcaption aria-hidden="true">{_text(part.caption)}</figcaption>' if part.caption else ""
    return f"<figure>{card}{caption}</figure>"


def _inline_svg(svg: str, place: str, alt: str) -> str:
    """A figure as part of the page, where markers show their titles; names in it are this figure's alone."""
    body = re.sub(r"<!--.*?-->|<metadata>.*?</metadata>|<style.*?</style>", "", svg, flags=re.DOTALL)
    body = re.sub(
        r' id="(?:figure|axes|patch|text|line2d|xtick|ytick|matplotlib)[^"]*"', "", body[body.index("<svg") :]
    )
    body = re.sub(r'( id="|"#|url\(#)(?=\w)', lambda one: f"{one[1]}{place}-", body)
    head, _, rest = body.partition(">")
    box = re.search(r'viewBox="[-\d.]+ [-\d.]+ ([\d.]+) ([\d.]+)"', head)
    width = float(box[1]) * ENLARGED / 72.0 if box else 0.0
    size = (
        f'{box[0]} style="--wide:{width:.0f}px;width:{width:.0f}px;min-width:{SMALLEST * width:.0f}px"' if box else ""
    )
    return f'<svg class="drawn" role="img" aria-label="{alt}" {size}>{rest}'


def _table(table: Table, label: str) -> str:
    """A table in a region of its own that scrolls; the first cell of each row names the row."""
    heads = "".join(
        f'<th scope="col"{_class(one)}>{html.escape(one.name).replace(chr(10), " ")}</th>' for one in table.columns
    )
    head = f"<thead><tr>{heads}</tr></thead>" if any(one.name for one in table.columns) else ""
    caption = f'<caption class="unseen">{html.escape(table.title)}</caption>'
    rows = "".join(f"<tr>{_row(row, table.columns)}</tr>" for row in table.rows)
    region = f'<div class="scroll" role="region" tabindex="0" aria-labelledby="{label}">'
    return f"{region}<table>{caption}{head}<tbody>{rows}</tbody></table></div>"


def _row(row: tuple[str, ...], columns: tuple[Column, ...]) -> str:
    first, *others = zip(row, columns, strict=True)
    kind = ' class="part"' if first[0].startswith(" ") else _class(first[1], len(first[0]))
    name = f'<th scope="row"{kind}>{_cell(first[0].strip(), first[1])}</th>'
    return name + "".join(f"<td{_class(one, len(cell))}>{_cell(cell, one)}</td>" for cell, one in others)


def _cell(text: str, column: Column) -> str:
    """A cell; numbers have a minus, not a hyphen."""
    plain = html.escape(text)
    return re.sub(r"(?<![\w.)-])-(?=\d)", "−", plain) if column.numbers else plain


def _class(column: Column, length: int = 0) -> str:
    return ' class="prose"' if length > PROSE else ' class="number"' if column.numbers else ""


def _text(text: str) -> str:
    """A text with what is between backticks as code, and [words](a/file) beside the page as a link."""
    said = re.split(r"`([^`]+)`", html.escape(text))
    link = r"\[([^\]\[]+)\]\((\w[\w./ -]*|\.\./[\w./ -]*)\)"
    said[::2] = [re.sub(link, r'<a href="\2">\1</a>', one) for one in said[::2]]
    # Options stay whole: a browser would break them after their hyphens.
    whole = [re.sub(r"(?<!\S)(--?\w[^ ]+)", r"<span>\1</span>", one) for one in said[1::2]]
    said[1::2] = [f"<code>{one}</code>" for one in whole]
    return "".join(said)
