"""The whole loop: with a diagnosis that is given, then with the real one, killed in every step."""

import functools
import json
import os
import re
import shutil
import signal
import time
from contextlib import redirect_stdout
from io import StringIO
from pathlib import Path

import pytest
from launched import Launched
from processes import wait_for
from tiny_loop import RIGHTING, short, write_diagnosis, write_tiny

from proxytune.api import StudyReport
from proxytune.cli.main import main
from proxytune.loop import diagnosing
from proxytune.loop.run import STEPS

LINES = {name: f"step {number} of {len(STEPS)}," for number, name in enumerate(STEPS, start=1)}
STUDIES = {"study": "", "extended study": "loop/extended"}
"""These are killed in the middle: a few episodes are driven."""


def give_a_diagnosis(patch):
    """Let a loop be given what a diagnosis finds: the logs that were diagnosed, and changes of what is found."""
    found, changes = [], {}

    def diagnose(loop, source, folder, teller):
        found.append(source)
        write_diagnosis(folder, **changes)

    patch.setattr(diagnosing, "diagnose_target", diagnose)
    patch.setattr(diagnosing, "Wanted", short)
    # Studies' own figures have tests of their own.
    patch.setattr(StudyReport, "write", lambda self: None)
    return found, changes


@pytest.fixture
def diagnosed(monkeypatch):
    """The logs that were diagnosed, and changes of what is found."""
    return give_a_diagnosis(monkeypatch)


@pytest.fixture(scope="module")
def closed_once(tmp_path_factory):
    """A loop, closed once, and its document."""
    return close_tiny(write_tiny(tmp_path_factory.mktemp("closed") / "tiny"))


def close_tiny(folder):
    with pytest.MonkeyPatch.context() as patch, redirect_stdout(StringIO()) as text:
        give_a_diagnosis(patch)
        assert main(["loop", str(folder), "--json"]) == 0
    return folder, json.loads(text.getvalue())


@pytest.fixture
def closed(closed_once, tmp_path):
    """A closed loop of one's own."""
    return Path(shutil.copytree(closed_once[0], tmp_path / "tiny"))


@pytest.fixture
def close(answered):
    """Run the command; its document."""
    return functools.partial(answered, "loop")


def but_for_times(document):
    return {key: value for key, value in document.items() if key not in ("this_run", "files", "next")}


def test_before_and_after_come_with_interval_and_floor(closed_once):
    folder, document = closed_once
    assert document["this_run"]["steps"] == list(STEPS)
    assert document["verdict"] == "explained"
    assert document["prpv"]["most"] == 6
    assert document["prpv"]["held_out"]["agents"] == ["crawler", "laggy", "edges"]
    for levels in (document["prpv"], document["prpv"]["held_out"], document["errors"]["error"]):
        for side in ("before", "after"):
            low, high = levels[side]["interval"]
            assert low <= levels[side]["value"] <= high
            assert levels[side]["floor_ends"] is not None
    page = (folder / "loop" / "report.html").read_text()
    assert document["sentence"] in page
    assert page.count('<svg class="drawn"') == 1


@pytest.fixture(scope="module")
def righted_once(closed_once, tmp_path_factory):
    """A closed loop with other held-out agents, one of which is righted, and its document."""
    folder = Path(shutil.copytree(closed_once[0], tmp_path_factory.mktemp("righted") / "tiny"))
    study = folder / "study.toml"
    study.write_text(study.read_text().replace(*RIGHTING))
    return close_tiny(folder)


@pytest.fixture
def righting(righted_once, diagnosed, tmp_path):
    """The same in a folder of one's own."""
    return Path(shutil.copytree(righted_once[0], tmp_path / "tiny")), righted_once[1]


def captions_of_episodes(folder):
    """Captions of the righted agent's pictures on the page."""
    page = (folder / "loop" / "report.html").read_text()
    captions = re.findall(r'<svg class="drawn".*?<figcaption[^>]*>(.*?)</figcaption>', page, re.DOTALL)
    assert len(captions) == page.count('<svg class="drawn"')
    return [caption for caption in captions if "seed" in caption]


