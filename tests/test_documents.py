"""What a user can type is documented, and what is documented works."""

import argparse
import json
import os
import re
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from compare import STAND_INS, parser as compare_parser
from floors import floor

from proxytune.cli.main import BAD_INPUT, COMMANDS, DONE, FAILED, main, parser
from proxytune.cli.terminal.interruption import INTERRUPTED, TERMINATED
from proxytune.driving import AGENTS, METRICS, UNITS, map_names
from proxytune.effects import CATALOGUE, GROUPS
from proxytune.files import shipped
from proxytune.learning.settings import KEYS as TEACHING_KEYS
from proxytune.report.diagnosis.notes import MEANINGS
from proxytune.search import ENGINES
from proxytune.settings import read_settings
from proxytune.study.settings import KEYS
from proxytune.usefulness import MEASURES, PODS

ROOT = Path(__file__).resolve().parent.parent
README = (ROOT / "README.md").read_text(encoding="utf-8")
COMMANDS_PAGE = (ROOT / "docs" / "commands.md").read_text(encoding="utf-8")
STUDIES = (ROOT / "studies" / "README.md").read_text(encoding="utf-8")
ROBOTS = (ROOT / "robots" / "README.md").read_text(encoding="utf-8")
DOCS = {path: path.read_text(encoding="utf-8") for path in sorted((ROOT / "docs").glob("*.md"))}
LOGS_PAGE = (ROOT / "docs" / "logs.md").read_text(encoding="utf-8")

LONGEST_README = 120
"""Lines: the README is read in one go; the rest is in docs/."""
RUN_ELSEWHERE = ("cluster.md", "extending.md", "logs.md", "own_robot.md")
"""Their commands need what comes before them; tests of their own run them."""
COMMAND_LINES = sorted(
    {
        line.removeprefix("$ ")
        for text in (README, *(text for path, text in DOCS.items() if path.name not in RUN_ELSEWHERE))
        for block in re.findall(r"```(?:sh|console)\n(.*?)```", text, flags=re.DOTALL)
        for line in block.splitlines()
        if line.removeprefix("$ ").startswith("python -m proxytune")
    }
)


def options():
    subcommands = next(a for a in parser()._actions if isinstance(a, argparse._SubParsersAction))
    for name, command in subcommands.choices.items():
        for action in command._actions:
            yield from ((name, flag) for flag in action.option_strings if flag.startswith("--") and flag != "--help")


@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_is_documented(command):
    assert f"python -m proxytune {command}" in COMMANDS_PAGE


@pytest.mark.parametrize(("command", "option"), sorted(set(options())))
def test_every_option_is_documented(command, option):
    row = next(line for line in COMMANDS_PAGE.splitlines() if line.startswith(f"| `{command}"))
    of_a_source = "what `import` reads, with its options" in row and f"`{option}" in LOGS_PAGE
    assert f"`{option}" in row or of_a_source or option in ("--json", "--format", "--trust")
    assert "`--json`" in COMMANDS_PAGE
    assert "`--format svg,pdf`" in COMMANDS_PAGE
    assert "`--trust`" in COMMANDS_PAGE


@pytest.mark.parametrize("engine", ENGINES, ids=lambda engine: engine.name)
def test_every_engine_is_documented_with_what_it_learns_from_and_what_installs_it(engine):
    table = STUDIES.split("## Engines")[1].split("\n## ")[0]
    row = next((line for line in table.splitlines() if line.startswith(f"| `{engine.name}` |")), "")
    assert row, f"studies/README.md has no row for the engine '{engine.name}'"
    cells = [cell.strip() for cell in row.strip("|").split("|")]
    assert cells[1:3] == [engine.learns_from, "yes" if engine.in_studies else ""]
    assert engine.needs is None or f'pip install "proxytune[{engine.needs.extra}]"' in cells[3]


def test_every_engine_is_listed_with_how_it_proposes(capsys):
    assert main(["list", "engines", "--json"]) == 0
    listed = {row["name"]: row for row in json.loads(capsys.readouterr().out)["engines"]}
    assert list(listed) == [engine.name for engine in ENGINES]
    for engine in ENGINES:
        row = listed[engine.name]
        assert (row["label"], row["what_it_proposes"]) == (engine.label, engine.summary)
        assert row["label"]
        assert row["what_it_proposes"]


