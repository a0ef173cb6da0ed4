import shutil

import pytest

from proxytune.search import digest
from proxytune.search.digest import code_of
from proxytune.search.engines.registry import engine_code


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """A room of four modules: a imports b, and c within a function; d stands alone."""
    (tmp_path / "search").mkdir()
    (tmp_path / "search" / "a.py").write_text(
        "import numpy\nfrom proxytune.search.b import x\n\ndef f():\n    from proxytune.search import c\n"
    )
    for name in "bcd":
        (tmp_path / "search" / f"{name}.py").write_text("x = 1\n")
    monkeypatch.setattr(digest, "FOLDER", tmp_path)
    code_of.cache_clear()
    yield tmp_path
    code_of.cache_clear()


def edited(path):
    before = code_of("proxytune.search.a")
    path.write_text(path.read_text() + "y = 2\n")
    code_of.cache_clear()
    return code_of("proxytune.search.a") != before


@pytest.mark.parametrize("name", ["a", "b", "c"])
def test_an_edit_of_what_a_module_imports_anywhere_changes_its_digest(folder, name):
    assert edited(folder / "search" / f"{name}.py")


def test_a_comment_changes_no_digest(folder):
    before, path = code_of("proxytune.search.a"), folder / "search" / "b.py"
    path.write_text(f"# edited\n{path.read_text()}")
    code_of.cache_clear()
    assert code_of("proxytune.search.a") == before


def test_an_edit_of_anything_else_does_not(folder):
    assert not edited(folder / "search" / "d.py")


def test_modules_that_import_each_other_have_a_digest(folder):
    (folder / "search" / "b.py").write_text("from proxytune.search.a import f\n")
    assert code_of("proxytune.search.a") == code_of("proxytune.search.b", "proxytune.search.a")


def test_runs_of_a_peer_outlast_an_edit_of_another_engine(tmp_path, monkeypatch):
    shutil.copytree(digest.FOLDER / "search", tmp_path / "search")
    monkeypatch.setattr(digest, "FOLDER", tmp_path)
    code_of.cache_clear()
    before = {engine: engine_code(engine) for engine in ("outcomes", "gp", "qlognei", "random")}
    with (tmp_path / "search" / "knowledge" / "likelihood.py").open("a") as file:
        file.write("EDITED = 1\n")
    code_of.cache_clear()
    changed = {engine for engine, code in before.items() if engine_code(engine) != code}
    code_of.cache_clear()
    assert changed == {"outcomes"}