@pytest.mark.slow
def test_the_righted_agent_is_shown_beside_the_target_before_and_after(righting, answered):
    folder, document = righting
    assert document["righted"]["agent"] == "yellow_only"
    before, after = captions_of_episodes(folder)
    assert re.search(r"Wrongly ordered pairs with yellow_only: [1-9][\d.]* before, 0 after\.", before)
    assert "The same start and seed in the extended proxy." in after
    start = re.search(r"from start (\d), where of starts 0 to 1 the two are furthest apart", before)[1]
    for study, caption in ((folder, before), (folder / "loop" / "extended", after)):
        driven = answered("drive", study, "--agent", "yellow_only", "--start", start)
        for side in ("proxy", "target"):
            scores = driven[side]["metrics"]
            assert f"distance {scores['distance']:.3g} m, survival time {scores['survival_time']:.3g} s" in caption
        assert f"at {driven['parted_s']:.1f} s" in caption if driven["parted_s"] else "stay within 5 cm" in caption


@pytest.mark.slow
def test_without_a_twin_the_righted_agent_is_named_but_not_shown(righting, close):
    folder, document = righting
    study, target, held_out = folder / "study.toml", folder / "target.csv", folder / "loop" / "held_out.csv"
    study.write_text(study.read_text().replace('truth = "twin.toml"', ""))
    target.write_text(target.read_text() + held_out.read_text().partition("\n")[2])
    assert close(folder, "--log", folder / "loop" / "log")["righted"] == document["righted"]
    assert captions_of_episodes(folder) == []


@pytest.mark.slow
def test_kept_pictures_that_are_damaged_are_told_of_and_drawn_again_once_removed(righting, close, capsys):
    kept = righting[0] / "loop" / "righted"
    (kept / "before.svg").unlink()
    assert main(["loop", str(righting[0])]) == 1
    assert "pictures.json: cannot be read; remove it to draw the righted agent again" in capsys.readouterr().err
    (kept / "pictures.json").unlink()
    assert close(righting[0])["this_run"]["steps"] == ["righted agent"]
    assert len(captions_of_episodes(righting[0])) == 2


def test_what_is_done_is_not_done_again_and_a_target_of_another_twin_told(
    closed, closed_once, diagnosed, close, refused
):
    again = close(closed)
    assert (again["this_run"]["steps"], again["this_run"]["episodes"]) == ([], 0)
    assert diagnosed[0] == []
    assert but_for_times(again) == but_for_times(closed_once[1])
    twin = closed / "twin.toml"
    twin.write_text(twin.read_text().replace("0.15", "0.10"))
    assert "target.csv: was measured of another model" in refused("loop", closed)


@pytest.mark.slow
def test_another_log_does_only_what_comes_after_it_again(closed, closed_once, diagnosed, close, tmp_path):
    log = (closed / "loop" / "log").rename(tmp_path / "log")
    # The same drives, but now they are what somebody gave.
    assert close(closed, "--log", log)["this_run"]["steps"] == ["diagnosis"]
    assert close(closed, "--log", log)["this_run"]["steps"] == []
    samples = log / "samples.csv"
    samples.write_text(samples.read_text().rsplit("\n", 2)[0] + "\n")
    diagnosed[1]["verdict"] = "partly explained"
    changed = close(closed, "--log", log)
    assert (changed["this_run"]["steps"], changed["this_run"]["episodes"]) == (["diagnosis"], 0)
    assert (changed["verdict"], changed["prpv"]) == ("partly explained", closed_once[1]["prpv"])


@pytest.mark.slow
def test_another_model_tunes_again_and_the_way_back_drives_nothing(closed, closed_once, diagnosed, close):
    found = closed / "loop" / "diagnosed" / "model.toml"
    was = found.read_text()
    found.write_text(was.replace("0.149", "0.05"))
    assert close(closed)["this_run"]["steps"] == ["extension", "extended study", "held-out agents", "righted agent"]
    found.write_text(was)
    back = close(closed)
    assert (back["this_run"]["steps"], back["this_run"]["episodes"]) == (["extension", "righted agent"], 0)
    assert but_for_times(back) == but_for_times(closed_once[1])


