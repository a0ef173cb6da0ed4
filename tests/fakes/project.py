"""A copy of the project that a test may add to, and what is run in it."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]


def copy_project(folder: Path) -> Path:
    """Copy everything that is needed to run commands and the tests of the documents."""
    for part in ("proxytune", "robots", "studies", "docs", "benchmarks", "tests"):
        shutil.copytree(ROOT / part, folder / part, ignore=shutil.ignore_patterns("__pycache__", "*.png", "study.db"))
    for document in ("README.md", "CONTRIBUTING.md", "CITATION.cff", "CHANGELOG.md", "pyproject.toml"):
        shutil.copy(ROOT / document, folder)
    return folder


SMALL = {"budget = 24": "budget = 1", "seconds = 20.0": 'seconds = 1.0\nplant = "planar"', "initial = 8": "confirm = 0"}


def copy_studies(folder: Path) -> None:
    """Copy what studies are made of, quickstart so that it takes seconds."""
    made = shutil.ignore_patterns("study.db*", "figures", "*.md", "*.png")
    shutil.copytree(ROOT / "studies", folder / "studies", ignore=made)
    settings = folder / "studies" / "quickstart" / "study.toml"
    text = settings.read_text(encoding="utf-8")
    for whole, small in SMALL.items():
        assert whole in text
        text = text.replace(whole, small)
    settings.write_text(f"preflight = false\n{text}", encoding="utf-8")


def insert(path: Path, before: str, line: str) -> None:
    """Put a line before the only place where this text begins a line."""
    text = path.read_text(encoding="utf-8")
    assert text.count(f"\n{before}") == 1, f"{path}: {before}"
    path.write_text(text.replace(f"\n{before}", f"\n{line}\n{before}"), encoding="utf-8")


def run(folder: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    """Run Python in the copy."""
    return subprocess.run(
        [sys.executable, *arguments],
        cwd=folder,
        env={**os.environ, "PYTHONPATH": str(folder)},
        capture_output=True,
        text=True,
        check=False,
    )
