"""An engine that is one module and its line in the registry is listed, compared and drawn."""

import json

import pytest
from project import copy_project, insert, run

ENGINE = '''"""The middle of the box, and from there a spiral."""

from dataclasses import dataclass
from math import cos, sin

from proxytune.search import from_unit
from proxytune.search import Engine


@dataclass(frozen=True)
class Spiral:
    """Proposes points of a spiral, whatever the scores."""

    def propose(self, space, trials, seed):
        """The next point of the spiral."""
        turn = 0.3 * len(trials)
        unit = [0.5 + 0.4 * turn / (1.0 + turn) * (cos, sin)[axis % 2](turn) for axis in range(len(space.intervals))]
        return from_unit(space, unit)


ENGINE = Engine("spiral", "spiral", "points of a spiral; learns nothing", Spiral)
'''
FEW = ("--engines", "spiral,sobol", "--seeds", "2", "--budget", "7", "--initial", "5", "--output", "out", "--json")


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A copy of the project with a tenth engine."""
    folder = copy_project(tmp_path_factory.mktemp("project"))
    engines = folder / "proxytune" / "search" / "engines"
    (engines / "spiral.py").write_text(ENGINE, encoding="utf-8")
    insert(engines / "registry.py", "    tree_parzen,\n", "    spiral,")
    insert(engines / "registry.py", "    sobol.ENGINE,\n", "    spiral.ENGINE,")
    return folder


@pytest.mark.slow
def test_a_tenth_engine_is_compared_to_its_figure(folder):
    answer = run(folder, "-m", "proxytune", "compare", "analytic", *FEW)
    assert answer.returncode == 0, answer.stderr
    assert [row["engine"] for row in json.loads(answer.stdout)["engines"]] == ["spiral", "sobol"]
    assert (folder / "out" / "compare.png").stat().st_size > 10_000


@pytest.mark.slow
def test_a_tenth_engine_is_listed_and_refused_where_it_is_not_documented(folder):
    rows = json.loads(run(folder, "-m", "proxytune", "list", "engines", "--json").stdout)["engines"]
    assert [row["what_it_proposes"] for row in rows if row["name"] == "spiral"] == [
        "points of a spiral; learns nothing"
    ]
    answer = run(folder, "-m", "pytest", "-n", "0", "tests/test_documents.py", "-k", "every_engine_is_documented")
    assert answer.returncode == 1
    assert "studies/README.md has no row for the engine 'spiral'" in answer.stdout
