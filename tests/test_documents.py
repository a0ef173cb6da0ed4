"""What a user can type is documented, and what is documented is there."""

import argparse
import importlib
import os
import re
import shlex
import shutil
import subprocess
import sys
from operator import attrgetter
from pathlib import Path

import pytest
from compare import STAND_INS, parser as compare_parser
from floors import floor
from project import copy_studies

import proxytune
from proxytune.cli.main import BAD_INPUT, COMMANDS, DONE, FAILED, parser
from proxytune.driving import AGENTS, METRICS, UNITS, map_names
from proxytune.effects import CAR_CATALOGUE, CATALOGUE, GROUPS, Cue, WheelCurve
from proxytune.effects.effect import MOTIONS, SIGNALS
from proxytune.files import package_table, shipped
from proxytune.learning.settings import KEYS as TEACHING_KEYS
from proxytune.report.diagnosis.notes import VERDICTS
from proxytune.report.html import WORDS
from proxytune.search import ENGINES
from proxytune.settings import read_settings
from proxytune.starting import STOPPING
from proxytune.study.preflight import LOOKS, PAIRS
from proxytune.study.settings import KEYS
from proxytune.usefulness import MEASURES, PODS

ROOT = Path(__file__).resolve().parent.parent
DOCS = {path.relative_to(ROOT / "docs").as_posix(): path.read_text("utf-8") for path in (ROOT / "docs").rglob("*.md")}
DOCUMENTS = {
    path.relative_to(ROOT).as_posix(): path.read_text("utf-8")
    for path in (
        *sorted(ROOT.glob("*.md")),
        *(path for part in ("docs", "studies", "robots", "benchmarks") for path in sorted((ROOT / part).rglob("*.md"))),
    )
}
README, ROBOTS, BENCHMARKS = (DOCUMENTS[f"{folder}README.md"] for folder in ("", "robots/", "benchmarks/"))
COMMANDS_PAGE, STUDY, LOGS = (DOCS[f"reference/{name}.md"] for name in ("commands", "study", "logs"))

ABOUT, CAPTIONS = (package_table(f"report/templates/{name}.toml") for name in ("about", "captions"))

LONGEST_README = 100
"""Lines: the README is read in one go; the rest is in docs/."""
LONGEST_ROW = 320
"""Characters of a table's row without the targets of its links: more cannot be read on GitHub."""
RUN_ELSEWHERE = (
    *("cluster", "extending", "logs", "own_robot"),
    *("tune_a_simulator", "find_what_it_lacks", "judge_two_score_tables"),
)
"""Pages whose commands need what comes before them; tests/test_pages.py and tests/test_extending.py run them."""
SHARED = ("--json", "--format")
COMMAND_LINES = sorted(
    {
        line.removeprefix("$ ")
        for name, text in {"README": README, **DOCS}.items()
        if Path(name).stem not in RUN_ELSEWHERE
        for block in re.findall(r"```(?:sh|console)\n(.*?)```", text, flags=re.DOTALL)
        for line in block.splitlines()
        if line.removeprefix("$ ").startswith("python -m proxytune")
    }
)
DOTTED = re.compile(r"`(proxytune(?:\.\w+)+)`")


def section(text, title):
    """The part of a page under a heading, up to the next one of its level."""
    found = re.search(rf"^(#+) {re.escape(title)}\n(.*?)(?=^\1 |\Z)", text, flags=re.MULTILINE | re.DOTALL)
    assert found, f"no section '{title}'"
    return found.group(2)


def row_of(page, start):
    """The table's row of a page under docs/ that begins with this cell."""
    row = next((line for line in DOCS[page].splitlines() if line.startswith(f"| {start} ")), "")
    assert row, f"docs/{page} has no row for {start}"
    return row


def options():
    subcommands = next(a for a in parser()._actions if isinstance(a, argparse._SubParsersAction))
    for name, command in subcommands.choices.items():
        for action in command._actions:
            yield from ((name, flag) for flag in action.option_strings if flag.startswith("--") and flag != "--help")


def anchors(text):
    """The anchors of a page's headings, as GitHub and the site make them."""
    prose = re.sub(r"^```.*?^```", "", text, flags=re.MULTILINE | re.DOTALL)
    for title in re.findall(r"^#+ (.*)$", prose, flags=re.MULTILINE):
        title = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", title)
        yield re.sub(r"[^\w\- ]", "", title.lower()).strip().replace(" ", "-")


