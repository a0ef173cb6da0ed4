"""The site is made of the Markdown files where they lie: README.md, docs/, studies/, robots/, benchmarks/."""

import importlib.util
import re
from pathlib import Path
from typing import Any

from latex2mathml.converter import convert
from mkdocs.config.defaults import MkDocsConfig
from mkdocs.exceptions import PluginError
from mkdocs.structure.files import File, Files

ROOT = Path(__file__).resolve().parents[2]
PAGES = ("*.md", "docs/**/*.md", "studies/**/*.md", "robots/*.md", "benchmarks/**/*.md")
STYLE = "docs/site/extra.css"
FONT = "docs/site/STIXTwoMath-Regular.ttf"
"""From the package ziamath: few systems have a font that mathematics can be set in."""
LINK = re.compile(r"\]\(([^)#\s]+)")
FORMULA = re.compile(
    r'<(?P<tag>div|span) class="arithmatex">\\(?P<open>[\[(])(?P<tex>.*?)\\[\])]</(?P=tag)>', re.DOTALL
)


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Take every page, and every file that a page links to, by its path in the repository: links hold as on GitHub."""
    pages = sorted({path for pattern in PAGES for path in ROOT.glob(pattern)})
    linked = {(page.parent / target).resolve() for page in pages for target in LINK.findall(page.read_text("utf-8"))}
    others = sorted(path for path in linked - set(pages) if path.is_file() and path.is_relative_to(ROOT))
    kept = [file for file in files if file.src_dir != config.docs_dir]  # the theme's own
    names = [path.relative_to(ROOT).as_posix() for path in (*pages, *others)] + [STYLE]
    font = File.generated(config, FONT, content=_font().read_bytes())
    return Files([*kept, font, *(File(name, str(ROOT), config.site_dir, config.use_directory_urls) for name in names)])


def _font() -> Path:
    found = importlib.util.find_spec("ziamath")
    if found is None or found.origin is None:
        raise PluginError('the site\'s formulas need a font; pip install ".[docs]"')
    return Path(found.origin).parent / "fonts" / Path(FONT).name


def on_page_content(html: str, page: Any, **_: Any) -> str:
    """Turn formulas into MathML, which browsers draw by themselves: no script, no font, no network."""

    def formula(found: re.Match[str]) -> str:
        tex = found["tex"].replace("&lt;", "<").replace("&gt;", ">").replace("&amp;", "&")
        display = found["open"] == "["
        made = convert(tex, display="block" if display else "inline")
        if re.search(r">(\\[a-zA-Z]+|&)<", made):
            raise PluginError(f"{page.file.src_uri}: latex2mathml does not know a part of this formula: {tex}")
        return f'<div class="formula">{made}</div>' if display else made

    return FORMULA.sub(formula, html)
