"""What several rooms' tests share: a study of a domain family that is a formula."""

import gc
import json
import os
import shutil
import signal
import sys
from collections.abc import Callable, Iterator
from importlib import import_module
from importlib.util import find_spec
from itertools import takewhile
from pathlib import Path
from typing import Any

import hypothesis
import pytest

HERE = Path(__file__).resolve().parent
# Stand-ins; and what the benchmarks have: cases with hidden effects, problems of a search.
sys.path += [str(HERE / "fakes"), str(HERE.parent / "benchmarks")]
blank = import_module("blank").blank
# Two processes whose linear algebra has two threads each wait for one another; NumPy is not imported yet.
os.environ.setdefault("OMP_NUM_THREADS", "1")
# A dumb terminal, as an editor's shell is, has no progress bars; tests of these mean one that has.
os.environ.pop("TERM", None)
# Rewriting asserts is half of collecting them, so it is kept for the next run; what tests start keeps its bytecode too.
sys.dont_write_bytecode = False
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
# A run in the background ignores Ctrl-C, or the end of its terminal; tests mean both to be heeded, as in a terminal.
signal.signal(signal.SIGINT, signal.default_int_handler)
signal.signal(signal.SIGHUP, signal.SIG_DFL)
# The same examples in every run, however long they take.
hypothesis.settings.register_profile("fixed", derandomize=True, deadline=None)
hypothesis.settings.load_profile("fixed")

FUZZ = 100
"""How many files of each kind are spoilt in tests/fuzzing, if nobody says otherwise."""


def pytest_addoption(parser: pytest.Parser) -> None:
    """Let a nightly run spoil more files."""
    parser.addoption("--fuzz", type=int, default=FUZZ, metavar="N", help=f"spoilt files of each kind [{FUZZ}]")


def pytest_collection_finish() -> None:
    """Spare the garbage collector what stays until the end: thousands of tests."""
    gc.freeze()


@pytest.fixture(autouse=True)
def _forget_folders() -> Iterator[None]:
    """Forget where a test's modules lay: a search for plug-ins looks at every folder that is still known."""
    path, last = list(sys.path), next(reversed(sys.modules))
    yield
    sys.path[:] = path
    # Modules stand in the order in which they were imported.
    for name in list(takewhile(lambda name: name != last, reversed(sys.modules))):
        if name.startswith("beside_"):
            del sys.modules[name]


@pytest.fixture(autouse=not find_spec("pybullet"))
def _skip_without_pybullet(monkeypatch: pytest.MonkeyPatch) -> None:
    """Skip what turns out to need PyBullet where it is not installed, with the reason that a user is told."""
    monkeypatch.setattr("proxytune.driving.bullet.InputError", pytest.skip)


@pytest.fixture(autouse=True, scope="module")
def _blank_figures(request: pytest.FixtureRequest) -> Iterator[None]:
    """Save figures blank, where they cost half the time, but for those of reports and where FIGURES_DRAWN says so."""
    if request.path.parent.name == "report" or getattr(request.module, "FIGURES_DRAWN", False):
        yield
        return
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("matplotlib.figure.Figure.savefig", blank)
        yield


@pytest.fixture(scope="module")
def few_effects() -> Iterator[None]:
    """Let a module's diagnoses look for few effects, where what becomes of their answers is tested."""
    with pytest.MonkeyPatch.context() as patch:
        import_module("planted").look_for_few(patch)
        yield


STUDY = {
    "format": "1",
    "name": '"wobbly"',
    "family": '"wobbly:wobbly"',
    "target": '"target.csv"',
    "metrics": '["distance:max", "survival_time:max"]',
    "agents": '["agent0", "agent1", "agent2", "agent3", "agent4", "agent5"]',
    "starts": "3",
    "budget": "7",
    "initial": "5",
    "engine": '"gp"',
    "seed": "1",
    "jobs": "1",
    "preflight": "false",
    "confirm": "0",
    "cut_off": "false",
}
PARAMETERS = {"trim": "[-0.3, 0.3]", "delay": "[0.0, 0.3]"}
TRUTH = {"trim": 0.1, "delay": 0.12}

Answered = Callable[..., Any]
Refused = Callable[..., str]
MakeStudy = Callable[..., Path]
"""Writes a study's folder; call it again to edit the study.toml."""