def resolved(name):
    """What a dotted name stands for: the longest part that is a module, then attributes and fields."""
    parts = name.split(".")
    for length in range(len(parts), 0, -1):
        try:
            thing = importlib.import_module(".".join(parts[:length]))
        except ModuleNotFoundError:
            continue
        for part in parts[length:]:
            thing = getattr(thing, part, None) or thing.__annotations__[part]
        return thing
    raise LookupError(name)


@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_is_documented(command):
    assert f"python -m proxytune {command}" in section(COMMANDS_PAGE, command)
    assert f"| [`{command}`](#{command}) |" in COMMANDS_PAGE


@pytest.mark.parametrize("command", COMMANDS)
def test_every_option_is_documented(command):
    for option in {option for name, option in options() if name == command}:
        about = section(COMMANDS_PAGE, "What all commands share" if option in SHARED else command)
        of_a_source = "what `import` reads, with its options" in about.replace("\n", " ") and f"`{option}" in LOGS
        assert re.search(rf"`{option}[ `]", about) or of_a_source, option


STUDY_KEYS = (*KEYS, "robot", "plant", "camera", "map", "seconds", "position_noise_m", "effects")
STATUSES = [row.split("|")[1] for row in COMMANDS_PAGE.splitlines() if re.match(r"\| \d", row)]
DOCUMENTED = {
    "problem of the comparison": (STAND_INS, lambda one: f"compare.py {one} " in DOCUMENTS["benchmarks/compare.md"]),
    "option of the comparison": (
        [flag for action in compare_parser()._actions for flag in action.option_strings if len(flag) > 2],
        lambda flag: f"`{flag}" in BENCHMARKS or flag == "--help",
    ),
    "key of a study": (STUDY_KEYS, lambda key: re.search(rf"^\| `\[?{key}\]?` |^## \[{key}\]$", STUDY, re.MULTILINE)),
    "key of teaching": (TEACHING_KEYS, lambda key: f"\n| `{key}` " in section(STUDY, "[teaching]")),
    "group that can be learnt, with its channels": (
        GROUPS,
        lambda group: all(f"`{one}`" in row_of("reference/model.md", f"`{group}`") for one in GROUPS[group].channels),
    ),
    "metric": (METRICS, lambda metric: row_of("reference/measures.md", f"`{metric}` [{METRICS[metric]}]")),
    "figure of a robot": (UNITS, lambda figure: f"`{figure}`" in ROBOTS),
    "exit status": (
        [DONE, FAILED, BAD_INPUT, *(128 + number for number in STOPPING)],
        lambda status: any(re.search(rf"\b{status}\b", cell) for cell in STATUSES),
    ),
    "command, with what it leaves when it is stopped": (
        [name for name in COMMANDS if name not in ("list", "completion")],
        lambda name: f"`{name}`" in section(DOCS["how-to/trouble.md"], "When a command is stopped"),
    ),
    "verdict of diagnose": (VERDICTS, lambda verdict: row_of("explanation/diagnosis.md", verdict)),
}
"""What there is of each kind, and whether one is documented."""


@pytest.mark.parametrize(("there", "is_documented"), DOCUMENTED.values(), ids=DOCUMENTED)
def test_every_one_of_a_kind_is_documented(there, is_documented):
    assert [one for one in there if not is_documented(one)] == []


@pytest.mark.parametrize("engine", ENGINES, ids=lambda engine: engine.name)
def test_every_engine_is_documented_with_what_it_learns_from_and_what_installs_it(engine):
    cells = [cell.strip() for cell in row_of("reference/engines.md", f"`{engine.name}`").strip("|").split("|")]
    assert cells[1] == engine.learns_from
    assert engine.needs is None or f'pip install ".[{engine.needs.extra}]"' in cells[-1]


def test_every_engine_and_agent_is_listed_with_how_it_proposes_or_drives(answered):
    listed = {row["name"]: row for row in answered("list", "engines")["engines"]}
    assert list(listed) == [engine.name for engine in ENGINES]
    for engine in ENGINES:
        row = listed[engine.name]
        assert (row["label"], row["what_it_proposes"]) == (engine.label, engine.summary)
        assert row["label"]
        assert row["what_it_proposes"]
    listed = {row["name"]: row["how_it_drives"] for row in answered("list", "agents")["agents"]}
    assert set(listed) == set(AGENTS)
    assert all("speed=" in how for how in listed.values())


@pytest.mark.parametrize("measure", [*MEASURES, *PODS], ids=lambda measure: measure.key)
def test_every_measure_is_documented_with_its_name_spelt_out_and_its_direction(measure):
    row = row_of("reference/measures.md", measure.name)
    assert f"| `{measure.key}` | {measure.title} | {measure.better} |" in row
    assert ("per metric" in row) == measure.per_metric


