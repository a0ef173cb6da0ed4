"""Work that goes to other processes."""

import importlib
import sys
from pathlib import Path

from proxytune.running import working


def folder_of(module):
    return Path(importlib.import_module(module).__file__).parent.name


def in_processes(work, pieces):
    with working(work, pieces, jobs=2) as results:
        return list(results)


def test_a_process_that_has_done_other_work_looks_for_modules_where_its_work_now_does(tmp_path, monkeypatch):
    for name in ("before", "now"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "twice_there.py").touch()
    installed = list(sys.path)
    monkeypatch.setattr(sys, "path", [*installed, str(tmp_path / "before")])
    in_processes(str, range(4))
    monkeypatch.setattr(sys, "path", [*installed, str(tmp_path / "now"), str(tmp_path / "before")])
    assert in_processes(folder_of, ["twice_there"] * 4) == ["now"] * 4
