"""The pages that are to be followed work as they stand: their files are written, their commands and their Python run.

tests/test_extending.py does the same for docs/how-to/extending.md.
"""

import ast
import contextlib
import io
import os
import re
import runpy
import shlex
import socket
import subprocess
import sys
from pathlib import Path

import foreign_robot
import pytest
from planted import look_for_few
from processes import ENVIRONMENT
from project import copy_studies

import proxytune
from proxytune.cli.main import main
from proxytune.skeletons.writing import SIX

ROOT = Path(__file__).resolve().parent.parent
README = (ROOT / "README.md").read_text(encoding="utf-8")
TUTORIALS = sorted((ROOT / "docs" / "tutorials").glob("*.md"))
PYTHON = re.compile(r"```python\n(.*?)```(?:\n```text\n(.*?)```)?", flags=re.DOTALL)
FIGURES = (
    "wheel_radius=0.033,wheel_distance=0.16,full_speed=0.5,motor_time_constant=0.1,camera_height=0.1,camera_pitch=20"
)
QUICK = {
    "budget = 16": "budget = 5",
    "initial = 8": "initial = 4",
    "starts = 4": "starts = 2",
    "seconds = 10.0": "seconds = 5.0",
}


def page(name):
    return (ROOT / "docs" / "how-to" / f"{name}.md").read_text(encoding="utf-8")


def lines_of(text):
    """The lines of every block of commands."""
    return [line for block in re.findall(r"```sh\n(.*?)```", text, flags=re.DOTALL) for line in block.splitlines()]


def run_python(text):
    """Run every block of Python in one namespace; for each, what was printed and what is shown."""
    namespace = {}
    for code, shown in PYTHON.findall(text):
        with contextlib.redirect_stdout(io.StringIO()) as printed:
            exec(compile(code, "the page", "exec"), namespace)
        yield printed.getvalue(), shown


def words(output):
    """An output without its figures and layout: the search may go another way on another machine."""
    return " ".join(re.sub(r"[-−]?\d[\d.]*(e[-+]\d+)?", "#", output).split())


def followed(text, folder):
    """Write each file of a page and run each command, in their order; for each command, what it printed and shown."""

    def run(line):
        given = shlex.split(line)[1:]
        with contextlib.redirect_stdout(io.StringIO()) as printed:
            if given[0] == "-m":
                assert main(given[2:]) == 0, line
            else:
                runpy.run_path(given[0], run_name="__main__")
        return printed.getvalue()

    for kind, block in re.findall(r"^```(\w+)\n(.*?)^```", text, flags=re.DOTALL | re.MULTILINE):
        name, _, content = block.partition("\n")
        if kind in ("toml", "python") and name.startswith("# "):
            path = folder / name.removeprefix("# ")
            path.parent.mkdir(exist_ok=True)
            path.write_text(content, encoding="utf-8")
        elif kind == "sh":
            yield from ((run(line), "") for line in block.splitlines())
        elif kind == "console":
            for session in re.split(r"^\$ ", block, flags=re.MULTILINE)[1:]:
                command, _, shown = session.partition("\n")
                yield run(command), shown


@pytest.mark.slow
@pytest.mark.parametrize("tutorial", TUTORIALS, ids=lambda path: path.stem)
def test_a_tutorial_followed_word_for_word_prints_what_it_shows(tutorial, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "100")
    commands = 0
    for printed, shown in followed(tutorial.read_text(encoding="utf-8"), tmp_path):
        commands += 1
        after = words(printed)
        for expected in filter(None, map(words, re.split(r"^\.\.\.$", shown, flags=re.MULTILINE))):
            assert expected in after, f"{expected}\nis not in\n{after}"
            after = after.partition(expected)[2]
    assert commands >= 4


@pytest.mark.parametrize("text", [page("python"), README], ids=["docs/how-to/python.md", "README.md"])
def test_every_name_of_proxytune_that_the_documents_use_is_a_public_one(text):
    used = {
        node.attr
        for nodes in [ast.walk(ast.parse(code)) for code, _ in PYTHON.findall(text)]
        for node in nodes
        if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name) and node.value.id == "proxytune"
    }
    assert {"run_study", "score"} <= used <= set(proxytune.__all__)


def test_the_readme_shows_python_in_ten_lines_at_most():
    ((code, _),) = PYTHON.findall(README)
    assert len(code.splitlines()) <= 10


@pytest.mark.slow
def test_the_python_of_the_readme_runs(tmp_path, monkeypatch):
    """On quickstart made small."""
    copy_studies(tmp_path)
    monkeypatch.chdir(tmp_path)
    ((printed, _),) = run_python(README)
    assert "trim" in printed


