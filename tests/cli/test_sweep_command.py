import json

import pytest
from one_line import complaint_of

from proxytune.api import read_theta
from proxytune.cli.main import main


def test_a_sweep_writes_its_curve_as_figure_csv_and_json_and_goes_on_where_it_was(make_study, tmp_path, answered):
    folder, output = make_study(), tmp_path / "curves"
    arguments = ("sweep", folder, "--parameter", "trim", "--points", "4", "--at", "delay=0.12,trim=0.1")
    document = answered(*arguments, "--output", output)
    assert document["episodes"] == {"run": 72}
    endings = ("csv", "html", "json", "png")
    assert {path.name for path in output.iterdir()} == {f"sweep_trim_4e3f5b.{ending}" for ending in endings}
    (curve,) = document["curves"]
    assert json.loads((output / "sweep_trim_4e3f5b.json").read_text()) == curve
    assert [point["prpv"] for point in curve["points"]][2] == 0
    again = answered(*arguments)
    assert again["episodes"] == {"run": 0}
    assert again["curves"] == document["curves"]
    assert (folder / "figures" / "sweep_trim_4e3f5b.png").exists()


def test_all_sweeps_every_parameter_of_the_study_and_draws_them_together(make_study, capsys):
    folder = make_study()
    assert main(["sweep", str(folder), "--parameter", "all", "--points", "2"]) == 0
    names = sorted(path.stem for path in (folder / "figures").glob("*.png"))
    assert names == ["sweep_all", "sweep_bars", "sweep_delay", "sweep_trim"]
    assert [path.name for path in (folder / "figures").glob("*.html")] == ["sweep_all.html"]
    out = capsys.readouterr().out
    assert "trim: PRPV: lowest" in out
    assert "give --target-model" in out


@pytest.mark.slow
def test_a_target_model_adds_pod_and_keeps_its_own_files(make_study, tmp_path, answered):
    folder, model = make_study(family='"echo:echo"'), tmp_path / "truth.toml"
    model.write_text("trim = 0.1\n")
    arguments = ["sweep", str(folder), "--parameter", "trim", "--points", "2", "--at", "trim=0.1"]
    document = answered(*arguments, "--target-model", model)
    assert document["episodes"] == {"run": 3 * 21}
    assert document["curves"][0]["points"][1]["pod"]["pod_pose"]["value"] == 0
    assert main(arguments) == 0
    assert {path.name for path in (folder / "figures").glob("*.png")} == {"sweep_trim.png", "sweep_trim_pod.png"}


@pytest.mark.slow
def test_trials_and_sweeps_share_episodes_and_a_finished_study_is_swept_at_its_best_theta(finished, answered):
    at = ",".join(f"{name}={value!r}" for name, value in answered("study", finished)["trials"][0]["theta"].items())
    assert answered("sweep", finished, "--parameter", "trim", "--points", "2", "--at", at)["episodes"]["run"] == 2 * 18
    best = answered("study", finished)["best"]["theta"]
    document = answered(*["sweep", str(finished), "--parameter", "trim", "--points", "2"])
    assert document["at"] == {"chosen": "best", "theta": best}
    assert document["curves"][0]["base"] == best


def test_nominal_holds_the_robots_own_values_in_a_finished_study_and_one_not_yet_run(finished, answered, make_study):
    document = answered("sweep", finished, "--parameter", "trim", "--points", "2", "--at", "nominal")
    assert document["at"] == {"chosen": "nominal", "theta": {}}
    assert document["curves"][0]["base"] == {}
    at = answered("sweep", make_study("other"), "--parameter", "trim", "--points", "2")["at"]
    assert at == {"chosen": "nominal", "theta": {}}


@pytest.mark.slow
def test_a_study_that_was_changed_since_has_no_best_theta_but_nominal_values(finished, make_study, refused, answered):
    make_study(seed="2")
    arguments = ("sweep", finished, "--parameter", "trim", "--points", "2")
    assert "changed since the first trial: seed (was 1)" in (told := refused(*arguments))
    assert told.endswith("or hold other values: --at nominal\n")
    assert answered(*arguments, "--at", "nominal")["curves"]


def test_a_base_is_read_from_pairs_or_from_a_model(tmp_path):
    assert read_theta(None) == {}
    assert read_theta("trim=0.1, delay=2e-1") == {"trim": 0.1, "delay": 0.2}
    (tmp_path / "model.toml").write_text('format = 1\nrobot = "duckiebot"\n[effects.trim]\ntrim = 0.05\n')
    assert read_theta(str(tmp_path / "model.toml")) == {"trim": 0.05}


@pytest.mark.parametrize(
    ("text", "expected"),
    [("trim", "write NAME="), ("trim=much", "write NAME="), ("trim=0.1,trim=0.2", "twice"), ("no.toml", "no such")],
)
def test_a_base_that_is_neither_is_refused(text, expected):
    assert expected in complaint_of(read_theta, text)


BAD = {
    "an unknown parameter": (["--parameter", "trimm"], "no parameter 'trimm' in this study's domain family"),
    "a value out of bounds": (["--parameter", "trim", "--at", "delay=7"], "'delay': must lie within [0, 0.3], got 7"),
    "a family that cannot replay": (
        ["--parameter", "trim", "--target-model", __file__],
        "wobbly:wobbly has no `drive` and `replay`",
    ),
    "the best of a study that has not run": (
        ["--parameter", "trim", "--at", "best"],
        "has no finished trial; run it first (python -m proxytune study",
    ),
    "one point": (["--parameter", "trim", "--points", "1"], "--points must be between 2 and"),
}


@pytest.mark.parametrize(("options", "expected"), BAD.values(), ids=BAD)
def test_bad_input_is_one_line_and_exit_2(make_study, refused, options, expected):
    assert expected in refused("sweep", make_study(), *options)
