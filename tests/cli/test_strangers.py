"""A stranger's folder: a study that names no code runs none, whatever lies beside it, and looking at one runs nothing.

Every module of these folders signs a list when it is run, and then lets whoever imports it go on without it.
"""

import json
import shutil
import subprocess
import sys
from collections.abc import Mapping
from types import MappingProxyType
from typing import NamedTuple

import pytest
from processes import ENVIRONMENT

from proxytune.cli.commands import COMMANDS
from proxytune.cli.main import main
from proxytune.files import shipped

SIGNED = "signed"
SIGN = f"""
import os, sys
with open({{home!r}} + "/{SIGNED}", "a") as signed:
    signed.write(__name__ + " ")
raise ImportError("not here")
"""
OPTIONAL = (
    "bottleneck", "cython", "imageio_ffmpeg", "numba", "numexpr", "optuna", "pyarrow", "sksparse", "torch", "viztracer",
)  # fmt: skip
"""What libraries try to import, and a venv may not have."""
STANDARD = ("ctypes", "json", "pickle", "random", "signal", "socket", "tempfile", "typing", "uuid")
USED = ("joblib", "lazy_loader", "matplotlib", "numpy", "pandas", "rich", "scipy", "sklearn", "skopt", "tomlkit")
STUDY = """
format = 1
target = "target.csv"
metrics = ["distance:max"]
agents = ["steady", "daredevil"]
starts = 1
budget = 2
initial = 2
engine = "{engine}"
objective = "{objective}"
preflight = false
confirm = 0
jobs = {jobs}
{more}
[parameters]
trim = [-0.3, 0.3]
[domain]
robot = "{robot}"
plant = "planar"
map = "small_loop"
seconds = 1
"""
PLAIN = {"engine": "gp", "objective": "prpv", "jobs": 2, "robot": "duckiebot", "more": ""}


class Stranger(NamedTuple):
    """A hostile folder: its files besides a study that names no code, and what its study.toml says instead."""

    files: dict[str, str]
    says: Mapping[str, object] = MappingProxyType({})
    status: int = 0
    here: bool = False
    """Whether the command is given in the folder itself."""


def modules(*names, suffix=".py"):
    return {f"{name}{suffix}": SIGN for name in names}


def installed(*points, module="evil_mod"):
    info = {"METADATA": "Metadata-Version: 2.1\nName: evil\nVersion: 1.0\n", "entry_points.txt": "\n".join(points)}
    return {**{f"evil-1.0.dist-info/{name}": text for name, text in info.items()}, **modules(module)}


def robot_of(effects):
    text = (shipped("robots") / "duckiebot" / "robot.toml").read_text(encoding="utf-8").replace('"duckiebot"', '"wolf"')
    kept = [line for line in text.splitlines() if not line.startswith("urdf")]
    return "\n".join(kept) + f"\n[effects{effects}\n"


PLUGINS = ("[proxytune]", "engine.evil = evil_mod:make", "measure.evil = evil_mod:make", "effect.evil = evil_mod:make",
           "agent.evil = evil_mod:make", "robot.evil = evil_mod:make", "family.evil = evil_mod:make")  # fmt: skip
BESIDE = modules("sitecustomize", "usercustomize", "__main__", "study", "agents", "proxytune/__init__",
                 "proxytune/driving")  # fmt: skip
"""What Python runs by itself, and what has our own names."""
SETTINGS = {
    "matplotlibrc": "backend: module://evil_mod\nanimation.ffmpeg_path: ./evil\n",
    ".numba_config.yaml": "cache_dir: cache\ncache_locator_classes: evil_mod.Locator\n",
    "conftest.py": SIGN,
    ".pth": "import evil_mod\n",
}
OTHERS = ("[numba_extensions]", "init = evil_mod:init", "[matplotlib.backend]", "agg = evil_mod", "[gymnasium.envs]",
          "__root__ = evil_mod:register")  # fmt: skip
HERE = {**modules(*OPTIONAL, *STANDARD, *USED), **installed(*PLUGINS, *OTHERS), **SETTINGS}
STRANGERS = {
    "beside it and beside its robot": Stranger(
        {**modules(*OPTIONAL, "wolf/optuna"), **BESIDE, "wolf/robot.toml": robot_of(".dead_band]\nwidth = 0.01")},
        {"robot": "wolf"},
    ),
    "beside it as folders, one process": Stranger(modules(*(f"{name}/__init__" for name in OPTIONAL)), {"jobs": 1}),
    "in the folder itself": Stranger(HERE, here=True),
    "in the folder itself, one process": Stranger(HERE, {"jobs": 1}, here=True),
    "a plug-in's engine": Stranger(installed(*PLUGINS), {"engine": "evil"}, status=2),
    "a plug-in's objective": Stranger(installed(*PLUGINS), {"objective": "evil"}, status=2, here=True),
    "a plug-in's robot": Stranger(installed(*PLUGINS), {"robot": "evil"}, status=2),
}


