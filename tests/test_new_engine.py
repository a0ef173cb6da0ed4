"""An engine that is one module and its line in the registry is listed; test_compare.py has one compared."""

import json

import pytest
from project import copy_project, insert, run

ENGINE = '''"""The middle of the box, and from there a spiral."""

from dataclasses import dataclass
from math import cos, sin

from proxytune.search.engine import Engine, from_unit


@dataclass(frozen=True)
class Spiral:
    """Proposes points of a spiral, whatever the scores."""

    def propose(self, space, trials, seed):
        """The next point of the spiral."""
        turn = 0.3 * len(trials)
        unit = [0.5 + 0.4 * turn / (1.0 + turn) * (cos, sin)[axis % 2](turn) for axis in range(len(space.intervals))]
        return from_unit(space, unit)


SPIRAL = Engine("spiral", "spiral", "points of a spiral; learns nothing", Spiral)
'''


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A copy of the project with a seventh engine."""
    folder = copy_project(tmp_path_factory.mktemp("project"))
    search = folder / "proxytune" / "search"
    (search / "spiral.py").write_text(ENGINE, encoding="utf-8")
    line = "from proxytune.search.spiral import SPIRAL"
    insert(search / "registry.py", "from proxytune.search.surrogate import", line)
    insert(search / "registry.py", "    SOBOL,\n", "    SPIRAL,")
    return folder


@pytest.mark.slow
def test_a_seventh_engine_is_listed_and_refused_where_it_is_not_documented(folder):
    rows = json.loads(run(folder, "-m", "proxytune", "list", "engines", "--json").stdout)["engines"]
    assert [row["what_it_proposes"] for row in rows if row["name"] == "spiral"] == [
        "points of a spiral; learns nothing"
    ]
    answer = run(folder, "-m", "pytest", "-n", "0", "tests/test_documents.py", "-k", "every_engine_is_documented")
    assert answer.returncode == 1
    assert "docs/reference/engines.md has no row for `spiral`" in answer.stdout
