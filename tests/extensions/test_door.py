"""One door for a user's own code: found, kept apart by folder, usable in other processes, refused in one line."""

import importlib.util
import os
import pickle
import py_compile
import re
import subprocess
import sys
from functools import partial
from pathlib import Path

import pytest
from one_line import complaint_of
from processes import ENVIRONMENT

from proxytune.cli.terminal import signals_as_interruptions
from proxytune.driving import AGENTS, load_agent
from proxytune.errors import ExtensionError
from proxytune.extensions import folders, import_beside, load, pack, plugins
from proxytune.running import working

SHIPPED = {"steady": 1, "bold": 2}


@pytest.fixture
def write(tmp_path):
    """Writes modules, given as NAME=TEXT, into a folder of tmp_path and gives the folder."""

    def written(folder, **modules):
        home = tmp_path / folder
        home.mkdir(exist_ok=True)
        for name, text in modules.items():
            (home / f"{name}.py").write_text(text, encoding="utf-8")
        return home

    return written


@pytest.fixture
def install(tmp_path, monkeypatch):
    """Installs a package that is nothing but its entry points, as pip would leave it."""

    def installed(package, *lines):
        site = tmp_path / package
        info = site / f"{package}-1.0.dist-info"
        info.mkdir(parents=True)
        (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {package}\nVersion: 1.0\n")
        (info / "entry_points.txt").write_text("[proxytune]\n" + "\n".join(lines) + "\n")
        monkeypatch.syspath_prepend(str(site))
        return site

    return installed


def test_an_attribute_is_found_in_the_folder_before_the_installed_modules(write):
    assert load("json:here", kind="agent", beside=write("study", json="here = 7\n")) == 7
    assert load("json:loads", kind="agent")("3") == 3
    assert "here" not in vars(sys.modules["json"])


def test_what_runs_is_what_the_file_says_as_old_and_large_as_it_is_whatever_bytecode_claims(write, monkeypatch):
    monkeypatch.setattr(sys, "dont_write_bytecode", False)
    for size in (1, 2):
        folder = write("study", family=f"size = {size}\n")
        os.utime(folder / "family.py", (1.0, 1.0))
        assert load("family:size", kind="family", beside=folder) == size
        assert [path.name for path in folder.iterdir()] == ["family.py"]
        for name in [name for name in sys.modules if name.startswith("beside_study") and name.endswith(".family")]:
            del sys.modules[name]
    folder = write("study", family="size = 2\n", other="size = 1\n")
    cached = Path(importlib.util.cache_from_source(str(folder / "family.py")))
    unchecked = py_compile.PycInvalidationMode.UNCHECKED_HASH
    py_compile.compile(str(folder / "other.py"), str(cached), invalidation_mode=unchecked)
    assert load("family:size", kind="family", beside=folder) == 2


def test_modules_of_a_folder_import_one_another_and_those_of_one_name_in_two_are_not_mixed_up(write):
    family = "import helper\nfrom helper import size\ndef late():\n    import helper as again\n    return again.size\n"
    one, two = (write(name, helper=f"size = {n}\n", family=family) for n, name in ((1, "one"), (2, "two")))
    for folder, size in ((one, 1), (two, 2), (one, 1)):
        module = {"beside": folder, "kind": "family"}
        assert load("family:size", **module) == size
        assert load("family:helper", **module).size == size
        assert load("family:late", **module)() == size
    folder = write("study", top="import tools.sharp\nfrom tools import sharp\nsame = tools.sharp is sharp\n")
    sharp = "from . import blunt\nimport tools.blunt as b\nedge = b.edge\n"
    assert write("study/tools", __init__="", sharp=sharp, blunt="edge = 3\n").is_dir()
    assert load("top:same", kind="agent", beside=folder) is True
    assert load("tools.sharp:edge", kind="agent", beside=folder) == 3


WORK = """
from dataclasses import dataclass
from helper import FACTOR

@dataclass(frozen=True)
class Work:
    def __call__(self, piece):
        import helper
        return piece * helper.FACTOR
"""


def test_other_processes_unpickle_what_is_of_a_folder_with_its_own_neighbours(write):
    for name, factor in (("left", 10), ("right", 100)):
        work = load("works:Work", kind="work", beside=write(name, works=WORK, helper=f"FACTOR = {factor}\n"))()
        assert pickle.loads(pickle.dumps(work)) == work
        with working(work, [1, 2, 3], jobs=2) as results:
            assert sorted(results) == [factor, 2 * factor, 3 * factor]


MISTAKES = {
    "no module": ("gone:x", r"agent 'gone:x': no module 'gone' in .*study or installed; check the name"),
    "no attribute": ("mine:Mime", "agent 'mine:Mime': mine has no 'Mime'; did you mean 'Mine'?"),
    "an import that raises": ("bad:x", "agent 'bad:x': importing bad raised ZeroDivisionError: division by zero"),
    "an import that leaves": ("leaves:x", r"importing leaves raised SystemExit: 3 \(leaves.py, line 2\); correct it"),
    "a missing neighbour": ("needy:x", "importing needy raised ModuleNotFoundError: No module named 'not_there'"),
    "bad syntax": ("odd:x", "agent 'odd:x': importing odd raised SyntaxError"),
    "no members": ("mine:Mine", "agent 'mine:Mine' lacks act, end; add what every agent must have"),
    "no colon": ("stead", "agent 'stead' is unknown .*module:attribute.*; did you mean 'steady'?"),
    "nothing after the colon": ("mine:", "agent 'mine:': must be written module:attribute"),
    "nothing before it": (":Mine", "agent ':Mine': must be written module:attribute"),
}


@pytest.mark.parametrize(("name", "expected"), MISTAKES.values(), ids=MISTAKES)
def test_what_cannot_be_used_is_told_in_one_line(write, name, expected):
    folder = write(
        "study",
        mine="class Mine:\n    def begin(self): ...\n",
        bad="1 / 0\n",
        leaves="import sys\nsys.exit(3)\n",
        needy="import not_there\n",
        odd="def (\n",
    )
    asked = partial(load, kind="agent", beside=folder, needs=("begin", "act", "end"), shipped=dict.fromkeys(SHIPPED))
    assert re.search(expected, complaint_of(asked, name))


@pytest.mark.parametrize("name", ["pressed:x", "mine:factory"])
def test_a_keyboard_interrupt_of_a_users_code_is_told_on_the_command_line_and_else_the_users_own(write, name):
    folder = write("study", pressed="raise KeyboardInterrupt\n", mine="def factory(): raise KeyboardInterrupt\n")
    with pytest.raises(KeyboardInterrupt):
        load(name, kind="agent", beside=folder, needs=("act",), call=True)
    told = r"raised KeyboardInterrupt \((pressed|mine).py, line 1\); correct it"
    with signals_as_interruptions(), pytest.raises(ExtensionError, match=told):
        load(name, kind="agent", beside=folder, needs=("act",), call=True)


def test_a_class_or_factory_is_called_and_what_has_the_members_is_taken_as_it_is(write):
    mine = "class Mine:\n    size = 1\n    def __call__(self): return 5\n\n\nready = Mine()\n\n\n"
    folder = write("study", mine=mine + "def factory(): return Mine()\n\n\ndef broken(): return 1 / 0\n")
    for name in ("mine:Mine", "mine:ready", "mine:factory"):
        assert load(name, kind="agent", beside=folder, needs=("size",), call=True).size == 1
    told = r"'mine:broken' raised ZeroDivisionError: division by zero \(mine.py, line 12\); correct"
    with pytest.raises(ExtensionError, match=told):
        load("mine:broken", kind="agent", beside=folder, needs=("size",), call=True)


def test_a_plugin_is_loaded_by_its_name_and_listed(install, write, tmp_path):
    install("fast_agents", "agent.quick = fast_agents_code:Quick", "effect.other = fast_agents_code:Other")
    quick = "class Quick:\n    def begin(self, robot): return 4\n    def act(self, p, m): ...\n"
    write("fast_agents", fast_agents_code=quick)
    assert list(plugins("agent", AGENTS)) == ["quick"]
    assert load_agent("quick", tmp_path).begin(None) == 4
    with pytest.raises(ExtensionError, match="agent 'quik' is unknown .*; did you mean 'quick'"):
        load_agent("quik", tmp_path)
    with pytest.raises(ExtensionError, match="effect 'other': its plug-in fast_agents_code:Other raised Attribut"):
        load("other", kind="effect")


CLASHES = {
    "quick": "'agent.quick' is in both fast_agents and slow_agents; uninstall one",
    "steady": "'agent.steady' of fast_agents has the name of a shipped agent; rename",
    "agents.quick": "'agents.quick' of fast_agents must be called KIND.NAME; did you mean 'agent'?",
    "very.quick": "'agent.very.quick' of fast_agents must be called agent.NAME, one word",
}


@pytest.mark.parametrize("name", CLASHES)
def test_a_plugin_is_refused_whose_name_another_or_something_shipped_has_or_that_is_no_one_word(install, name):
    install("fast_agents", f"{'' if name.startswith('agents') else 'agent.'}{name} = a:b")
    if name == "quick":
        install("slow_agents", "agent.quick = c:d")
    assert CLASHES[name] in complaint_of(partial(load, kind="agent", shipped=SHIPPED), name)


ELSEWHERE = """
import pickle, sys
from proxytune.extensions import unpack
packed, work = pickle.loads(sys.stdin.buffer.read())
unpack(packed)
unpack(packed)
print(pickle.loads(work)(3))
"""


def test_modules_and_what_they_import_are_found_where_their_folder_is_not_by_the_same_bytes(tmp_path):
    home = tmp_path / "travels"
    (home / "deep").mkdir(parents=True)
    (home / "mine.py").write_text("from helper import TWO\n\n\ndef work(x):\n    return x * TWO\n")
    (home / "helper.py").write_text("from deep.one import ONE\n\nTWO = 2 * ONE\n")
    (home / "deep" / "__init__.py").write_text("")
    (home / "deep" / "one.py").write_text("ONE = 1\n")
    (home / "weights.bin").write_bytes(b"stays")
    work = pickle.dumps(import_beside("mine", home).work)
    packed = pack([folder for folder in folders() if folder == str(home.resolve())])
    home.rename(tmp_path / "gone")
    sent = pickle.dumps((packed, work))
    done = subprocess.run([sys.executable, "-c", ELSEWHERE], input=sent, capture_output=True, env=ENVIRONMENT)
    assert done.stdout.decode().strip() == "6", done.stderr.decode()
    assert b"stays" not in sent
    (tmp_path / "mine.py").write_text("ONE = 1\n")
    once = pack([str(tmp_path)])
    (tmp_path / "mine.py").touch()
    assert pack([str(tmp_path)]) == once
