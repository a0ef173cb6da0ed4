"""The command, `python benchmarks/compare.py`: runs are kept and judged, and bad input is one line."""

import json
import shutil
import signal
import subprocess
import sys
import time
from contextlib import redirect_stdout
from io import StringIO
from pathlib import Path

import compared_engines
import pytest
import runs
from blank import blank
from compare import LEFT, main, seeds
from judgement import judging_code
from processes import ENVIRONMENT, ROOT, besides_progress
from runs import read_runs

from proxytune.search import registry

FIGURES_DRAWN = True  # see conftest.py
FEW = ("--engines", "random,sobol", "--seeds", "2", "--budget", "7", "--initial", "5")


def compare(*arguments):
    return main([*map(str, arguments)])


@pytest.fixture(autouse=True)
def _blank_from_now_on(monkeypatch):
    """The first figure is drawn; what is drawn again is of no matter."""
    monkeypatch.setattr("matplotlib.figure.Figure.savefig", blank)


@pytest.fixture(scope="module")
def compared(tmp_path_factory):
    """The folder of a comparison that was made once, and its document."""
    folder = tmp_path_factory.mktemp("compared") / "out"
    with redirect_stdout(StringIO()) as printed:
        assert compare("analytic", *FEW, "--output", folder, "--json") == 0
    return folder, json.loads(printed.getvalue())


@pytest.fixture
def document(compared, tmp_path):
    """The document, and the folder in a place of one's own."""
    shutil.copytree(compared[0], tmp_path / "out")
    return compared[1]


@pytest.mark.slow
def test_it_prints_one_document_with_every_engine_and_draws_the_figure(document, tmp_path):
    assert [row["engine"] for row in document["engines"]] == ["random", "sobol"]
    assert (document["objective"], document["budget"], document["default"]) == ("analytic", 7, "random")
    assert {row["seeds"] for row in document["engines"]} == {2}
    for row in document["engines"]:
        assert row["regret"]["low"] <= row["regret"]["value"] <= row["regret"]["high"]
        assert 0 < row["error"]["value"] < 1
    assert [row["saved"] is None for row in document["engines"]] == [True, False]
    assert [row["ratio"] is None for row in document["engines"]] == [True, False]
    assert [row["region"] for row in document["engines"]] == [None, None], "a formula has no parts"
    assert (tmp_path / "out" / "compare.png").stat().st_size > 10_000
    assert json.loads((tmp_path / "out" / "compare.json").read_text())["engines"] == document["engines"]


@pytest.mark.slow
def test_finished_runs_are_kept_and_a_line_cut_off_is_run_again(document, tmp_path, capsys):
    path = tmp_path / "out" / "runs.jsonl"
    lines = path.read_text().splitlines()
    assert len(lines) == len(read_runs(path)) == 4
    path.write_text("\n".join([lines[0].replace('"error": ', '"error": 1000'), *lines[1:3], lines[3][:40]]))
    assert compare("analytic", *FEW, "--output", tmp_path / "out", "--json") == 0
    again = json.loads(capsys.readouterr().out)
    assert len(read_runs(path)) == 4
    assert len(path.read_text().splitlines()) == 5
    assert max(row["error"]["high"] for row in again["engines"]) > 100, "the first line was not run again"


@pytest.mark.slow
def test_runs_that_other_code_has_judged_are_judged_again_and_not_run_again(document, tmp_path, capsys, monkeypatch):
    path = tmp_path / "out" / "runs.jsonl"
    fresh = read_runs(path)
    path.write_text(path.read_text().replace(f'"code": "{judging_code()}"', '"code": "old"'))
    monkeypatch.setattr(runs, "run_engine", None)
    assert compare("analytic", *FEW, "--output", tmp_path / "out", "--json") == 0
    assert read_runs(path) == fresh
    assert json.loads(capsys.readouterr().out)["engines"] == document["engines"]


@pytest.mark.slow
def test_some_of_the_seeds_are_summed_up_and_those_there_are_not_run_again(document, tmp_path, capsys, monkeypatch):
    monkeypatch.setattr(runs, "run_engine", lambda objective, key, engine: pytest.fail(f"seed {key.seed} is run"))
    assert compare("analytic", *FEW[:2], "--seeds", "1:2:1", *FEW[4:], "--output", tmp_path / "out", "--json") == 0
    assert json.loads(capsys.readouterr().out)["engines"] == document["engines"]
    assert [list(seeds(text)) for text in ("3", "2:7:2", "4:5")] == [[1, 2, 3], [2, 4, 6], [4, 5]]
    for wrong in ("few", "0:9", "1:9:0", "1:2:3:4"):
        with pytest.raises(ValueError, match=r".+"):
            seeds(wrong)


