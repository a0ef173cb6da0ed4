"""The folder listing is the architecture: imports go downwards, and libraries stay in their rooms."""

import ast
from pathlib import Path

import pytest
from floors import floor

PACKAGE = Path(__file__).resolve().parent.parent / "proxytune"
ROOMS = {
    "pybullet": {"driving/bullet"},
    "numba": {"driving/texels"},
    "skopt": {"search"},
    "optuna": {"search"},
    "torch": {"search"},
    "botorch": {"search"},
    "gpytorch": {"search"},
    "gymnasium": {"environments"},
    "stable_baselines3": {"environments"},
    "mujoco": {"environments"},
    "rosbags": {"importing"},
    "sqlite3": {"storage"},
    "argparse": {"cli"},
}
MODULES = sorted(PACKAGE.rglob("*.py"))


def room_of(path):
    return path.relative_to(PACKAGE).parts[0].removesuffix(".py")


def imports(path):
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path}: relative import"
            yield f"{node.module}"
            yield from (f"{node.module}.{alias.name}" for alias in node.names)


@pytest.mark.parametrize("path", MODULES, ids=lambda path: str(path.relative_to(PACKAGE)))
def test_imports_go_downwards(path):
    here = room_of(path)
    for name in imports(path):
        if name.startswith("proxytune.") and (room := name.split(".")[1]) != here:
            assert floor(room) <= floor(here), f"{here} imports {room}, which is above it"
            assert floor(room) < floor(here) or floor(here) == 1, f"{here} and {room} are on one floor"


@pytest.mark.parametrize("path", MODULES, ids=lambda path: str(path.relative_to(PACKAGE)))
def test_libraries_stay_in_their_rooms(path):
    here = path.relative_to(PACKAGE).as_posix()
    for name in imports(path):
        allowed = ROOMS.get(name.split(".")[0])
        assert allowed is None or any(here.startswith(f"{room}/") for room in allowed), f"{here} imports {name}"


@pytest.mark.parametrize("path", MODULES, ids=lambda path: str(path.relative_to(PACKAGE)))
def test_no_module_is_longer_than_600_lines(path):
    assert len(path.read_text(encoding="utf-8").splitlines()) <= 600


def test_no_room_is_a_drawer():
    forbidden = {"utils", "common", "helpers", "misc", "base", "core"}
    assert not forbidden & {path.stem for path in MODULES} | forbidden & {path.parent.name for path in MODULES}
