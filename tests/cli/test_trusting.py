"""Code beside a study is not run before it is trusted, and looking at a study runs none of it."""

import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from proxytune.cli.main import main
from proxytune.cli.trusting import is_trusted, memory, only_trusted_code, remember
from proxytune.errors import ExtensionError
from proxytune.extensions import import_beside, load
from proxytune.files import shipped

FAMILY = """
from pathlib import Path

import wobbly

(Path(__file__).parent / "was_run").write_text("yes")


def make(domain, *, model):
    return wobbly.wobbly(domain, model=model)
"""


@pytest.fixture(autouse=True)
def asked(monkeypatch, tmp_path):
    """Nothing is trusted yet."""
    monkeypatch.delenv("PROXYTUNE_TRUST")
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))


@pytest.fixture
def stranger(make_study, request):
    """A study whose family is a module of a name of its own."""
    module = f"family_of_{request.node.name.partition('[')[0]}"
    folder = make_study("stranger", family=f'"{module}:make"', budget="5")
    (folder / f"{module}.py").write_text(FAMILY)
    return folder


def complaint(capsys, *words):
    capsys.readouterr()
    assert main([*map(str, words)]) == 2
    out, told = capsys.readouterr()
    assert (out, told.count("\n")) == ("", 1)
    return told


COMMANDS = {
    "study": [],
    "sweep": ["--parameter", "trim"],
    "measure": ["--model", "m.toml", "--output", "out.csv"],
    "drive": ["--agent", "agent1"],
    "loop": ["--log", "nowhere"],
    "record": ["--model", "m.toml", "--output", "log"],
    "teach": [],
}


@pytest.mark.parametrize("command", COMMANDS)
def test_no_command_runs_code_that_nobody_has_trusted(stranger, capsys, monkeypatch, command):
    monkeypatch.chdir(stranger)
    (stranger / "m.toml").write_text("format = 1\n")
    told = complaint(capsys, command, stranger, *COMMANDS[command])
    assert "this runs code that has not been run here before: module 'family_of_test_no_command" in told
    assert "then add --trust, once for this folder, or set PROXYTUNE_TRUST=1" in told
    assert f"{stranger.resolve()}, where family_of_test_no_command" in told
    assert not (stranger / "was_run").exists()


@pytest.mark.parametrize("name", ["os:getcwd", "builtins:input", "time:sleep"])
def test_an_installed_function_is_not_called_because_a_stranger_names_it(make_study, capsys, name):
    folder = make_study("stranger", family=None, agents=f'["{name}", "steady"]', metrics='["distance:max"]')
    (folder / "target.csv").write_text(f"agent,episode,distance\n{name},0,1.0\nsteady,0,2.0\n")
    assert f"has not been run here before: module '{name.partition(':')[0]}'" in complaint(capsys, "study", folder)


def test_an_effect_is_no_way_round(make_study, capsys):
    agents = {"agents": '["laggy", "steady"]', "metrics": '["distance:max"]'}
    folder = make_study("stranger", domain={"effects": '{ "os:getcwd" = {} }'}, family=None, **agents)
    (folder / "target.csv").write_text("agent,episode,distance\nlaggy,0,1.0\nsteady,0,2.0\n")
    assert "has not been run here before: module 'os'" in complaint(capsys, "study", folder)


def test_what_is_named_beside_no_study_or_imported_by_another_way_is_asked_for_too(tmp_path):
    for asking in (lambda: load("os:sep", kind="effect"), lambda: import_beside("os", tmp_path)):
        assert asking() is not None
        with only_trusted_code(False), pytest.raises(ExtensionError, match="module 'os'"):
            asking()


def test_a_folder_is_trusted_once_and_then_edited_freely(stranger, capsys):
    assert main(["study", str(stranger), "--trust"]) == 0
    assert (stranger / "was_run").exists()
    module = next(stranger.glob("family_of*.py"))
    module.write_text(module.read_text() + "# another state\n")
    assert main(["study", str(stranger)]) == 0


def test_what_is_trusted_is_a_folder_and_not_its_copy_or_its_neighbour(stranger, tmp_path, capsys):
    remember(stranger)
    copy = tmp_path / "copy"
    shutil.copytree(stranger, copy)
    assert "has not been run here before" in complaint(capsys, "study", copy)
    (tmp_path / "link").symlink_to(stranger)
    assert is_trusted(tmp_path / "link")
    assert is_trusted(stranger / "loop" / "extended")
    assert not is_trusted(stranger.parent)


