"""The Python that the documents show runs as it stands, and what they show of its output is what it prints."""

import ast
import contextlib
import io
import re
import shutil
from pathlib import Path

import pytest

import proxytune

ROOT = Path(__file__).resolve().parent.parent
PAGE = (ROOT / "docs" / "how-to" / "python.md").read_text(encoding="utf-8")
README = (ROOT / "README.md").read_text(encoding="utf-8")
BLOCK = re.compile(r"```python\n(.*?)```(?:\n```text\n(.*?)```)?", flags=re.DOTALL)
SMALL = {"budget = 24": "budget = 1", "seconds = 20.0": 'seconds = 1.0\nplant = "planar"', "initial = 8": "confirm = 0"}


def blocks(text):
    """Every block of Python with the output shown beneath it."""
    return BLOCK.findall(text)


def run(text):
    """Run every block in one namespace; for each, what was printed and what is shown."""
    namespace = {}
    for code, shown in blocks(text):
        with contextlib.redirect_stdout(io.StringIO()) as printed:
            exec(compile(code, "the page", "exec"), namespace)
        yield printed.getvalue(), shown


def words(output):
    """An output without its figures and layout: the search may go another way on another machine."""
    return " ".join(re.sub(r"[-−]?\d[\d.]*(e[-+]\d+)?", "#", output).split())


@pytest.mark.parametrize("text", [PAGE, README], ids=["docs/how-to/python.md", "README.md"])
def test_every_name_of_proxytune_that_the_documents_use_is_a_public_one(text):
    trees = [ast.walk(ast.parse(code)) for code, _ in blocks(text)]
    used = {
        node.attr
        for nodes in trees
        for node in nodes
        if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name) and node.value.id == "proxytune"
    }
    assert {"run_study", "score"} <= used <= set(proxytune.__all__)


def test_the_readme_shows_python_in_ten_lines_at_most():
    ((code, _),) = blocks(README)
    assert len(code.splitlines()) <= 10


@pytest.mark.slow
def test_the_python_of_the_readme_runs(tmp_path, monkeypatch):
    """On quickstart made small."""
    made = shutil.ignore_patterns("study.db*", "figures", "*.md", "*.png")
    shutil.copytree(ROOT / "studies", tmp_path / "studies", ignore=made)
    settings = tmp_path / "studies" / "quickstart" / "study.toml"
    text = settings.read_text(encoding="utf-8")
    for whole, small in SMALL.items():
        assert whole in text
        text = text.replace(whole, small)
    settings.write_text(f"preflight = false\n{text}", encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    ((printed, _),) = run(README)
    assert "trim" in printed


@pytest.mark.slow
def test_the_page_about_python_runs_and_prints_what_it_shows(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for printed, shown in run(PAGE):
        assert words(printed) == words(shown)
    made = {"episode.png", "convergence.png", "my_study/report.html", "my_study/figures/profiles.png"}
    assert all((tmp_path / name).stat().st_size for name in made)
