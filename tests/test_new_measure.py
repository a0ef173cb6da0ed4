"""A measure that is one module and its line in the catalogue is in every report."""

import json
import shutil

import pytest
from project import copy_project, insert, run

MEASURE = '''"""The largest error of a mean score."""

import numpy as np

from proxytune.usefulness.catalogue import Measure


def largest_error(proxy, target, metrics):
    """Over the agents, per metric."""
    return np.abs(proxy - target).max(axis=-2)


MEASURE = Measure(
    key="largest_error",
    name="Largest error",
    title="largest error of a mean score",
    better="lower",
    meaning="in the metric's unit, from 0",
    digits=".2f",
    per_metric=True,
    on_means=largest_error,
)
'''
SIM = "agent,episode,distance\n" + "".join(f"{a},{e},{n + 0.1 * e}\n" for n, a in enumerate("ABCD") for e in (1, 2, 3))


@pytest.fixture(scope="module")
def folder(tmp_path_factory, make_studies):
    """A copy of the project with one more measure, two tables of scores and a study."""
    folder = copy_project(tmp_path_factory.mktemp("project"))
    room = folder / "proxytune" / "usefulness"
    (room / "largest.py").write_text(MEASURE, encoding="utf-8")
    insert(room / "catalogue.py", "PRPV = Measure(", "from proxytune.usefulness import largest\n")
    insert(room / "catalogue.py", "    MMRV,\n", "    largest.MEASURE,")
    (folder / "sim.csv").write_text(SIM)
    (folder / "real.csv").write_text(SIM.replace("D,1,3.1", "D,1,9.1"))
    shutil.copytree(make_studies(), folder / "study")
    shutil.copy(folder / "tests" / "fakes" / "wobbly.py", folder / "study")
    return folder


@pytest.mark.slow
def test_score_tells_a_new_measure_in_its_document_and_its_table(folder):
    words = ("-m", "proxytune", "score", "--proxy", "sim.csv", "--target", "real.csv", "--metric", "distance:max")
    document = json.loads(run(folder, *words, "--json").stdout)
    assert document["largest_error"]["distance"] == pytest.approx(2.0)
    low, high = document["intervals"]["largest_error"]["distance"]
    assert low <= 2.0 <= high
    assert "Largest error distance" in run(folder, *words).stdout


@pytest.mark.slow
def test_sweep_tells_a_new_measure_in_its_document_its_csv_and_its_lines(folder):
    answer = run(folder, "-m", "proxytune", "sweep", "study", "--parameter", "trim", "--points", "3", "--json")
    assert answer.returncode == 0, answer.stderr
    (curve,) = json.loads(answer.stdout)["curves"]
    assert set(curve["points"][0]["largest_error"]) == {"distance", "survival_time"}
    assert curve["shapes"]["largest_error_distance"]["better"] == "lower"
    table = (folder / "study" / "figures" / "sweep_trim.csv").read_text().splitlines()[0]
    assert "largest_error_distance,largest_error_distance_low,largest_error_distance_high" in table
    answer = run(folder, "-m", "proxytune", "sweep", "study", "--parameter", "trim", "--points", "3")
    assert "trim: Largest error distance: lowest" in answer.stdout
