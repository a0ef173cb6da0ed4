"""The Python that docs/how-to/gymnasium.md shows runs as it stands, and what it shows of its output is what it prints."""

import contextlib
import io
import re
from pathlib import Path

import pytest

pytest.importorskip("gymnasium")

PAGE = (Path(__file__).resolve().parent.parent / "docs" / "how-to" / "gymnasium.md").read_text(encoding="utf-8")
BLOCK = re.compile(r"```python\n(.*?)```(?:\n```text\n(.*?)```)?", flags=re.DOTALL)
TRAINING, AFTER = "## Train a policy", "## Any environment"
WHOLE, SMALL = "STEPS = 40_000", "STEPS = 2_000"


def run(text):
    """Run every block in one namespace; for each, what was printed and what is shown."""
    namespace = {}
    for code, shown in BLOCK.findall(text):
        with contextlib.redirect_stdout(io.StringIO()) as printed:
            exec(compile(code, "the page", "exec"), namespace)
        yield printed.getvalue(), shown


def words(output):
    """An output without its figures and layout."""
    return " ".join(re.sub(r"[-−]?\d[\d.]*(e[-+]\d+)?", "#", output).split())


def test_the_blocks_about_the_environment_print_what_is_shown(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for printed, shown in run(PAGE.split(TRAINING)[0]):
        assert printed.strip() == shown.strip()
    assert (tmp_path / "rendered.png").stat().st_size


@pytest.mark.slow
def test_the_blocks_about_training_run_with_fewer_steps(tmp_path, monkeypatch):
    pytest.importorskip("stable_baselines3")
    monkeypatch.chdir(tmp_path)
    assert PAGE.count(WHOLE) == 1
    for printed, shown in run(PAGE.split(AFTER)[0].replace(WHOLE, SMALL)):
        assert words(printed) == words(shown)
    assert (tmp_path / "policies" / "policy_1.zip").stat().st_size