@pytest.fixture
def write(tmp_path):
    """Writes a stranger's folder."""

    def written(stranger, **says):
        folder = tmp_path / "stranger"
        files = {**stranger.files, "study.toml": STUDY.format(**{**PLAIN, **stranger.says, **says})}
        files["target.csv"] = "agent,episode,distance\nsteady,0,1.0\ndaredevil,0,2.0\n"
        for name, text in files.items():
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            (folder / name).write_text(text.replace("{home!r}", repr(str(folder))), encoding="utf-8")
        return folder

    return written


INSTALLED = "import sys; from proxytune.__main__ import run; sys.argv[0] = 'proxytune'; sys.exit(run())"
"""What the installed command `proxytune` does, whose sys.path begins with the folder of programs."""


def called(folder, here, *words, by_module=True):
    """Call a command in a process of its own; what it said of a refusal is one line."""
    start = ["-m", "proxytune"] if by_module else ["-P", "-c", INSTALLED]
    command = [sys.executable, *start, *words]
    done = subprocess.run(
        command, cwd=folder if here else folder.parent, capture_output=True, text=True, env=ENVIRONMENT, check=False
    )
    assert "Traceback" not in done.stderr, done.stderr
    return done


def signatures(folder):
    return (folder / SIGNED).read_text().split() if (folder / SIGNED).exists() else []


HOW = [*((name, True) for name in STRANGERS), ("in the folder itself", False), ("a plug-in's objective", False)]
"""Each by `python -m`, and of those in the current folder two by the installed command too."""


@pytest.mark.slow
@pytest.mark.parametrize(("name", "by_module"), HOW)
def test_a_study_that_names_no_code_runs_none_whatever_lies_beside_it(write, name, by_module):
    stranger = STRANGERS[name]
    folder = write(stranger)
    done = called(folder, stranger.here, "study", "." if stranger.here else str(folder), by_module=by_module)
    assert (done.returncode, signatures(folder)) == (stranger.status, []), done.stderr
    assert not (folder / "cache").exists()


def test_settings_of_matplotlib_in_the_current_folder_are_not_read(tmp_path):
    (tmp_path / "matplotlibrc").write_bytes(b"\xfftext.usetex: True\n")
    code = "import proxytune.__main__ as m; m.load_matplotlib(); import os, matplotlib as n; "
    done = subprocess.run(
        [sys.executable, "-c", code + "print(n.rcParams['text.usetex'], os.getcwd())"],
        cwd=tmp_path, capture_output=True, text=True, env=ENVIRONMENT, check=False,
    )  # fmt: skip
    assert done.stdout == f"False {tmp_path}\n", done.stderr


def test_an_optional_package_is_found_where_a_study_names_code_as_the_last_place(write, refused):
    """The modules do sign: this shows that the test above can fail."""
    folder = write(Stranger({**modules("numexpr_not_installed", "json"), "mine.py": "import numexpr_not_installed\n"}))
    (folder / "study.toml").write_text(STUDY.format(**{**PLAIN, "more": ""}).replace('"steady"', '"mine:Agent"'))
    assert "importing mine raised ImportError: not here" in refused("study", folder)
    assert [name.split(".")[-1] for name in signatures(folder)] == ["numexpr_not_installed"]
    assert sys.path[-1] == str(folder)
    sys.path.remove(str(folder))


NAMING = {
    "family": {"more": 'family = "evil_mod:make"'},
    "agents": {"more": ""},
    "engine": {"engine": "evil_mod:make"},
    "objective": {"objective": "evil_mod:make"},
    "robot": {"robot": "wolf"},
    "box": {"more": ""},
}
"""Where a study names code."""


@pytest.fixture
def naming(write, finished_without_code):
    """Writes a study that names code and has been run, as its study.db says."""

    def written(where):
        effects = '."evil_mod:Effect"]\nsize = 1.0'
        folder = write(Stranger({"wolf/robot.toml": robot_of(effects), **modules("evil_mod")}), **NAMING[where])
        text = (folder / "study.toml").read_text()
        replaced = {"agents": ('"steady"', '"evil_mod:Agent"'), "box": ("trim = ", '"evil_mod:Effect" = ')}
        (folder / "study.toml").write_text(text.replace(*replaced.get(where, ("", ""))))
        shutil.copy(finished_without_code / "study.db", folder)
        (folder / "model.toml").write_text(f'format = 1\nrobot = "duckiebot"\n[effects{effects}\n')
        return folder

    return written


@pytest.fixture(scope="module")
def finished_without_code(tmp_path_factory):
    folder = tmp_path_factory.mktemp("plain")
    (folder / "study.toml").write_text(STUDY.format(**{**PLAIN, "jobs": 1}))
    (folder / "target.csv").write_text("agent,episode,distance\nsteady,0,1.0\ndaredevil,0,2.0\n")
    assert main(["study", str(folder)]) == 0
    (folder / "log").mkdir()
    return folder


