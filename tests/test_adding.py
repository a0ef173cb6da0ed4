"""An effect, an engine or a measure that is one class or module and its line is listed and used everywhere.

Where it is not documented it is refused; test_extending.py has an effect found by `diagnose`, test_compare.py an engine
compared.
"""

import json
import shutil

import pytest
from project import copy_project, insert, run

EFFECT = '''

@effect("weak_reverse", Stage.MOTION)
class WeakReverse(ShippedEffect):
    """The robot is slower backwards than forwards."""

    loss: float = parameter("", 0.0, 0.9, probes=(0.02, 0.05, 0.1, 0.2, 0.4, 0.8), source="made up")
    trace = Trace(
        cues=(Cue.DIRECTION,), shown=Means(Cue.DIRECTION, (Panel("forward", "forward speed [m/s]", "forward"),))
    )

    def apply(self, signal: Signal, memory: None) -> tuple[Signal, None]:
        """Slow down what is backwards."""
        forward = signal[..., :1]
        slowed = np.where(forward < 0.0, (1.0 - self.loss) * forward, forward)
        return np.concatenate((slowed, signal[..., 1:]), axis=-1), None
'''
ENGINE = '''"""Points of the design."""

from proxytune.search.engine import Engine, Sobol

AGAIN = Engine("again", "again", "points of the design; learns nothing", Sobol)
'''
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

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def folder(tmp_path_factory, make_studies):
    """A copy of the project with one more of each, two tables of scores and a study."""
    folder = copy_project(tmp_path_factory.mktemp("project"))
    effects, search, usefulness = (folder / "proxytune" / room for room in ("effects", "search", "usefulness"))
    with (effects / "motion.py").open("a", encoding="utf-8") as motion:
        motion.write(EFFECT)
    text = (effects / "catalogue.py").read_text(encoding="utf-8")
    slope = "motion.FloorSlope,"
    assert text.count(slope) == 2  # listed for two wheels, and for cars
    (effects / "catalogue.py").write_text(text.replace(slope, f"motion.WeakReverse, {slope}", 1), encoding="utf-8")
    (search / "again.py").write_text(ENGINE, encoding="utf-8")
    insert(search / "registry.py", "from proxytune.search.surrogate import", "from proxytune.search.again import AGAIN")
    insert(search / "registry.py", "    SOBOL,\n", "    AGAIN,")
    (usefulness / "largest.py").write_text(MEASURE, encoding="utf-8")
    insert(usefulness / "catalogue.py", "PRPV = Measure(", "from proxytune.usefulness import largest\n")
    insert(usefulness / "catalogue.py", "    MMRV,\n", "    largest.MEASURE,")
    (folder / "sim.csv").write_text(SIM)
    (folder / "real.csv").write_text(SIM.replace("D,1,3.1", "D,1,9.1"))
    shutil.copytree(make_studies(), folder / "study")
    shutil.copy(folder / "tests" / "fakes" / "wobbly.py", folder / "study")
    return folder


def test_an_effect_is_listed_and_looked_for_and_an_engine_listed(folder):
    rows = json.loads(run(folder, "-m", "proxytune", "list", "effects", "--json").stdout)["effects"]
    (row,) = [row for row in rows if row["effect"] == "weak_reverse"]
    assert (row["parameter"], row["stage"], row["source"]) == ("weak_reverse", "motion", "made up")
    tried = run(folder, "-c", "import proxytune.diagnosis; print(proxytune.diagnosis.MOTION_EFFECTS)").stdout
    assert "'weak_reverse'" in tried
    rows = json.loads(run(folder, "-m", "proxytune", "list", "engines", "--json").stdout)["engines"]
    (told,) = [row["what_it_proposes"] for row in rows if row["name"] == "again"]
    assert told == "points of the design; learns nothing"


@pytest.mark.parametrize(
    ("asked", "says"),
    [
        ("every_effect_and_its_parameters and weak_reverse", "effects.md has no row for the effect 'weak_reverse'"),
        ("every_engine_is_documented", "engines.md has no row for `again`"),
    ],
)
def test_what_has_no_row_in_the_documents_is_refused_in_words(folder, asked, says):
    answer = run(folder, "-m", "pytest", "-n", "0", "tests/test_documents.py", "-k", asked)
    assert answer.returncode == 1
    assert f"docs/reference/{says}" in answer.stdout


def test_score_tells_a_new_measure_in_its_document_and_its_table(folder):
    words = ("-m", "proxytune", "score", "--proxy", "sim.csv", "--target", "real.csv", "--metric", "distance:max")
    document = json.loads(run(folder, *words, "--json").stdout)
    assert document["largest_error"]["distance"] == pytest.approx(2.0)
    low, high = document["intervals"]["largest_error"]["distance"]
    assert low <= 2.0 <= high
    assert "Largest error distance" in run(folder, *words).stdout


def test_sweep_tells_a_new_measure_in_its_document_its_csv_and_its_lines(folder):
    words = ("-m", "proxytune", "sweep", "study", "--parameter", "trim", "--points", "3")
    answer = run(folder, *words, "--json")
    assert answer.returncode == 0, answer.stderr
    (curve,) = json.loads(answer.stdout)["curves"]
    assert set(curve["points"][0]["largest_error"]) == {"distance", "survival_time"}
    assert curve["shapes"]["largest_error_distance"]["better"] == "lower"
    table = (folder / "study" / "figures" / "sweep_trim.csv").read_text().splitlines()[0]
    assert "largest_error_distance,largest_error_distance_low,largest_error_distance_high" in table
    assert "trim: Largest error distance: lowest" in run(folder, *words).stdout