def study_text(parameters: dict[str, str], domain: dict[str, str], changes: dict[str, str | None]) -> str:
    """A study.toml; a change to None leaves the key out."""
    keys = {key: value for key, value in {**STUDY, **changes}.items() if value is not None}
    tables = {"": keys, "[parameters]": parameters, "[domain]": domain}
    lines = [line for head, table in tables.items() for line in (head, *(f"{k} = {v}" for k, v in table.items()))]
    return "\n".join(lines) + "\n"


def study_maker(parent: Path) -> MakeStudy:
    """What writes studies into this folder."""

    def make(
        called: str = "study",
        parameters: dict[str, str] = PARAMETERS,
        domain: dict[str, str] | None = None,
        **changes: str | None,
    ) -> Path:
        folder = parent / called
        folder.mkdir(exist_ok=True)
        (folder / "study.toml").write_text(study_text(parameters, domain or {}, changes))
        if not (folder / "target.csv").exists():
            write_target(folder / "target.csv")
        return folder

    return make


@pytest.fixture
def write_file(tmp_path: Path) -> Callable[..., Path]:
    """Write a text or bytes into a file of the test's folder."""

    def write(content: str | bytes, name: str) -> Path:
        path = tmp_path / name
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
        return path

    return write


@pytest.fixture
def make_study(tmp_path: Path) -> MakeStudy:
    """Write a study's folder; call it again to edit the study.toml."""
    return study_maker(tmp_path)


@pytest.fixture(scope="module")
def make_studies(tmp_path_factory: pytest.TempPathFactory) -> MakeStudy:
    """The same for studies that the tests of a module share."""
    return study_maker(tmp_path_factory.mktemp("studies"))


@pytest.fixture
def answered(capsys: pytest.CaptureFixture[str]) -> Answered:
    """Run a command in this process, which succeeds, and give the document that it prints."""
    from proxytune.cli.main import main

    def answer(*words: object) -> Any:
        capsys.readouterr()
        status = main([*map(str, words), "--json"])
        out, told = capsys.readouterr()
        assert status == 0, told
        return json.loads(out)

    return answer


@pytest.fixture
def refused(capsys: pytest.CaptureFixture[str]) -> Refused:
    """Run a command in this process, which ends with this status, and give its one line on standard error."""
    from processes import besides_progress

    from proxytune.cli.main import main

    def refuse(*words: object, status: int = 2) -> str:
        capsys.readouterr()
        assert main([*map(str, words)]) == status
        out, told = capsys.readouterr()
        told = besides_progress(told)
        assert (out, told.count("\n")) == ("", 1)
        return told

    return refuse


@pytest.fixture(scope="session")
def launcher() -> Iterator[object]:
    """The process that forks what is Launched."""
    from launched import launching

    with launching() as process:
        yield process


@pytest.fixture(scope="session")
def rolled_frames(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A log of 30 frames standing still, of a camera that is tilted by 4° to one side."""
    pictured = import_module("pictured")
    folder = tmp_path_factory.mktemp("rolled") / "log"
    return Path(pictured.write_still_frames(folder, pictured.ROLLED, pictured.lane_poses(30), columns=96))


@pytest.fixture(scope="session")
def finished_once(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A finished study, run once."""
    from searched import changed, searched

    folder = study_maker(tmp_path_factory.mktemp("finished"))()
    searched(changed(folder))
    return folder


@pytest.fixture(scope="session")
def result(finished_once: Path) -> object:
    """What came of the finished study."""
    from searched import changed, looked_at

    return looked_at(changed(finished_once))


@pytest.fixture
def finished(finished_once: Path, tmp_path: Path) -> Path:
    """A finished study of one's own, where `make_study` edits it."""
    return Path(shutil.copytree(finished_once, tmp_path / "study"))


def write_target(path: Path, theta: dict[str, float] = TRUTH, seed: int = 900, shift: float = 0.0) -> Path:
    """The scores of every agent at the truth, under other seeds than a study's, off by so much."""
    from wobbly import AGENTS, formula

    from proxytune.domain import make_episode

    lines = ["agent,episode,distance,survival_time"]
    for agent in AGENTS:
        for start in range(3):
            scores = formula(theta, make_episode(theta, agent=agent, start=start, seed=seed + start))
            lines.append(f"{agent},{start},{scores['distance'] + shift!r},{scores['survival_time'] + shift!r}")
    path.write_text("\n".join(lines) + "\n")
    return path
