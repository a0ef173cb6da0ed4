import json
import re
from pathlib import Path

import pytest
from processes import besides_progress

from proxytune.cli.main import main


def test_a_study_runs_and_prints_one_document_and_a_second_time_simulates_nothing(make_study, answered):
    folder = make_study()
    first = answered("study", folder)
    assert first["episodes"] == {"run": 126, "reused": 0, "failed": 0}
    assert 0 < first["seconds"]["outside_episodes"] <= first["seconds"]["total"]
    assert [Path(path).exists() for path in (*first["figures"], first["report"])] == [True] * 5
    second = answered("study", folder)
    assert second["episodes"] == {"run": 0, "reused": 126, "failed": 0}
    costs = ("seconds", "episodes")
    assert {k: v for k, v in first.items() if k not in costs} == {k: v for k, v in second.items() if k not in costs}
    names = "figures report.html study.db study.toml target.csv"
    assert {path.name for path in folder.iterdir()} == set(names.split())


def test_bad_input_unknown_studies_or_places_that_cannot_be_written_are_one_line(
    make_study, refused, tmp_path, travelling
):
    assert "budget: must be between" in refused("study", make_study(budget="-1"))
    assert "agents: no agent 'agnet1'" in refused("study", make_study(agents='["agent0", "agnet1"]'))
    for option, value in (("budget", "0"), ("jobs", "1025")):
        assert f"{option} must be between 1 and " in refused("study", make_study(), f"--{option}={value}")
    assert not (make_study() / "study.db").exists()
    assert "has no study.toml; give the folder of a study" in refused("study", tmp_path)
    assert "no study of that name comes with proxytune; did you mean 'quickstart'?" in refused(
        "study", tmp_path / "quickstrat"
    )
    assert not (tmp_path / "quickstrat").exists()
    (tmp_path / "file").touch()
    assert "cannot be written" in refused("study", tmp_path / "file" / "quickstart", status=1)


@pytest.mark.slow
def test_a_parameter_that_does_nothing_is_said_before_the_study_and_recorded(make_study, capsys):
    folder = make_study(
        family='"partly_dead:partly_dead"', parameters={"matters": "[-1, 1]", "dead": "[0, 1]"}, preflight="true"
    )
    assert main(["study", str(folder), "--json"]) == 0
    out, told = capsys.readouterr()
    found = json.loads(out)["preflight"]
    assert besides_progress(told) == f"proxytune study: {found['warnings'][0]}\n"
    assert "'dead' changes nothing at all" in told
    assert {name: one["moves"] for name, one in found["parameters"].items()} == {"matters": True, "dead": False}
    assert main(["study", str(folder)]) == 0
    out, told = capsys.readouterr()
    out = " ".join(out.split())
    assert "pre-flight 'dead' changes nothing at all" in out
    # Seven trials and the neutral values of its parameters, each of 18 episodes
    assert f"0 run, {8 * 18 + found['episodes']} reused" in out
    assert told == "", "a finished study has no progress to tell of"


@pytest.mark.slow
def test_without_a_terminal_every_trial_is_a_plain_line_with_its_prpv_the_best_and_the_episodes(make_study, capsys):
    assert main(["study", str(make_study(preflight="true", confirm="1", cut_off="true")), "--json"]) == 0
    out, told = capsys.readouterr()
    lines = [line for line in told.splitlines() if "study: page: " not in line]
    assert "pre-flight 1 of 2 begins" in lines[0]
    said = [line.partition(" s: ")[2] for line in lines if " begins" not in line]
    found = json.loads(out)
    assert [line.partition(";")[0] for line in said[:2]] == ["pre-flight 1 of 2", "pre-flight 2 of 2"]
    trials = [line for line in said if line.startswith("trial ")]
    assert len(trials) == len(found["trials"])
    assert all(
        re.fullmatch(r"trial \d of 7: .*PRPV .*, best so far \d+; \d+ of at most \d+ episodes", t) for t in trials
    )
    assert said[-1].startswith("fresh episodes ")


@pytest.mark.slow
@pytest.mark.parametrize(("asked", "says"), [("7", "7 of 7"), ("5", "7 (budget 5)"), ("9", "9 of 9")])
def test_a_budget_on_the_command_line_stands_over_study_toml(finished, capsys, answered, asked, says):
    assert main(["study", str(finished), "--budget", asked]) == 0
    assert f"trials {says}; best" in " ".join(capsys.readouterr().out.split())
    assert answered("study", finished)["settings"]["budget"] == 7, "study.toml stays as it is"


@pytest.fixture
def travelling(make_study, tmp_path, monkeypatch):
    """A study that comes with the package."""
    home = tmp_path / "package"
    home.mkdir()
    make_study("package/quickstart")
    (home / "quickstart" / "study.db").write_text("somebody's")
    (home / "quickstart" / "figures").mkdir()
    monkeypatch.setattr("proxytune.cli.options.shipped", lambda kind: home)
    return home


@pytest.mark.slow
def test_a_study_that_comes_with_the_package_is_copied_and_that_is_said(travelling, tmp_path, capsys):
    folder = tmp_path / "somewhere" / "quickstart"
    assert main(["study", str(folder), "--json"]) == 0
    out, told = capsys.readouterr()
    assert json.loads(out)["name"] == "wobbly"
    assert besides_progress(told) == f"copied the study 'quickstart', which comes with proxytune, to {folder}\n"
    assert (travelling / "quickstart" / "study.db").read_text() == "somebody's"
    assert not list(folder.parent.glob(".*"))
    assert main(["study", str(folder / "study.toml"), "--json"]) == 0
    assert capsys.readouterr().err == ""