@pytest.mark.parametrize("measure", [*MEASURES, *PODS], ids=lambda measure: measure.key)
def test_every_measure_is_documented_with_its_name_spelt_out_and_its_direction(measure):
    table = STUDIES.split("## Measures of usefulness")[1].split("\n## ")[0]
    row = next((line for line in table.splitlines() if line.startswith(f"| {measure.name} |")), "")
    assert row, f"studies/README.md has no row for the measure '{measure.name}'"
    assert f"| `{measure.key}` | {measure.title} | {measure.better} |" in row
    assert ("per metric" in row) == measure.per_metric


def test_every_benchmark_that_a_page_names_is_there_and_each_has_a_row_in_their_readme():
    folder = ROOT / "benchmarks"
    rows = [line for line in (folder / "README.md").read_text(encoding="utf-8").splitlines() if line.startswith("|")]
    pages = [*DOCS.values(), STUDIES, *(path.read_text(encoding="utf-8") for path in folder.rglob("*.md"))]
    named = {name for text in pages for name in re.findall(r"[ `]benchmarks/(\w+\.py)", text)}
    ends = ('if __name__ == "__main__":', "-m pytest benchmarks/")
    runs = {path.name for path in folder.glob("*.py") if any(one in path.read_text(encoding="utf-8") for one in ends)}
    assert named == runs
    assert runs <= {name for row in rows for name in re.findall(r" benchmarks/(\w+\.py)", row)}


@pytest.mark.parametrize("name", STAND_INS)
def test_every_problem_of_the_comparison_is_documented_with_what_came_out(name):
    assert f"compare.py {name} " in (ROOT / "benchmarks" / "compare.md").read_text(encoding="utf-8")


def test_every_option_of_the_comparison_is_documented():
    page = (ROOT / "benchmarks" / "README.md").read_text(encoding="utf-8")
    options = [flag for action in compare_parser()._actions for flag in action.option_strings if flag.startswith("--")]
    assert [option for option in options if f"`{option}" not in page and option != "--help"] == []


@pytest.mark.parametrize("key", [*KEYS, "robot", "plant", "camera", "map", "seconds", "position_noise_m", "effects"])
def test_every_study_key_is_documented(key):
    assert re.search(rf"^\| `\[?{key}\]?` ", STUDIES, flags=re.MULTILINE)


@pytest.mark.parametrize("key", TEACHING_KEYS)
def test_every_key_of_teaching_is_documented(key):
    table = STUDIES.split("## [teaching]")[1].split("\n## ")[0]
    assert re.search(rf"^\| `{key}` ", table, flags=re.MULTILINE)


@pytest.mark.parametrize("name", CATALOGUE)
def test_every_effect_and_its_parameters_are_documented(name):
    row = next((line for line in STUDIES.splitlines() if line.startswith(f"| `{name}`")), "")
    assert row, f"studies/README.md has no row for the effect '{name}'"
    assert CATALOGUE[name].stage.value in row
    assert all(f"`{parameter.name}`" in row for parameter in CATALOGUE[name].parameters)


@pytest.mark.parametrize("group", GROUPS)
def test_every_group_that_can_be_learnt_and_its_channels_are_documented(group):
    learnt = STUDIES.split("What was learnt", 1)[1].splitlines()
    row = next(line for line in learnt if line.startswith(f"| `{group}`"))
    assert all(f"`{channel}`" in row for channel in GROUPS[group].channels)


@pytest.mark.parametrize("metric", METRICS)
def test_every_metric_is_documented(metric):
    assert f"`{metric}` [{METRICS[metric]}]" in STUDIES


@pytest.mark.parametrize("figure", UNITS)
def test_every_figure_of_a_robot_is_documented(figure):
    assert f"`{figure}`" in ROBOTS