def test_every_benchmark_that_a_page_names_is_there_and_each_has_a_row_in_their_readme():
    rows = [line for line in BENCHMARKS.splitlines() if line.startswith("|")]
    named = {name for text in DOCUMENTS.values() for name in re.findall(r"[ `]benchmarks/(\w+\.py)", text)}
    ends = ('if __name__ == "__main__":', "-m pytest benchmarks/")
    scripts = (ROOT / "benchmarks").glob("*.py")
    runs = {path.name for path in scripts if any(one in path.read_text(encoding="utf-8") for one in ends)}
    assert named == runs
    assert runs <= {name for row in rows for name in re.findall(r" benchmarks/(\w+\.py)", row)}


@pytest.mark.parametrize("name", CATALOGUE)
def test_every_effect_and_its_parameters_are_documented(name):
    effect = CATALOGUE[name]
    row = next((line for line in DOCS["reference/effects.md"].splitlines() if line.startswith(f"| `{name}`")), "")
    assert row, f"docs/reference/effects.md has no row for the effect '{name}'"
    assert effect.stage.value in row
    assert all(f"`{parameter.name}`" in row for parameter in effect.parameters)


@pytest.mark.parametrize("name", [name for name, kind in CAR_CATALOGUE.items() if CATALOGUE.get(name) is not kind])
def test_every_effect_of_a_car_and_its_parameters_are_documented(name):
    row = next(line for line in section(DOCS["reference/effects.md"], "Of a car").splitlines() if f"| `{name}`" in line)
    assert CAR_CATALOGUE[name].stage.value in row
    assert all(f"`{parameter.name}`" in row for parameter in CAR_CATALOGUE[name].parameters)


@pytest.mark.parametrize("name", map_names())
def test_every_map_and_its_keys_are_documented(name):
    maps = section(ROBOTS, "Maps")
    assert re.search(rf"^\| `{name}` ", maps, flags=re.MULTILINE)
    settings = read_settings(shipped("robots") / "maps" / f"{name}.toml").values
    for key in {*settings, *settings["road"], *settings["paint"]} - {"road", "paint"}:
        assert f"`{key}`" in maps, key


@pytest.mark.parametrize("measure", ["PRPV", "PPV", "SRCC", "MMRV", "POD", "PLV"])
def test_every_measure_is_spelt_out_and_has_its_formula(measure):
    words = row_of("explanation/usefulness.md", measure).split("|")[2].replace("-", " ").split()
    assert "".join(word[0] for word in words if word != "to").upper() in (measure, "SRCC")
    assert re.search(rf"^##+ .*\b{measure}\b", DOCS["method.md"], flags=re.MULTILINE)


def test_a_page_s_foot_says_of_measures_and_of_the_answer_what_is_computed():
    assert "Pearson" in WORDS["SRCC"]
    assert "its mean over agents" in WORDS["MMRV"]
    for text in (ABOUT["study"], DOCS["explanation/search.md"]):
        said = " ".join(text.split())
        assert "more than a standard deviation of a fresh score above the lowest: then it is the most probable" in said


def test_how_many_pairs_a_pre_flight_drives_and_when_two_agents_have_no_order_is_told():
    told = " ".join(section(DOCS["explanation/search.md"], "Pre-flight").split())
    assert f"there are {PAIRS // LOOKS} pairs of episodes" in told
    assert f"about {PAIRS} pairs at most" in told
    assert "no order where they tie or, with several metrics" in CAPTIONS["score"]["flipped_pairs"]["caption"]


def test_every_room_is_on_the_page_about_architecture_in_order_and_every_name_on_that_of_the_api():
    listing = (path.name for path in (ROOT / "proxytune").iterdir())
    rooms = {name.partition(".")[0] for name in listing if not name.startswith(("__", "py."))}
    named = re.findall(r"^\| `proxytune\.(\w+)", section(DOCS["architecture.md"], "The rooms"), flags=re.MULTILINE)
    assert rooms == set(named)
    assert [floor(room) for room in named] == sorted(floor(room) for room in named), "a room stands before one it needs"
    named = re.findall(r"^::: proxytune\.(\w+)", DOCS["reference/api.md"], flags=re.MULTILINE)
    assert sorted([*named, "__version__"]) == sorted(proxytune.__all__)


