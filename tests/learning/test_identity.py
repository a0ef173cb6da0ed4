"""What a learner has learnt is found again only by the same settings and the same code."""

import importlib
import sys

import pytest

from proxytune.learning.cloning import BehaviourCloning
from proxytune.learning.identity import learner_identity

MINE = """
from dataclasses import dataclass
from my_cells import cells
import my_unused

@dataclass(frozen=True)
class Mine:
    size: int = 3
"""


@pytest.fixture
def identity(tmp_path, monkeypatch):
    """The identity of a learner whose module and the one beside it are as written."""
    monkeypatch.syspath_prepend(str(tmp_path))
    names = ("my_learner", "my_cells", "my_unused")

    def identity_of(mine=MINE, cells="def cells(): return 1", size=3):
        for name, text in zip(names, (mine, cells, "VALUE = 1"), strict=True):
            (tmp_path / f"{name}.py").write_text(text)
            sys.modules.pop(name, None)
        importlib.invalidate_caches()
        monkeypatch.setattr(sys, "dont_write_bytecode", True)
        return learner_identity(importlib.import_module("my_learner").Mine(size))

    yield identity_of
    for name in names:
        sys.modules.pop(name, None)


def test_it_is_another_by_other_settings_other_code_or_other_code_beside_it(identity):
    others = [identity(size=4), identity(mine=MINE + "    more: int = 1\n"), identity(cells="def cells(): return 2")]
    assert len({identity(), *others}) == 4


def test_comments_and_time_do_not_change_it(identity):
    assert identity() == identity(mine=MINE + "\n# a remark\n") == identity(cells="def cells(): return 1  # one")


def test_a_shipped_learner_is_known_by_what_it_sees_of_pictures_too(monkeypatch):
    files = []
    monkeypatch.setattr("proxytune.learning.identity.meaning_of", lambda paths, root: files.extend(paths) or "")
    learner_identity(BehaviourCloning())
    assert {"cloning.py", "pictures.py"} <= {path.name for path in files}
    assert "settings.py" not in {path.name for path in files}