@pytest.mark.slow
def test_a_study_is_compared_on_its_own_episodes_which_are_simulated_once(make_study, tmp_path, capsys):
    journal = tmp_path / "journal"
    folder = make_study(domain={"journal": f'"{journal}"'})
    arguments = (str(folder), "--engines", "gp,sobol", "--seeds", "2", "--output", str(tmp_path / "out"))
    assert main([*arguments, "--json"]) == 0
    out, told = capsys.readouterr()
    document = json.loads(out)
    first, begins, *runs = told.splitlines()
    assert begins.endswith("comparing begins; at most 4 runs")
    assert first == f"compare: at most {2 * 2 * 8 * 18} episodes, {8 * 18} in each run"
    assert [line.partition(" s: ")[2] for line in runs] == [
        f"run {1 + place} of 4: {engine}, seed {1 + place // 2}; {1 + place} of at most 4 runs"
        for place, engine in enumerate(("gp", "sobol", "gp", "sobol"))
    ]
    assert (document["objective"], document["budget"]) == ("wobbly", 7)
    assert [row["error"] for row in document["engines"]] == [None, None]
    episodes = journal.read_text().splitlines()
    # Two engines share the design of five; each goes on with two, and is judged on one more θ.
    assert len(episodes) <= 2 * (5 + 2 * 3) * 18
    assert not (folder / "study.db").exists()
    assert main([*arguments, "--json"]) == 0
    assert journal.read_text().splitlines() == episodes
    assert len(capsys.readouterr().err.splitlines()) == 1


def truths(folder, output, *more):
    few = ("--truths", "--engines", "outcomes,sobol", "--seeds", "2", "--output", output)
    return (*map(str, (folder, *few, *more)), "--json")


@pytest.mark.slow
def test_with_truths_it_tells_what_is_known_of_them_and_simulates_nothing_twice(make_study, tmp_path, capsys):
    folder = make_study(domain={"journal": f'"{tmp_path / "journal"}"'})
    assert main([*truths(folder, tmp_path / "out")]) == 0
    document = json.loads(capsys.readouterr().out)
    for row in document["engines"]:
        assert row["seeds"] == 2
        assert 0 <= row["region"]["covered"] <= 2
        assert set(row["region"]["intervals_covered"]) == {"delay", "trim"}
        assert 0.0 < row["region"]["share"]["value"] < 1.0
        assert row["error"]["value"] < 1.0
    episodes = (tmp_path / "journal").read_text().splitlines()
    (tmp_path / "out" / "runs.jsonl").unlink()
    assert main([*truths(folder, tmp_path / "out")]) == 0
    again = json.loads(capsys.readouterr().out)
    assert (tmp_path / "journal").read_text().splitlines() == episodes
    timed = [{**row, "seconds": 0.0} for row in document["engines"]]
    assert [{**row, "seconds": 0.0} for row in again["engines"]] == timed


@pytest.mark.slow
def test_targets_with_what_the_proxy_lacks_are_other_runs(make_study, tmp_path, capsys):
    folder, lacks = make_study(parameters={"trim": "[-0.3, 0.3]"}), tmp_path / "lacks.toml"
    lacks.write_text("delay = 0.25\n")
    assert main([*truths(folder, tmp_path / "out")]) == 0
    assert main([*truths(folder, tmp_path / "out", "--lacks", lacks, "--lacks", lacks)]) == 0
    capsys.readouterr()
    runs = read_runs(tmp_path / "out" / "runs.jsonl")
    assert len(runs) == 8
    assert len({key.objective for key in runs}) == 2


BAD = {
    "an engine of metrics where there are none": (("--engines", "composite"), "'composite' models what a score is"),
    "an unknown engine": (("--engines", "gp,tpr"), "--engines: unknown engine 'tpr'"),
    "no engine": (("--engines", ","), "--engines: names no engine; give some of outcomes"),
    "one seed": (("--seeds", "1"), "--seeds 1: give at least 2"),
    "one seed of several": (("--seeds", "3:4:2"), "--seeds 1: give at least 2"),
    "truths of what has them": (("--truths",), "--truths: 'analytic' has its own truth for every seed; leave the"),
    "what truths lack without them": (("--lacks", "x.toml"), "--lacks: needs simulated targets; add --truths"),
    "no budget": (("--budget", "0"), "--budget 0: give at least 2"),
    "a budget of the design": (("--budget", "10"), "--budget 10: the design of 10 uses it up; raise it"),
}