LOOKING = {
    "plot": ["plot", "{folder}"],
    "plot, other metrics": ["plot", "{folder}", "--metric", "survival_time:max"],
    "repair": ["repair", "{folder}"],
    "export": ["export", "{folder}", "--to", "ros", "--output", "{folder}/out.yaml"],
    "export of trials": ["export", "{folder}", "--to", "skopt", "--output", "{folder}/out.pkl"],
    "export of a model": ["export", "{folder}/model.toml", "--to", "ros", "--output", "{folder}/out.yaml"],
    "predict": ["predict", "{folder}/model.toml", "{folder}/log", "--output", "{folder}/out.csv"],
    "diagnose": ["diagnose", "{folder}/log", "--robot", "wolf", "--output", "{folder}/found"],
    "list": ["list", "robots"],
    "list effects": ["list", "effects"],
    "import": ["import", "{folder}/target.csv"],
    "score": ["score", "--proxy", "{folder}/target.csv", "--target", "{folder}/target.csv", "--metric", "distance:max"],
}


def write_log(folder):
    (folder / "log").mkdir()
    (folder / "log" / "log.toml").write_text(
        'format = 1\nname = "log"\nrobot = "wolf"\ncommand = "duty"\nrate_hz = 20\n'
    )
    rows = (f"0,{tick / 20},{0.4},{0.4},{tick / 100},0.0,0.0" for tick in range(200))
    (folder / "log" / "samples.csv").write_text("episode,time,left,right,x,y,heading\n" + "\n".join(rows) + "\n")


@pytest.mark.parametrize(
    ("command", "where"),
    [(one, where) for one, words in LOOKING.items() for where in NAMING if where == "robot" or words[1] == "{folder}"],
)
def test_a_command_that_only_looks_runs_nothing_of_a_folder(naming, command, where, monkeypatch, capsys):
    folder = naming(where)
    write_log(folder)
    monkeypatch.chdir(folder)
    before = list(sys.path)
    status = main([word.format(folder=folder) for word in LOOKING[command]])
    said = capsys.readouterr().err
    assert signatures(folder) == []
    assert sys.path == before
    assert status in (0, 1, 2)
    assert "Traceback" not in said


def test_commands_that_run_code_are_those_that_the_page_names():
    runs = [name for name, command in COMMANDS.items() if command.runs_code]
    assert runs == ["study", "sweep", "teach", "fleet", "drive", "measure", "record", "loop", "new"]


OWN = """
from proxytune.effects import Stage, CHANNELS
from proxytune.effects.motors import Trim as Mine
"""


def test_the_effect_that_a_model_names_runs_once_the_user_has_typed_it(tmp_path, monkeypatch, refused, answered):
    words = ("export", "model.toml", "--to", "ros", "--output", "out.yaml")
    monkeypatch.chdir(tmp_path)
    (tmp_path / "mine.py").write_text(OWN)
    (tmp_path / "model.toml").write_text('format = 1\nrobot = "duckiebot"\n[effects."mine:Mine"]\ntrim = 0.1\n')
    told = refused(*words)
    assert "module 'mine' is code, and export runs none that a file names; install it as a plug-in, or name it" in told
    answered(*words, "--effects", "mine:Mine")
    sys.path.remove(str(tmp_path))


@pytest.mark.slow
def test_a_study_with_an_effect_of_its_own_is_drawn_without_it(tmp_path, answered):
    folder = tmp_path / "study"
    folder.mkdir()
    (folder / "mine.py").write_text(OWN)
    (folder / "study.toml").write_text(STUDY.format(**{**PLAIN, "jobs": 1}).replace("trim = ", '"mine:Mine" = '))
    (folder / "target.csv").write_text("agent,episode,distance\nsteady,0,1.0\ndaredevil,0,2.0\n")
    found = answered("study", folder)
    (folder / "mine.py").write_text(SIGN.replace("{home!r}", repr(str(folder))))
    done = subprocess.run(
        [sys.executable, "-m", "proxytune", "plot", str(folder), "--json"], capture_output=True, text=True,
        env=ENVIRONMENT, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout)["best"] == found["best"]
    assert signatures(folder) == []
    sys.path.remove(str(folder))


def test_a_robot_that_cannot_be_read_hides_no_other(naming, monkeypatch, answered):
    monkeypatch.chdir(naming("robot"))
    rows = {row["name"]: row["description"] for row in answered("list", "robots")["robots"]}
    assert rows["wolf"].startswith("cannot be read: ")
    assert "module 'evil_mod' is code, and list runs none that a file names" in rows["wolf"]
    assert "duckiebot" in rows
