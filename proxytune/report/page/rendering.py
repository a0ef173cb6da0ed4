"""A page as one HTML file that needs nothing else."""

import html
import re
from string import Template

from proxytune.report.page.images import drawn
from proxytune.report.page.parts import Foot, Page, Picture, Table, Words
from proxytune.report.page.style import STYLE
from proxytune.report.page.tables import table_html

MANY = 12
"""A page of more parts than this has a table of contents."""
SMALLEST = 0.47
"""A picture is made no smaller than this share of its width, so that it can be read; beyond that it scrolls."""

PAGE = Template("""<!doctype html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta http-equiv="Content-Security-Policy" content="default-src 'none'; img-src data:; style-src 'unsafe-inline'">
$renew<link rel="icon" href="data:,">
<title>$title</title>
<style>$style</style>
</head>
<body>
<header>
<h1>$title</h1>
$under_way<p class="answer">$answer</p>
$following</header>
$contents<main>
$parts
</main>
<footer>
$foot
</footer>
</body>
</html>
""")


def html_of(page: Page) -> str:
    """The page as HTML; every text in it is escaped, and its policy forbids scripts and all that is elsewhere.

    Raises:
        ValueError: If a picture is no PNG, GIF or SVG.
    """
    numbered = list(enumerate(page.parts, start=1))
    return PAGE.substitute(
        title=html.escape(page.title),
        style=STYLE,
        renew=f'<meta http-equiv="refresh" content="{page.renew_s}">\n' if page.renew_s else "",
        under_way=_under_way(page.renew_s),
        answer=_text(page.answer),
        following=f'<p class="following"><strong>Next:</strong> {_text(page.following)}</p>\n' * bool(page.following),
        contents=_contents(page) if len(page.parts) > MANY else "",
        parts="\n".join(_part(part, f"part-{number}") for number, part in numbered),
        foot=_foot(page.foot),
    )


def _under_way(renew_s: int) -> str:
    renews = f"Under way: this page loads itself again every {renew_s} s."
    return f'<p class="under-way" role="status">{renews}</p>\n' if renew_s else ""


def _contents(page: Page) -> str:
    items = (f'<li><a href="#part-{n}">{html.escape(one.title)}</a></li>' for n, one in enumerate(page.parts, start=1))
    return f'<nav aria-label="Contents"><ol>{"".join(items)}</ol></nav>\n'


def _part(part: Picture | Table | Words, place: str) -> str:
    heading = f'<h2 id="{place}">{html.escape(part.title)}</h2>'
    match part:
        case Picture():
            return f"<section>{heading}{_picture(part, place)}</section>"
        case Table():
            return f"<section>{heading}{table_html(part, place)}{_notes(part.notes)}</section>"
        case Words():
            return f"<section>{heading}{''.join(f'<p>{_text(text)}</p>' for text in part.paragraphs)}</section>"


def _picture(part: Picture, place: str) -> str:
    source, width = drawn(part.image)
    size = f' width="{width}" style="min-width:{SMALLEST * width:.0f}px"' if width else ""
    alt = html.escape(f"{part.title}. {part.caption}".strip())
    card = f'<div class="scroll" role="region" tabindex="0" aria-labelledby="{place}"><span class="card">'
    # The alternative text says the same, so that it is not read twice.
    caption = f'<figcaption aria-hidden="true">{_text(part.caption)}</figcaption>' if part.caption else ""
    return f'<figure>{card}<img alt="{alt}" src="{source}"{size}></span></div>{caption}</figure>'


def _notes(notes: tuple[str, ...]) -> str:
    return f'<ul class="notes">{"".join(f"<li>{_text(note)}</li>" for note in notes)}</ul>' if notes else ""


def _foot(foot: Foot) -> str:
    settings = Table("Settings", (), foot.settings)
    versions = ", ".join(f"{name} {version}" for name, version in foot.versions)
    parts = [_part(settings, "settings")] if foot.settings else []
    if foot.command:
        command = f"<pre><code>{html.escape(foot.command)}</code></pre>"
        parts.append(f'<section><h2 id="again">The command that makes this page</h2>{command}</section>')
    written = [f"Written {foot.date}"] * bool(foot.date) + [f"with {versions}"] * bool(versions)
    return "\n".join([*parts, f"<p>{html.escape(' '.join(written))}.</p>" if written else ""])


def _text(text: str) -> str:
    """A text with what is between backticks as code."""
    return re.sub(r"`([^`]+)`", r"<code>\1</code>", html.escape(text))