@pytest.mark.parametrize(("options", "expected"), BAD.values(), ids=BAD)
def test_bad_input_is_one_line_and_exit_2(tmp_path, capsys, options, expected):
    engines_named = () if "--engines" in options else ("--engines", "sobol")
    assert compare("analytic", *engines_named, *options, "--output", tmp_path / "out") == 2
    out, told = capsys.readouterr()
    assert (out, told.count("\n")) == ("", 1)
    assert expected in told
    assert list((tmp_path / "out").glob("*")) == []


@pytest.mark.parametrize("engine", ["random", "gp"])
def test_an_agent_that_fails_everywhere_is_named_with_its_start(make_study, tmp_path, capsys, engine):
    folder = make_study(family='"deadly:deadly"', domain={"faults": '["agent1:*:exits"]'})
    few = ("--engines", engine, "--seeds", "2", "--budget", "3", "--initial", "2")
    assert compare(folder, *few, "--output", tmp_path / "out") == 1
    told = besides_progress(capsys.readouterr().err)
    failure = "agent 'agent1' failed from every start, first with: the agent or the domain family raised SystemExit: 0"
    assert told.startswith("compare: no trial has a")
    assert f"; seed 1, the first θ: {failure} (deadly.py, line " in told
    assert told.count("\n") == 1


@pytest.mark.parametrize(("engine", "needs"), [("tpe", "Optuna"), ("gpsampler", "Optuna and PyTorch")])
def test_an_engine_without_its_library_is_told_before_anything_runs(tmp_path, capsys, monkeypatch, engine, needs):
    for module in (registry, compared_engines):
        monkeypatch.setattr(module, "find_spec", lambda name: None)
    assert compare("analytic", "--engines", f"gp,{engine}", "--output", tmp_path / "out") == 2
    assert f"--engines: '{engine}' needs {needs}, which " in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


@pytest.mark.slow
def test_unless_named_the_engines_of_studies_are_compared_whose_library_is_there(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr(registry, "find_spec", lambda name: None)
    assert compare("analytic", *FEW[2:], "--output", tmp_path, "--json") == 0
    assert [row["engine"] for row in json.loads(capsys.readouterr().out)["engines"]] == ["gp", "random", "sobol"]


@pytest.mark.slow
def test_ones_own_engine_is_compared_and_the_page_tells_how_to_repeat_that(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "mine.py").write_text("from proxytune.search.engine import SOBOL as ENGINE\n")
    assert compare("ranking", "--engines", "mine:ENGINE,random", *FEW[2:], "--output", "out", "--json") == 0
    rows = json.loads(capsys.readouterr().out)["engines"]
    assert [row["engine"] for row in rows] == ["mine:ENGINE", "random"]
    assert [set(row["region"]["intervals_covered"]) for row in rows] == [{"blur", "camera_pitch", "delay", "trim"}] * 2
    assert "python benchmarks/compare.py ranking --engines mine:ENGINE,random" in Path("out", "report.html").read_text()


@pytest.mark.slow
def test_a_terminated_comparison_ends_its_processes_and_goes_on_to_the_same_runs(tmp_path):
    """Started as it is from a shell: what goes to other processes is found there."""
    words = ("analytic", "--engines", "gp,sobol", "--seeds", "8", "--budget", "9", "--initial", "5", "--output")
    command = [sys.executable, str(ROOT / "benchmarks" / "compare.py"), *words, str(tmp_path / "out")]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=ENVIRONMENT)
    path = tmp_path / "out" / "runs.jsonl"
    while not path.exists() and process.poll() is None:
        time.sleep(0.01)
    process.send_signal(signal.SIGTERM)
    out, told = process.communicate(timeout=60)  # returns only when every process that holds its pipes has ended
    assert besides_progress(told) == f"compare: terminated; {LEFT}\n"
    assert (process.returncode, out) == (143, "")
    kept = path.read_text().splitlines()
    assert 0 < len(kept) < 16
    for output in (tmp_path / "out", tmp_path / "whole"):
        assert compare(*words, output) == 0
    assert path.read_text().splitlines()[: len(kept)] == kept
    found, whole = (read_runs(folder / "runs.jsonl") for folder in (tmp_path / "out", tmp_path / "whole"))
    assert {key: (run.visited, run.judgement) for key, run in found.items()} == {
        key: (run.visited, run.judgement) for key, run in whole.items()
    }