def test_a_folder_of_another_owner_at_the_same_path_is_asked_for_anew(stranger, capsys):
    remember(stranger)
    known = json.loads(memory().read_text())
    known["folders"][str(stranger.resolve())]["owner"] += 1
    memory().write_text(json.dumps(known))
    assert "has not been run here before" in complaint(capsys, "study", stranger)


def test_the_environment_variable_trusts_without_remembering(stranger, monkeypatch, capsys):
    monkeypatch.setenv("PROXYTUNE_TRUST", "1")
    assert main(["study", str(stranger)]) == 0
    assert not memory().exists()


@pytest.mark.parametrize("text", ["", "[", "{}", '{"folders": []}', '{"folders": {"/": 1}}'])
def test_a_damaged_memory_is_told_in_one_line(stranger, capsys, text):
    memory().parent.mkdir(parents=True)
    memory().write_text(text)
    assert f"{memory()}: is damaged; delete it" in complaint(capsys, "study", stranger)


def test_a_study_without_own_code_never_asks(make_study, capsys):
    folder = make_study("plain", family='"proxytune.no_such:family"')
    assert "has not been run here" not in complaint(capsys, "study", folder)


def test_what_new_writes_is_trusted(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert main(["new", "family", "my_simulator"]) == 0
    assert is_trusted(tmp_path / "my_simulator")


def test_the_code_of_shipped_studies_is_ours_wherever_it_lies_until_it_is_changed(tmp_path, capsys):
    folder = tmp_path / "pendulum"
    shutil.copytree(shipped("studies") / "gymnasium_pendulum", folder, ignore=shutil.ignore_patterns("study.db*"))
    (folder / "study.toml").write_text((folder / "study.toml").read_text().replace("format = 1", "format = 2"))
    from proxytune.cli.trusting import _is_shipped

    assert _is_shipped(folder, "pendulum")
    assert not _is_shipped(folder, "os")
    for name in ("mujoco.pyc", "mujoco.abi3.so", "mujoco/__init__.pyc", "__pycache__/pendulum.cpython-311.pyc"):
        (folder / name).parent.mkdir(exist_ok=True)
        (folder / name).write_bytes(b"anything")
        assert not _is_shipped(folder, "pendulum")
        with only_trusted_code(False), pytest.raises(ExtensionError, match=re.escape(name)):
            import_beside("pendulum", folder)
        (folder / name).unlink()
    assert _is_shipped(folder, "pendulum")
    (folder / "numpy.py").write_text("raise SystemExit")
    assert not _is_shipped(folder, "pendulum")


@pytest.mark.slow
@pytest.mark.parametrize("command", ["plot", "repair"])
def test_looking_at_a_study_runs_none_of_its_code(stranger, monkeypatch, capsys, command):
    monkeypatch.setenv("PROXYTUNE_TRUST", "1")
    assert main(["study", str(stranger)]) == 0
    assert main(["plot", str(stranger), "--json"]) == 0
    before = (stranger / "report.html").read_text()
    monkeypatch.delenv("PROXYTUNE_TRUST")
    (stranger / "was_run").unlink()
    next(stranger.glob("family_of*.py")).write_text("raise SystemExit(0)")
    # In a process of its own, which has imported nothing of it.
    here = {**os.environ, "PYTHONPATH": f"{Path(__file__).parents[2]}"}
    words = [sys.executable, "-m", "proxytune", command, str(stranger)]
    done = subprocess.run(words, capture_output=True, text=True, env=here, check=False)
    assert done.returncode == 0, done.stderr
    assert not (stranger / "was_run").exists()
    if command == "plot":
        assert _lasting(before) == _lasting((stranger / "report.html").read_text())


def _lasting(page):
    return [line for line in page.splitlines() if "foot" not in line and "Written" not in line]


def test_the_trials_of_a_study_are_exported_without_its_code(stranger, monkeypatch, capsys, tmp_path):
    monkeypatch.setenv("PROXYTUNE_TRUST", "1")
    assert main(["study", str(stranger)]) == 0
    monkeypatch.delenv("PROXYTUNE_TRUST")
    (stranger / "was_run").unlink()
    for module in list(sys.modules):
        if "family_of_test_the_trials" in module:
            del sys.modules[module]
    assert main(["export", str(stranger), "--to", "skopt", "--output", str(tmp_path / "trials.pkl")]) == 0
    assert not (stranger / "was_run").exists()


def test_a_caller_of_the_api_has_chosen_what_to_run(stranger):
    from proxytune.api.study import run_study

    assert len(run_study(stranger).trials()) == 5
    assert (stranger / "was_run").exists()
