import shutil

import pytest

from proxytune.cli.main import main

FIGURES_DRAWN = True  # see conftest.py


@pytest.mark.slow
def test_every_figure_is_drawn_again_without_simulating(finished, answered):
    before = answered("study", finished)
    assert main(["sweep", str(finished), "--parameter", "all", "--points", "2", "--at", "trim=0.1,delay=0.12"]) == 0
    content = (finished / "study.db").read_bytes()
    names = sorted(path.name for path in (finished / "figures").glob("*.png"))
    shutil.rmtree(finished / "figures")
    (finished / "report.html").unlink()
    document = answered("plot", finished)
    tables = {"trials.csv", "parameters.tex", "usefulness.tex"}
    pages = {path.name for path in (finished / "figures").glob("*.html")}
    assert sorted({*names, *tables, *pages}) == sorted(path.name for path in (finished / "figures").iterdir())
    assert {str(finished / "figures" / name) for name in pages} == set(document["pages"])
    assert len(pages) == 1
    assert {str(finished / "figures" / name) for name in tables} == set(document["tables"])
    assert len(names) == 8
    assert (finished / "report.html").exists()
    assert document["best"] == before["best"]
    assert (finished / "study.db").read_bytes() == content


def test_a_study_that_has_not_been_run_is_told_and_its_sweeps_are_drawn(make_study, refused, answered):
    folder = make_study()
    hint = f"run the study first: python -m proxytune study {folder}"
    assert refused("plot", folder) == f"proxytune plot: {folder / 'study.db'}: no such file; {hint}\n"
    answered("sweep", folder, "--parameter", "trim", "--points", "2")
    home = folder / "figures"
    drawn = {"figures": [str(home / "sweep_trim.png")], "pages": [str(home / "sweep_trim.html")]}
    assert answered("plot", folder) == drawn
    page = (home / "sweep_trim.html").read_text()
    assert f"python -m proxytune plot {folder}" in page
    assert "The others are nominal." in page


def figures_of(folder):
    return {path.name: path.read_bytes() for path in (folder / "figures").glob("*.png")}


@pytest.mark.slow
def test_pod_is_drawn_again_without_the_target_model_also_after_other_code(make_study, tmp_path, answered, monkeypatch):
    folder, model = make_study(family='"echo:echo"'), tmp_path / "truth.toml"
    model.write_text("trim = 0.1\ndelay = 0.12\n")
    base = ("--points", "2", "--at", "trim=0.1,delay=0.12")
    answered("sweep", folder, *base, "--parameter", "all", "--target-model", model)
    before = figures_of(folder)
    assert {"sweep_trim_4e3f5b_pod.png", "sweep_delay_4e3f5b_pod.png"} < before.keys()
    model.unlink()
    monkeypatch.setattr("wobbly.Wobbly.identity", "code of another day")
    shutil.rmtree(folder / "figures")
    assert sorted(answered("plot", folder)["figures"]) == sorted(str(folder / "figures" / name) for name in before)
    assert figures_of(folder) == before


@pytest.mark.slow
def test_other_metrics_score_the_stored_episodes_anew_into_a_folder_of_their_own(finished, answered, monkeypatch):
    assert main(["study", str(finished), "--json"]) == 0
    assert main(["sweep", str(finished), "--parameter", "trim", "--points", "2"]) == 0
    monkeypatch.setattr("wobbly.Wobbly.run", lambda *_: pytest.fail("simulated"))
    own = answered("plot", finished)
    before = {path: path.read_bytes() for path in finished.rglob("*") if path.is_file()}
    other = answered("plot", finished, "--metric", "distance:max:20%", "--metric", "survival_time:max")
    assert {path: path.read_bytes() for path in before} == before, "study.db, figures and report stay as they were"
    folder = finished / "rescored" / "distance_max_20percent+survival_time_max"
    assert other["report"] == str(folder / "report.html")
    for path in before:
        if path.suffix == ".png":
            again = folder / "figures" / path.name
            assert str(again) in other["figures"]
            # What the scores tell of θ is the same whatever counts as a tie; only the answer may be another.
            assert path.stem == "profiles" or again.read_bytes() != before[path], "the tolerance matters here"
    assert other["settings"]["metrics"] == ["distance:max:20%", "survival_time:max"]
    assert [trial["theta"] for trial in other["trials"]] == [trial["theta"] for trial in own["trials"]]
    assert [trial["prpv"] for trial in other["trials"]] != [trial["prpv"] for trial in own["trials"]]


def test_a_metric_that_is_not_there_is_one_line_and_draws_nothing(finished, refused):
    told = refused("plot", finished, "--metric", "distance:max", "--metric", "speed:max")
    assert told == "proxytune plot: --metric speed: no such metric; known are: distance, survival_time\n"
    told = refused("plot", finished, "--metric", "distance")
    assert told.startswith("proxytune plot: metric 'distance': write NAME:max or NAME:min")
    assert not (finished / "rescored").exists()
