"""What figures share brings along nothing that a figure of a study has no use for."""

import subprocess
import sys

import pytest

HEAVY = ("pybullet", "skopt", "sklearn", "optuna", "torch", "proxytune.diagnosis.answer")


@pytest.mark.slow
@pytest.mark.parametrize(
    "module",
    [
        "proxytune.report.study.convergence",
        "proxytune.report.sweep.figures",
    ],
)
def test_a_figure_loads_no_simulator_no_library_of_models_and_no_diagnosis(module):
    line = f"import sys, {module}; print([name for name in {HEAVY} if name in sys.modules])"
    done = subprocess.run([sys.executable, "-c", line], capture_output=True, text=True, check=True)
    assert done.stdout == "[]\n"
