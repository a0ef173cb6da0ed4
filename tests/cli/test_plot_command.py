import json
import shutil
import sqlite3

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
    assert len(names) == 8
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


def swept_against(folder, model, capsys, *more):
    arguments = ["sweep", str(folder), "--points", "2", "--at", "trim=0.1,delay=0.12", "--parameter", *more]
    assert main([*arguments, "--target-model", str(model)]) == 0
    capsys.readouterr()
    return {path.name: path.read_bytes() for path in (folder / "figures").glob("*.png")}


def drawn_again(folder, capsys):
    shutil.rmtree(folder / "figures")
    assert main(["plot", str(folder), "--json"]) == 0
    named = json.loads(capsys.readouterr().out)["figures"]
    drawn = {path.name: path.read_bytes() for path in (folder / "figures").iterdir()}
    assert sorted(named) == sorted(str(folder / "figures" / name) for name in drawn)
    return drawn


def test_pod_is_drawn_again_without_the_target_model_also_after_the_code_has_changed(
    make_study, tmp_path, capsys, monkeypatch
):
    folder, model = make_study(family='"echo:echo"'), tmp_path / "truth.toml"
    model.write_text("trim = 0.1\ndelay = 0.12\n")
    before = swept_against(folder, model, capsys, "all")
    assert {"sweep_trim_delay=0.12_pod.png", "sweep_delay_trim=0.1_pod.png"} < before.keys()
    model.unlink()
    monkeypatch.setattr("wobbly.Wobbly.identity", "code of another day")
    assert drawn_again(folder, capsys) == before


def test_the_sweep_asked_for_last_is_drawn_where_two_have_one_name(make_study, tmp_path, capsys):
    folder, model = make_study(family='"echo:echo"'), tmp_path / "truth.toml"
    model.write_text("trim = 0.1\n")
    first = swept_against(folder, model, capsys, "trim")
    swept_against(folder, model, capsys, "trim", "--points", "5")
    assert drawn_again(folder, capsys) != first
    assert swept_against(folder, model, capsys, "trim") == first
    assert drawn_again(folder, capsys) == first


def test_a_sweep_of_an_older_format_is_drawn_without_pod(make_study, capsys):
    folder = make_study()
    assert main(["sweep", str(folder), "--parameter", "trim", "--points", "2"]) == 0
    before = {path.name: path.read_bytes() for path in (folder / "figures").glob("*.png")}
    with sqlite3.connect(folder / "study.db") as plain:
        plain.executescript(
            "CREATE TABLE old AS SELECT parameter, base, points, identity FROM sweeps; DROP TABLE sweeps;"
            " ALTER TABLE old RENAME TO sweeps; PRAGMA user_version = 1;"
        )
    capsys.readouterr()
    assert drawn_again(folder, capsys) == before
