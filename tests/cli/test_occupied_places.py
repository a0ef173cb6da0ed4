"""A place where a command's answer cannot be written is told in one line before the work begins."""

import os
import shutil

import foreign_robot
import pytest
from several import make_several
from tiny_loop import TWIN, write_tiny

COMMANDS = {
    "measure": ("measure tiny --model twin.toml --output there", "tasks.api.measure"),
    "predict": ("predict twin.toml log --output there", "tasks.api.predict"),
    "predict of pictures": ("predict twin.toml log --frames --output there", "tasks.api.predict"),
    "record": ("record tiny --model twin.toml --output there", "tasks.api.record_log"),
    "drive": ("drive tiny --agent steady --output there", "drive.study.drive_side_by_side"),
    "export": ("export twin.toml --to filter --output there", "tasks.api.export"),
    "import": ("import log there --robot nobodys", "tasks.api.import_log"),
    "score": ("score --proxy p.csv --target p.csv --metric d:max --output there", "score.usefulness.assess_each"),
    "score's table": (
        "score --proxy p.csv --target p.csv --metric d:max --table there",
        "score.usefulness.assess_each",
    ),
    "diagnose": ("diagnose log --output there", "diagnose.diagnose_log"),
    "sweep": ("sweep tiny --parameter trim --output there", "tasks.api.run_sweep"),
}
TARGET = "agent,episode,distance,survival_time\n" + "".join(
    f"{agent},{start},{start},2\n" for agent in ("steady", "brisk", "daredevil") for start in (0, 1)
)
OF_FOLDERS = ("predict of pictures", "record", "import", "score", "diagnose", "sweep")
IN_STUDIES = {
    "study": ("study tiny", "study.run_opened", {"figures": "a file", "report.html": "a folder"}),
    "study of families": ("study several", "study.run_opened_families", {"figures": "a file"}),
    "study of a bank": ("study bank", "study.study.run_bank", {"bank.json": "a folder", "report.html": "a folder"}),
    "sweep": ("sweep tiny --parameter trim", "tasks.api.run_sweep", {"figures": "a file"}),
    "teach": ("teach tiny", "tasks.api.teach", {"figures": "a file", "report.html": "a folder"}),
    "loop": ("loop tiny", "loop.run_loop", {"loop/diagnosed": "a file", "loop/report.html": "a folder"}),
    "diagnose": ("diagnose log --output tiny", "diagnose.diagnose_log", {"model.toml": "a folder"}),
}


@pytest.fixture(scope="module")
def made_once(make_studies):
    """A folder with all that the commands read."""
    home = make_studies("bank", target=None, preflight=None).parent
    make_several(make_studies, called="several")
    write_tiny(home / "tiny")
    (home / "tiny" / "target.csv").write_text(TARGET)
    (home / "twin.toml").write_text(TWIN)
    (home / "p.csv").write_text("agent,d\nA,1\nB,2\nC,3\n")
    (home / "log").mkdir()
    foreign_robot.write_own_times(home / "log", [foreign_robot.drive(1, seconds=12.0)])
    return home


@pytest.fixture
def here(made_once, tmp_path, monkeypatch):
    """The same in a folder of one's own, and there we are."""
    shutil.copytree(made_once, tmp_path, dirs_exist_ok=True)
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture
def beforehand(refused, monkeypatch):
    """The one line of a command that is refused before it works."""

    def run(words, work):
        monkeypatch.setattr(f"proxytune.cli.{work}", lambda *_, **__: pytest.fail("the work has begun"))
        return refused(*words.split())

    return run


def put(path, what):
    path.parent.mkdir(parents=True, exist_ok=True)
    path.mkdir() if what == "a folder" else os.mkfifo(path) if what == "a pipe" else path.write_text("")


def wanted(name):
    words, work = COMMANDS[name]
    place = {"drive": "there.png", "score's table": "there.csv"}.get(name, "there")
    return words.replace("there", place), work, place


@pytest.mark.parametrize("name", COMMANDS)
def test_what_is_of_another_kind_in_the_place_is_told_beforehand(here, beforehand, name):
    words, work, place = wanted(name)
    what = "a file" if name in OF_FOLDERS else "a folder"
    put(here / place, what)
    assert f"{place}: is {what}; give " in beforehand(words, work)


@pytest.mark.parametrize("name", ["measure", "record"])
def test_a_pipe_or_a_device_is_not_replaced(here, beforehand, name):
    words, work, place = wanted(name)
    put(here / place, "a pipe")
    assert f"{place}: is a device or a pipe; give " in beforehand(words, work)
    assert (here / place).is_fifo()


@pytest.mark.parametrize("name", ["export", "record", "score"])
def test_a_file_on_the_way_is_told_beforehand(here, beforehand, name):
    words, work, place = wanted(name)
    (here / "on").write_text("")
    told = beforehand(words.replace(place, f"on/the/{place}"), work)
    assert f"on/the/{place}: cannot be written there, as {here / 'on'} is no folder; choose another place" in told


@pytest.mark.parametrize("name", ["measure", "record", "score"])
def test_a_closed_folder_is_told_beforehand(here, beforehand, monkeypatch, name):
    words, work, place = wanted(name)
    monkeypatch.setattr(os, "access", lambda path, mode: path != here)
    told = beforehand(words, work)
    assert f"{place}: cannot be written there, as {here} is closed to you; choose another place" in told


@pytest.mark.parametrize(("words", "work", "places"), IN_STUDIES.values(), ids=IN_STUDIES)
def test_what_is_in_the_way_in_a_folder_is_told_beforehand(here, beforehand, words, work, places):
    folder = here / next(word for word in reversed(words.split()) if (here / word).is_dir())
    for place, what in places.items():
        put(folder / place, what)
        assert f"{folder.name}/{place}: is {what}; move it away" in beforehand(words, work)
        (folder / place).rmdir() if what == "a folder" else (folder / place).unlink()


@pytest.mark.parametrize("name", ["study", "teach", "loop"])
def test_a_closed_study_is_told_beforehand(here, beforehand, monkeypatch, name):
    words, work, _ = IN_STUDIES[name]
    monkeypatch.setattr(os, "access", lambda path, mode: path != here / "tiny")
    assert f"as {here / 'tiny'} is closed to you; copy the study elsewhere" in beforehand(words, work)