def test_where_nothing_is_missing_the_loop_says_so_and_ends(tmp_path, diagnosed, close):
    diagnosed[1].update(verdict="nothing missing", effects=[])
    document = close(write_tiny(tmp_path / "tiny"))
    assert document["this_run"]["steps"] == list(STEPS)[:4]
    assert document["steps"] == list(STEPS)[:4]
    assert "nothing to extend the simulator by (verdict: nothing missing)" in document["sentence"]
    assert document["prpv"]["after"] is None
    assert document["errors"]["error"]["after"] is None
    assert not (tmp_path / "tiny" / "loop" / "extended").exists()


@pytest.mark.slow
def test_what_depends_on_the_users_own_modules_is_done_again_when_they_change(closed, diagnosed, close, refused):
    (closed / "mine.py").write_text("GAIN = 1.0\n")
    assert "target.csv: was measured of another model" in refused("loop", closed)
    for name in ("target.csv", "study.db"):
        (closed / name).unlink()
    assert {"target", "log", "diagnosis", "held-out scores"} <= set(close(closed)["this_run"]["steps"])
    assert close(closed)["this_run"]["steps"] == []
    (closed / "mine.py").write_text("GAIN = 1.0  # a comment\n")
    assert close(closed)["this_run"]["steps"] == ["extension"]


@pytest.mark.slow
def test_scores_of_held_out_agents_in_the_targets_table_are_used(closed, closed_once, diagnosed, close):
    more = (closed / "loop" / "held_out.csv").read_text().partition("\n")[2]
    loop_json = closed / "loop" / "loop.json"
    kept = json.loads(loop_json.read_text())
    # What is left is a table that somebody gave.
    del kept["steps"]["target"]
    loop_json.write_text(json.dumps(kept))
    (closed / "loop" / "held_out.csv").unlink()
    with (closed / "target.csv").open("a") as table:
        table.write(more)
    document = close(closed)
    assert document["this_run"]["steps"] == []
    assert not (closed / "loop" / "held_out.csv").exists()
    assert document["prpv"] == closed_once[1]["prpv"]


def start(launcher, folder):
    return Launched(launcher, folder, ["loop", str(folder)], "tiny_loop")


def finished(launcher, folder):
    """Run to the end: the document and the page, but for times and where it lies, and the steps of this run."""
    status, printed = start(launcher, folder).end()
    assert status == 0, printed
    page = re.sub(r"\d{4}-\d\d-\d\d \d\d:\d\d UTC", "", (folder / "loop" / "report.html").read_text())
    document = json.loads(printed[printed.index("\n{\n") :].replace(str(folder), ""))
    return {**document, "this_run": None}, page.replace(str(folder), ""), document["this_run"]["steps"]


@pytest.mark.slow
def test_killed_in_every_step_it_goes_on_to_the_same_page(tmp_path, launcher):
    """With the real diagnosis, which names what the proxy lacks."""
    whole, stopped = (write_tiny(tmp_path / name, RIGHTING) for name in ("whole", "stopped"))
    document, page, _ = expected = finished(launcher, whole)
    assert document["righted"]
    assert [effect["name"] for effect in document["effects"]] == ["dead_band"]
    assert document["errors"]["error"]["after"]["value"] < 0.2 * document["errors"]["error"]["before"]["value"]
    assert page.count('<svg class="drawn"') == 5  # two show the righted agent
    for name, line in LINES.items():
        process = start(launcher, stopped)
        while line not in process.output.read_text():
            assert not process.poll()
            time.sleep(0.005)
        if name in STUDIES:
            wait_for(stopped / STUDIES[name], process, 3)
        os.kill(process.pid, signal.SIGKILL)
        assert process.end()[0] == -signal.SIGKILL
    assert finished(launcher, stopped)[:2] == expected[:2]
    assert finished(launcher, stopped)[2] == []