def test_every_step_of_the_architecture_s_stories_names_what_its_module_defines():
    steps = re.findall(r"^\d+\. `(proxytune[\w.]*)`:((?:.|\n {3})*)", DOCS["architecture.md"], flags=re.MULTILINE)
    assert len(steps) > 25
    for module, told in steps:
        for name in re.findall(r"`(?!proxytune\.)(\w+(?:\.\w+)*)`", told):
            value = attrgetter(name)(importlib.import_module(module))
            assert value.__module__ == module, f"{module}: {name} is of {value.__module__}"


def test_the_readme_is_short_takes_two_commands_and_docs_readme_leads_to_every_page_of_docs():
    assert len(README.splitlines()) <= LONGEST_README
    assert "(docs/README.md)" in README
    for path in set(DOCS) - {"README.md"}:
        assert f"({path})" in DOCS["README.md"], f"docs/README.md does not lead to docs/{path}"
    (block,) = re.findall(r"```sh\n(.*?)```", README, flags=re.DOTALL)
    lines = block.replace("\\\n", "").splitlines()
    assert len(lines) == 2
    assert lines[0].endswith("python -m proxytune study studies/quickstart")
    assert lines[1].endswith("python -m pytest")


@pytest.mark.parametrize("document", DOCUMENTS)
def test_every_link_leads_to_a_file_and_a_heading_that_are_there(document):
    home = (ROOT / document).parent
    prose = re.sub(r"^```.*?^```", "", DOCUMENTS[document], flags=re.MULTILINE | re.DOTALL)
    for target in re.findall(r"\]\(([^)\s]+)\)", prose):
        if target.startswith("http"):
            continue
        path, _, anchor = target.partition("#")
        there = (home / path).resolve() if path else ROOT / document
        assert there.exists(), f"{document}: {target}"
        if anchor:
            assert anchor in anchors(there.read_text("utf-8")), f"{document}: {target}: no such heading"


@pytest.mark.parametrize("document", [name for name in DOCUMENTS if not name.startswith(("studies", "benchmarks"))])
def test_no_row_of_a_table_is_too_long_to_read(document):
    for line in DOCUMENTS[document].splitlines():
        if line.startswith("|"):
            shown = re.sub(r"\]\([^)]*\)", "]", line)
            assert len(shown) <= LONGEST_ROW, f"{document}: {len(shown)} characters: {line[:80]}"


@pytest.mark.parametrize("document", [name for name in DOCUMENTS if name != "CHANGELOG.md"])
def test_every_module_and_file_of_the_package_that_is_named_is_there(document):
    for name in DOTTED.findall(DOCUMENTS[document]):
        assert resolved(name) is not None, f"{document}: {name}"
    for path in re.compile(r"`(proxytune/[\w/]+(?:\.py)?)`").findall(DOCUMENTS[document]):
        assert (ROOT / path).exists() or (ROOT / f"{path}.py").exists(), f"{document}: {path}"


@pytest.mark.parametrize("title", re.findall(r"^## (.*)$", DOCS["method.md"], flags=re.MULTILINE))
def test_every_formula_of_the_method_stands_beside_the_module_that_computes_it(title):
    for part in re.split(r"^### ", section(DOCS["method.md"], title), flags=re.MULTILINE):
        assert "```math" not in part or DOTTED.search(part), f"{title}: {part[:60]}"


@pytest.mark.slow
@pytest.mark.parametrize("line", COMMAND_LINES)
def test_the_commands_of_the_documents_run(line, tmp_path):
    copy_studies(tmp_path)
    for robot in ("robot1.csv", "robot2.csv"):  # The page measures them first
        shutil.copy(ROOT / "studies" / "known_answer" / "target.csv", tmp_path / robot)
    here = {**os.environ, "PYTHONPATH": str(ROOT)}
    command = [sys.executable, *shlex.split(line)[1:]]
    done = subprocess.run(command, capture_output=True, text=True, cwd=tmp_path, env=here)
    assert done.returncode == 0, done.stderr
    assert done.stdout


def test_every_cue_curve_signal_and_motion_of_an_effect_s_trace_is_on_the_page():
    cues, shown, signals, motions = (
        row_of("how-to/extending.md", f"`{one}`") for one in ("cues", "shown", "Panel.signal", "Panel.motion")
    )
    assert set(Cue.__members__) == set(re.findall(r"([A-Z_]+)`", cues))
    assert set(WheelCurve.__members__) == set(re.findall(r"([A-Z]+)`", shown))
    assert set(SIGNALS) == set(re.findall(r'`"(.*?)"`', signals))
    assert set(MOTIONS) == set(re.findall(r'`"(.*?)"`', motions))
