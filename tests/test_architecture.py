"""The folder listing is the architecture: imports go downwards, and libraries stay in their rooms."""

import ast
import importlib
import re
from functools import cache
from pathlib import Path

import pytest
from floors import floor

PACKAGE = Path(__file__).resolve().parent.parent / "proxytune"
ROOMS = {
    "pybullet": {"driving/bullet.py"},
    "numba": {"effects/compiled.py", "driving/compiled.py", "diagnosis/motion/compiled.py"},
    "skopt": {"search"},
    "optuna": {"search"},
    "gymnasium": {"environments"},
    "stable_baselines3": {"environments"},
    "mujoco": {"environments"},
    "rosbags": {"importing"},
    "sqlite3": {"storage"},
    "argparse": {"cli"},
}
MODULES = sorted(PACKAGE.rglob("*.py"))
DOORS = [path for path in MODULES if path.name == "__init__.py" and path.parent.name not in ("proxytune", "testing")]
"""The tables of those two are of what they hand out, by subject."""


def room_of(path):
    return path.relative_to(PACKAGE).parts[0].removesuffix(".py")


@cache
def nodes_of(path):
    """The imports of a module, as they stand."""
    tree = ast.walk(ast.parse(path.read_text(encoding="utf-8")))
    return [node for node in tree if isinstance(node, ast.Import | ast.ImportFrom)]


def imports(path):
    for node in nodes_of(path):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        else:
            assert node.level == 0, f"{path}: relative import"
            yield f"{node.module}"
            yield from (f"{node.module}.{alias.name}" for alias in node.names)


def modules_of(room):
    return [path for path in MODULES if room_of(path) == room]


def imported(room):
    return ((path, name) for path in modules_of(room) for name in imports(path))


of_each_room = pytest.mark.parametrize("here", sorted({room_of(path) for path in MODULES}))
"""By room, not by module: a thousand tests of a line each take longer to begin than to run."""


@of_each_room
def test_imports_go_downwards(here):
    for path, name in imported(here):
        if name.startswith("proxytune.") and (room := name.split(".")[1]) != here:
            assert floor(room) <= floor(here), f"{path} imports {room}, which is above it"
            assert floor(room) < floor(here) or floor(here) == 1, f"{path} imports {room}, which is on its floor"


@of_each_room
def test_libraries_stay_in_their_rooms(here):
    for path, name in imported(here):
        own = path.relative_to(PACKAGE).as_posix()
        allowed = ROOMS.get(name.split(".")[0])
        assert allowed is None or any(own == room or own.startswith(f"{room}/") for room in allowed), (
            f"{own} imports {name}"
        )


SHORT = {
    "__main__",
    "arrays",  # types, and one setting of NumPy
    "driving/agent",  # a protocol
    "learning/learner",  # a protocol
    "lineage",  # what its table says
}
"""Modules below 60 lines: protocols and types; doors (`__init__`) and commands, one module each, go without saying."""


@of_each_room
def test_a_module_is_worth_opening_and_has_one_subject(here):
    for path in modules_of(here):
        lines = len(path.read_text(encoding="utf-8").splitlines())
        known = path.relative_to(PACKAGE).with_suffix("").as_posix() in SHORT
        assert lines <= 600, path
        assert known or path.name == "__init__.py" or path.parent.name == "cli" or lines >= 60, path


@of_each_room
def test_a_room_is_entered_by_its_door(here):
    for path in modules_of(here):
        for node in nodes_of(path):
            if isinstance(node, ast.ImportFrom) and str(node.module).startswith("proxytune."):
                parts = str(node.module).split(".")
                assert parts[1] in (here, "cli") or len(parts) == 2, (
                    f"{path}: import this from proxytune.{parts[1]}: {ast.unparse(node)}"
                )


@pytest.mark.parametrize("door", sorted(PACKAGE.glob("*/__init__.pyi")), ids=lambda door: door.parent.name)
def test_a_door_hands_out_what_others_take_and_no_name_of_a_module(door):
    names = handed_out(door)
    assert not names & {path.stem for path in door.parent.glob("*") if path.suffix in {".py", ""}}
    room = f"proxytune.{door.parent.name}"
    assert set(importlib.import_module(room).__all__) == names
    for name in names:
        assert hasattr(importlib.import_module(room), name)


@pytest.mark.parametrize("path", DOORS, ids=lambda path: path.parent.name)
def test_a_doors_table_of_contents_has_its_modules_at_the_beginnings_of_lines(path):
    for line in ast.get_docstring(ast.parse(path.read_text(encoding="utf-8"))).splitlines():
        if entry := re.match(r"(\S.*?)  +\S", line.strip()):
            names = [name.rstrip("/") for name in entry[1].split(", ")]
            assert {part.stem for part in path.parent.iterdir()}.issuperset(names), f"{path}: {line}"


def handed_out(door):
    """The names that a door hands out."""
    tree = ast.parse(door.read_text(encoding="utf-8"))
    return {alias.name for node in tree.body if isinstance(node, ast.ImportFrom) for alias in node.names}


def test_no_room_is_a_drawer_and_the_package_imports_nothing_of_the_benchmarks():
    forbidden = {"utils", "common", "helpers", "misc", "base", "core"}
    assert not forbidden & {path.stem for path in MODULES} | forbidden & {path.parent.name for path in MODULES}
    benchmarks = {path.stem for path in (PACKAGE.parent / "benchmarks").iterdir()}
    assert "compare" in benchmarks
    for path in MODULES:
        assert not benchmarks & {name.split(".")[0] for name in imports(path)}, path


def rooms_loaded_with(room):
    """The rooms that a room imports, and those that these import."""
    found, waiting = set(), [room]
    while waiting:
        here = waiting.pop()
        names = [name for path in MODULES if room_of(path) == here for name in imports(path)]
        new = {name.split(".")[1] for name in names if name.startswith("proxytune.")} - found - {room}
        found |= new
        waiting += new
    return found


@pytest.mark.parametrize(
    ("room", "kept_out"),
    [("effects", {"logs", "domain"}), ("driving", {"logs", "study", "environments"}), ("study", {"driving"})],
)
def test_a_room_loads_nothing_that_it_has_no_use_for(room, kept_out):
    assert not rooms_loaded_with(room) & kept_out
