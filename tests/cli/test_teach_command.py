"""`teach` prints table 1 and one JSON document; `study` with the objective "plv" looks for the best teacher."""

import re

import pytest
from taught import GRID, make_taught

from proxytune.cli.main import main


@pytest.mark.slow
def test_teach_prints_one_document_with_the_promised_keys_and_people_see_table_1(make_study, capsys, answered):
    folder = make_taught(make_study)
    document = answered("teach", folder)
    assert set(document["proxies"]) == {"right", "wrong", "wide"}
    right = document["proxies"]["right"]
    assert {"theta", "prpv", "zero_shot", "plv", "needed", "factor", "reduction", "scores"} <= set(right)
    assert right["target_samples"] == document["without"]["target_samples"] == GRID
    assert document["without"]["scores"][0][0] is None
    assert right["plv"]["value"] == pytest.approx(right["without"]["value"] - right["needed"]["value"], abs=5.0)
    assert right["zero_shot_interval"][0] <= right["zero_shot"] <= right["zero_shot_interval"][1]
    assert right["plv_cost"]["value"] == right["plv"]["value"]
    taught = document["settings"]["teaching"]
    assert taught["costs"] == {"off_policy": 1.0, "on_policy": 1.0, "label": 0.0}
    assert (taught["rehearsal"], taught["proxy_lessons"], taught["target_lessons"]) == (0.0, "expert", "expert")
    for proxy in document["proxies"].values():
        assert isinstance(proxy["prpv"], float | int)
        assert proxy["prpv_interval"][0] <= proxy["prpv"] <= proxy["prpv_interval"][1]
    for figure in ("zero_shot", "prpv"):
        tau = document["kendall_tau"][figure]
        assert -1.0 <= tau["interval"][0] <= tau["value"] <= tau["interval"][1] <= 1.0
    assert (folder / "figures" / "teach.png").exists()
    assert document["report"] == str(folder / "figures" / "teach.html")
    assert "Target samples saved (PLV" in (folder / "figures" / "teach.html").read_text()
    assert main(["teach", str(folder)]) == 0
    said = capsys.readouterr().out
    for words in ("zero-shot", "PLV (proxy learning value)", "reduction", "none", "right", "converged: the mean score"):
        assert words in said


@pytest.mark.slow
def test_a_study_of_learning_value_tells_its_best_proxy(make_study, answered):
    folder = make_taught(make_study, objective='"plv"', parameters={"trim": "[-0.3, 0.3]"}, more="budget = 3")
    document = answered("study", folder)
    plvs = [trial["plv"]["value"] for trial in document["trials"]]
    assert len(plvs) == 3
    assert document["best_trial"]["plv"]["value"] == max(plvs)
    finalist = document["confirmed"]["finalists"]["best single θ"]
    assert document["best"] == {"index": None, "name": "best single θ", **finalist}
    assert document["confirmed"]["best"] == "best single θ"
    assert document["confirmed"]["finalists"]["best single θ"]["theta"].keys() == {"trim"}
    assert document["narrowed_by_prpv"] is False
    assert document["searched"] == {"trim": [-0.3, 0.3]}
    assert (folder / "figures" / "plv.png").exists()
    page = (folder / "report.html").read_text()
    assert document["report"] == str(folder / "report.html")
    assert "After 3 proxies tried, best single θ (trim = " in page
    assert "refresh" not in page


@pytest.mark.slow
def test_prpv_narrows_the_box_first_where_that_is_asked_for_and_has_no_best_theta(make_study, answered, refused):
    more = "budget = 2\nnarrow = true"
    folder = make_taught(make_study, objective='"plv"', parameters={"trim": "[-0.3, 0.3]"}, more=more)
    document = answered("study", folder)
    low, high = document["searched"]["trim"]
    assert document["narrowed_by_prpv"] is True
    assert -0.3 <= low < high <= 0.3
    assert all(low <= trial["theta"]["trim"] <= high for trial in document["trials"])
    page = (folder / "report.html").read_text()
    for words in (("export", folder, "--to", "skopt", "--output", folder / "trials.pkl"), ("plot", folder)):
        assert "tells its best teacher in report.html and no best θ" in refused(*words)
    answered("sweep", folder, "--parameter", "trim", "--points", "2", "--at", "nominal")
    assert "best" not in answered("plot", folder)
    assert (folder / "report.html").read_text() == page


@pytest.mark.parametrize(
    ("before", "after", "says"),
    [
        ("[teaching]", "[teachings]", "teachings: unknown key; did you mean 'teaching'?"),
        ("schoolroom:Matrix", "schoolroom", "teaching.learner: learner 'schoolroom' is unknown"),
        ("schoolroom:Matrix", "schoolroom:Nothing", "teaching.learner: learner 'schoolroom:Nothing': schoolroom has"),
        ("schoolroom:Matrix", "wobbly:Wobbly", "teaching.learner: learner 'wobbly:Wobbly' "),
        ("schoolroom:schoolroom", "wobbly:wobbly", "family: wobbly:wobbly cannot teach: it lacks best_score"),
        ("trim = -0.3\n", "trim = -0.4\n", "teaching.proxies.wrong.trim: must lie within [-0.3, 0.3], got -0.4"),
        ("trim = [0.0, 0.3]", "trim = [0.0, 0.5]", "teaching.proxies.wide.trim: must lie within [-0.3, 0.3], got 0 to"),
        ("trim = -0.3\n", "tilt = 1.0\n", "teaching.proxies.wrong.tilt: unknown parameter; known are:"),
    ],
)
def test_bad_input_is_one_line_and_nothing_is_written(make_study, refused, before, after, says):
    folder = make_taught(make_study)
    path, there = folder / "study.toml", sorted(folder.rglob("*"))
    assert before in path.read_text()
    path.write_text(path.read_text().replace(before, after))
    assert refused("teach", folder).startswith(f"proxytune teach: {path}: {says}")
    assert sorted(folder.rglob("*")) == there


def test_an_expert_that_cannot_drive_is_one_line_and_nothing_is_drawn(make_study, refused):
    folder = make_taught(make_study, domain={"blocked": "0.9"})
    assert "the expert cannot drive here" in refused("teach", folder)
    assert not (folder / "figures").exists()


@pytest.mark.slow
def test_what_hangs_is_ended_in_one_line_and_the_corrected_command_goes_on(make_study, refused, answered):
    small = {"grid": [0, 20, 40], "starts": "2", "jobs": "2", "family": '"stuck:stuck"', "episode_timeout_s": "1.0"}
    stuck = make_taught(make_study, called="stuck", domain={"faults": '["lesson:1:hangs"]'}, **small)
    told = refused("teach", stuck, status=1)
    assert re.match(r"proxytune teach: .*: the expert's lesson in the (proxy|target) at .*start 1 took longer", told)
    assert told.endswith("or raise episode_timeout_s, and run again to continue\n")
    whole = make_taught(make_study, called="whole", **small)
    corrected = make_taught(make_study, called="stuck", **small)
    assert answered("teach", corrected)["proxies"] == answered("teach", whole)["proxies"]
