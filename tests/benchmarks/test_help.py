"""A benchmark that is asked for help tells its usage, and measures nothing."""

import subprocess
import sys
from pathlib import Path

import pytest

FOLDER = Path(__file__).resolve().parents[2] / "benchmarks"
NEEDS = {"policy_training": ("torch", "gymnasium", "stable_baselines3")}
RUN_BY_ANOTHER = ("results_to_compare",)
NAMES = {path.stem for path in FOLDER.glob("*.py") if "sys.argv" in path.read_text()}
SCRIPTS = sorted(NAMES.difference(RUN_BY_ANOTHER))


@pytest.mark.slow
@pytest.mark.parametrize("script", SCRIPTS)
def test_help_is_the_usage(script):
    for library in NEEDS.get(script, ()):
        pytest.importorskip(library)
    words = [sys.executable, str(FOLDER / f"{script}.py"), "--help"]
    told = subprocess.run(words, capture_output=True, text=True, check=True, timeout=60)
    assert f"benchmarks/{script}.py" in told.stdout