@pytest.mark.parametrize("name", map_names())
def test_every_map_and_its_keys_are_documented(name):
    maps = ROBOTS.split("## Maps")[1]
    assert re.search(rf"^\| `{name}` ", maps, flags=re.MULTILINE)
    settings = read_settings(shipped("robots") / "maps" / f"{name}.toml").values
    for key in {*settings, *settings["road"], *settings["paint"]} - {"road", "paint"}:
        assert f"`{key}`" in maps, key


def test_every_agent_is_listed_with_how_it_drives(capsys):
    assert main(["list", "agents", "--json"]) == 0
    listed = {row["name"]: row["how_it_drives"] for row in json.loads(capsys.readouterr().out)["agents"]}
    assert set(listed) == set(AGENTS)
    assert all("speed=" in how for how in listed.values())


def test_every_room_is_in_the_readme_in_reading_order():
    listing = (path.name for path in (ROOT / "proxytune").iterdir())
    rooms = {name.removesuffix(".py") for name in listing if not name.startswith(("__", "py."))}
    named = re.findall(r"^\| `proxytune/(\w+)", README, flags=re.MULTILINE)
    assert rooms == set(named)
    assert [floor(room) for room in named] == sorted(floor(room) for room in named), "a room stands before one it needs"


def test_the_readme_is_short_and_leads_to_every_page_of_docs():
    assert len(README.splitlines()) <= LONGEST_README
    for path in DOCS:
        others = "".join(text for other, text in DOCS.items() if other != path)
        contributing = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")
        assert path.name in README + contributing + others, f"nothing leads to docs/{path.name}"


@pytest.mark.parametrize("status", [INTERRUPTED, TERMINATED, DONE, FAILED, BAD_INPUT])
def test_every_exit_status_is_documented(status):
    rows = [line for line in COMMANDS_PAGE.splitlines() if re.match(r"\| \d", line)]
    assert any(re.search(rf"\b{status}\b", row.split("|")[1]) for row in rows)


@pytest.mark.parametrize("command", [name for name in COMMANDS if name not in ("list", "completion")])
def test_what_every_command_leaves_when_it_is_stopped_is_documented(command):
    table = COMMANDS_PAGE.split("## When a command is stopped")[1].split("\n## ")[0]
    assert f"`{command}`" in table


@pytest.mark.parametrize("verdict", MEANINGS)
def test_every_verdict_of_diagnose_is_documented(verdict):
    assert re.search(rf"^\| {verdict} \|", (ROOT / "docs" / "diagnosis.md").read_text(encoding="utf-8"), re.MULTILINE)


@pytest.mark.parametrize("measure", ["PRPV", "PPV", "SRCC", "MMRV", "POD", "PLV"])
def test_every_measure_is_spelt_out(measure):
    rows = [line.split("|") for line in DOCS[ROOT / "docs" / "usefulness.md"].splitlines()]
    words = next(row[2].replace("-", " ").split() for row in rows if len(row) > 2 and row[1].strip() == measure)
    assert "".join(word[0] for word in words if word != "to").upper() in (measure, "SRCC")


def test_every_link_of_the_documents_leads_somewhere():
    below = (ROOT.glob(f"{folder}/**/*.md") for folder in ("docs", "studies", "robots", "benchmarks"))
    for document in [*ROOT.glob("*.md"), *(path for paths in below for path in paths)]:
        for target in re.findall(r"\]\(([^)#]+)\)", document.read_text(encoding="utf-8")):
            assert target.startswith("http") or (document.parent / target).exists(), f"{document}: {target}"


@pytest.mark.slow
@pytest.mark.parametrize("line", COMMAND_LINES)
def test_the_commands_of_the_documents_run(line, tmp_path):
    shutil.copytree(ROOT / "studies", tmp_path / "studies", ignore=shutil.ignore_patterns("study.db*", "figures"))
    words = shlex.split(line)
    here = {**os.environ, "PYTHONPATH": str(ROOT)}
    done = subprocess.run([sys.executable, *words[1:]], capture_output=True, text=True, cwd=tmp_path, env=here)
    assert done.returncode == 0, done.stderr
    assert done.stdout
