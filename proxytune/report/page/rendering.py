"""A page as one HTML file that needs nothing else."""

import base64
import html
from string import Template

from proxytune.report.page.parts import Page, Picture, Table, Words

PAGE = Template("""<!doctype html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width">
<title>$title</title>
</head>
<body>
<h1>$title</h1>
<p class="answer">$answer</p>
<p class="following">$following</p>
$parts
</body>
</html>
""")


def html_of(page: Page) -> str:
    """The page as HTML; every text in it is escaped."""
    return PAGE.substitute(
        title=html.escape(page.title),
        answer=html.escape(page.answer),
        following=html.escape(page.following),
        parts="".join(_part(part) for part in page.parts),
    )


def _part(part: Picture | Table | Words) -> str:
    heading = f"<h2>{html.escape(part.title)}</h2>"
    match part:
        case Picture():
            data = base64.b64encode(part.image).decode("ascii")
            return f'{heading}<p><img alt="{html.escape(part.caption)}" src="data:image/png;base64,{data}"></p>'
        case Table():
            rows = (part.columns, *part.rows)
            return heading + "<table>" + "".join(f"<tr>{_cells(row)}</tr>" for row in rows if row) + "</table>"
        case Words():
            return heading + "".join(f"<p>{html.escape(text)}</p>" for text in part.paragraphs)


def _cells(row: tuple[str, ...]) -> str:
    return "".join(f"<td>{html.escape(cell)}</td>" for cell in row)