@pytest.mark.slow
def test_the_page_about_python_runs_and_prints_what_it_shows(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for printed, shown in run_python(page("python")):
        assert words(printed) == words(shown)
    made = {"episode.png", "convergence.png", "my_study/report.html", "my_study/figures/profiles.png"}
    assert all((tmp_path / name).stat().st_size for name in made)


@pytest.mark.slow
def test_the_blocks_about_the_gymnasium_environment_print_what_is_shown(tmp_path, monkeypatch):
    pytest.importorskip("gymnasium")
    monkeypatch.chdir(tmp_path)
    for printed, shown in run_python(page("gymnasium").split("## Train a policy")[0]):
        assert printed.strip() == shown.strip()
    assert (tmp_path / "rendered.png").stat().st_size


@pytest.mark.slow
def test_the_blocks_about_training_run_with_fewer_steps(tmp_path, monkeypatch):
    pytest.importorskip("stable_baselines3")
    monkeypatch.chdir(tmp_path)
    text = page("gymnasium")
    assert text.count("STEPS = 40_000") == 1
    for printed, shown in run_python(text.split("## Any environment")[0].replace("STEPS = 40_000", "STEPS = 2_000")):
        assert words(printed) == words(shown)
    assert (tmp_path / "policies" / "policy_1.zip").stat().st_size


@pytest.mark.slow
def test_every_command_about_logs_runs_and_a_bag_says_what_its_log_says(tmp_path, monkeypatch, answered):
    """On a bag of a robot of nobody's."""
    pytest.importorskip("rosbags")
    look_for_few(monkeypatch, "wheel_gain")
    monkeypatch.chdir(tmp_path)
    answered("new", "robot", "my_robot", "--figures", FIGURES)
    made = foreign_robot.write_form(tmp_path, "ros1", [foreign_robot.drive(7, seconds=45.0)])
    (made / "run0.bag").rename("my_drives.bag")
    commands = [shlex.split(line, comments=True)[3:] for line in lines_of(page("logs"))]
    listed, imported, of_the_log, of_the_bag = (answered(*words) for words in commands)
    assert listed != imported
    assert of_the_log["verdict"] == of_the_bag["verdict"]
    assert of_the_log["effects"] == of_the_bag["effects"]
    assert "dead_band" in [effect["name"] for effect in of_the_bag["effects"]]


def test_the_page_about_a_robot_of_one_s_own_states_the_six_figures_that_a_skeleton_is_made_of():
    text = page("own_robot")
    assert re.findall(r"(\w+)=", lines_of(text)[0]) == list(SIX)
    assert tuple(re.findall(r"^\| `(\w+)` \|", text, flags=re.MULTILINE)) == SIX


@pytest.mark.slow
def test_every_command_about_a_robot_of_one_s_own_runs_and_the_dead_band_is_found(tmp_path, monkeypatch, answered):
    look_for_few(monkeypatch)
    monkeypatch.chdir(tmp_path)
    answers = {}
    for line in lines_of(page("own_robot")):
        given = shlex.split(line)[3:]
        answers[given[0]] = answered(*given)
        if given[:2] == ["new", "study"]:
            study = tmp_path / "rover_study" / "study.toml"
            text = study.read_text()
            for before, after in QUICK.items():
                assert before in text
                text = text.replace(before, after)
            study.write_text(text)
    found = answers["diagnose"]
    assert (found["verdict"], [effect["name"] for effect in found["effects"]]) == ("explained", ["dead_band"])
    assert found["effects"][0]["parameters"]["width"]["value"] == pytest.approx(0.06, abs=0.01)
    assert answers["predict"]["error"]["value"] < 0.02
    assert "dead_band.width" in [line["name"] for line in answers["export"]["no_place"]]


@pytest.mark.slow
def test_the_commands_about_a_cluster_start_a_scheduler_two_workers_and_a_study(make_study, tmp_path):
    """On a study that takes seconds."""
    pytest.importorskip("distributed")
    with socket.socket() as some:
        some.bind(("127.0.0.1", 0))
        port = str(some.getsockname()[1])
    folder = make_study(domain={"sleep": "0.01"})
    text = (
        page("cluster").split("## What it brings")[0].replace("8786", port).replace("studies/quickstart", str(folder))
    )
    install, *commands = lines_of(text)
    assert install == 'pip install ".[dask]"'
    path = os.pathsep.join([str(Path(sys.executable).parent), os.environ["PATH"]])
    started = []
    try:
        for line in commands[:-1]:
            given = shlex.split(line.removesuffix(" &")) + (["--no-dashboard"] if "worker" in line else [])
            quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
            started.append(subprocess.Popen(given, env={**ENVIRONMENT, "PATH": path}, cwd=tmp_path, **quiet))
        given = [sys.executable, *shlex.split(commands[-1])[1:]]
        done = subprocess.run(given, env=ENVIRONMENT, cwd=tmp_path, capture_output=True, text=True, timeout=120)
        assert done.returncode == 0, done.stderr
        assert "PRPV" in done.stdout
    finally:
        for process in started:
            process.terminate()
        for process in started:
            process.wait(30)
