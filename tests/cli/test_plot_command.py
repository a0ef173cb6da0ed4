import json
import shutil

from proxytune.cli.main import main


def test_every_figure_is_drawn_again_without_simulating(finished, capsys):
    assert main(["study", str(finished), "--json"]) == 0
    before = json.loads(capsys.readouterr().out)
    assert main(["sweep", str(finished), "--parameter", "all", "--points", "2", "--at", "trim=0.1,delay=0.12"]) == 0
    content = (finished / "study.db").read_bytes()
    names = sorted(path.name for path in (finished / "figures").glob("*.png"))
    shutil.rmtree(finished / "figures")
    (finished / "report.html").unlink()
    capsys.readouterr()
    assert main(["plot", str(finished), "--json"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert names == sorted(path.name for path in (finished / "figures").iterdir())
    assert len(names) == 5
    assert (finished / "report.html").exists()
    assert document["best"] == before["best"]
    assert (finished / "study.db").read_bytes() == content


def test_sweeps_are_drawn_also_where_the_study_itself_has_not_been_run(make_study, capsys):
    folder = make_study()
    assert main(["sweep", str(folder), "--parameter", "trim", "--points", "2"]) == 0
    capsys.readouterr()
    assert main(["plot", str(folder), "--json"]) == 0
    assert json.loads(capsys.readouterr().out) == {"figures": [str(folder / "figures" / "sweep_trim.png")]}


def test_a_study_that_has_not_been_run_is_told(make_study, capsys):
    folder = make_study()
    assert main(["plot", str(folder)]) == 2
    told = capsys.readouterr().err
    hint = f"run the study first: python -m proxytune study {folder}"
    assert told == f"proxytune plot: {folder / 'study.db'}: no such file; {hint}\n"


def test_a_finished_study_can_be_drawn_when_the_family_s_code_has_changed(finished, monkeypatch, capsys):
    monkeypatch.setattr("wobbly.Wobbly.identity", "wobbly, a later version")
    assert main(["study", str(finished)]) == 2
    assert "changed since the first trial: the domain family" in capsys.readouterr().err
    assert main(["plot", str(finished)]) == 0
