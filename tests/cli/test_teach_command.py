"""`teach` prints table 1 and one JSON document; `study` with the objective "plv" looks for the best teacher."""

import json
import signal
import time

import numpy as np
import pytest
from processes import start
from taught import GRID, make_taught

from proxytune.cli.main import main


def test_teach_prints_one_document_with_the_promised_keys(make_study, capsys):
    folder = make_taught(make_study)
    assert main(["teach", str(folder), "--json"]) == 0
    document = json.loads(capsys.readouterr().out)
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
    assert (folder / "figures" / "teach.png").stat().st_size > 1000
    assert document["report"] == str(folder / "figures" / "teach.html")
    assert "Target samples saved (PLV" in (folder / "figures" / "teach.html").read_text()


def test_people_see_table_1_and_when_a_learner_counts_as_converged(make_study, capsys):
    folder = make_taught(make_study)
    assert main(["teach", str(folder)]) == 0
    said = capsys.readouterr().out
    for words in ("zero-shot", "PLV (proxy learning value)", "reduction", "none", "right", "converged: the mean score"):
        assert words in said


@pytest.mark.slow
def test_a_budget_too_small_to_converge_is_said_and_gives_no_plv(make_study, capsys):
    folder = make_taught(make_study, grid=[0, 3, 6])
    assert main(["teach", str(folder), "--json"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert document["convergence"]["settled"] is False
    assert document["proxies"]["right"]["plv"] is None
    assert main(["teach", str(folder)]) == 0
    assert "raise teaching.target_samples" in " ".join(capsys.readouterr().out.split())


@pytest.mark.slow
def test_a_study_of_learning_value_tells_its_best_proxy(make_study, capsys):
    folder = make_taught(make_study, objective='"plv"', parameters={"trim": "[-0.3, 0.3]"}, more="budget = 3")
    assert main(["study", str(folder), "--json"]) == 0
    document = json.loads(capsys.readouterr().out)
    plvs = [trial["plv"]["value"] for trial in document["trials"]]
    assert len(plvs) == 3
    assert document["best"]["plv"]["value"] == max(plvs)
    assert document["confirmed"]["best"] == "best single θ"
    assert document["confirmed"]["finalists"]["best single θ"]["theta"].keys() == {"trim"}
    assert document["narrowed_by_prpv"] is False
    assert document["searched"] == {"trim": [-0.3, 0.3]}
    assert (folder / "figures" / "plv.png").stat().st_size > 1000
    page = (folder / "report.html").read_text()
    assert document["report"] == str(folder / "report.html")
    assert "After 3 proxies tried, best single θ (trim = " in page
    assert "refresh" not in page


@pytest.mark.slow
def test_prpv_narrows_the_box_first_where_that_is_asked_for(make_study, capsys):
    more = "budget = 2\nnarrow = true"
    folder = make_taught(make_study, objective='"plv"', parameters={"trim": "[-0.3, 0.3]"}, more=more)
    assert main(["study", str(folder), "--json"]) == 0
    document = json.loads(capsys.readouterr().out)
    low, high = document["searched"]["trim"]
    assert document["narrowed_by_prpv"] is True
    assert -0.3 <= low < high <= 0.3
    assert all(low <= trial["theta"]["trim"] <= high for trial in document["trials"])
    assert (folder / "study.db").exists()


@pytest.mark.parametrize(
    ("edit", "status", "says"),
    [
        (("[0, 20,", "[20,"), 2, "teaching.target_samples: must begin with 0"),
        (("[teaching]", "[teachings]"), 2, "teachings: unknown key; did you mean 'teaching'?"),
        (
            ("schoolroom:Matrix", "schoolroom"),
            2,
            "teaching.learner: learner 'schoolroom' is unknown",
        ),
    ],
)
def test_bad_input_is_one_line(make_study, capsys, edit, status, says):
    folder = make_taught(make_study)
    path = folder / "study.toml"
    path.write_text(path.read_text().replace(*edit))
    assert main(["teach", str(folder)]) == status
    out, err = capsys.readouterr()
    assert out == ""
    assert says in err
    assert len(err.strip().splitlines()) == 1


def test_an_expert_that_cannot_drive_is_one_line_and_nothing_is_drawn(make_study, capsys):
    folder = make_taught(make_study, domain={"blocked": "0.9"})
    assert main(["teach", str(folder)]) == 2
    assert "the expert cannot drive here" in capsys.readouterr().err
    assert not (folder / "figures").exists()


def made(folder):
    """How many samples, weights and examinations are kept."""
    return len(list((folder / "teaching").glob("*.npz")))


def stopped_when(folder, count, number):
    """`teach` in a process of its own, sent a signal once so much is kept and it has added to that; its exit status."""
    count = max(count, made(folder) + 1)
    process = start("teach", folder, "--json")
    while made(folder) < count and process.poll() is None:
        time.sleep(0.002)
    process.send_signal(number)
    process.communicate(timeout=300)
    return process.returncode


@pytest.mark.slow
@pytest.mark.parametrize("jobs", ["1", "2"])
def test_a_run_stopped_at_any_moment_comes_to_the_same_document_as_one_that_was_not(make_study, capsys, jobs):
    expected = []
    for called in ("whole", "stopped"):
        folder = make_taught(make_study, called=called, jobs=jobs)
        if called == "stopped":
            # On a busy machine a signal comes late, so none is meant for the end.
            before = np.arange(1, made(folder.with_name("whole")) * 2 // 3)
            moments = np.sort(np.random.default_rng(int(jobs)).choice(before, 4, replace=False)).tolist()
            numbers = (signal.SIGKILL, signal.SIGINT, signal.SIGTERM, signal.SIGKILL)
            statuses = [stopped_when(folder, count, number) for count, number in zip(moments, numbers, strict=True)]
            assert statuses == [-signal.SIGKILL, 130, 143, -signal.SIGKILL]
        assert main(["teach", str(folder), "--json"]) == 0
        document = json.loads(capsys.readouterr().out)
        expected.append({key: document[key] for key in ("convergence", "without", "proxies")})
        assert not list((folder / "teaching").glob("*.npz.*"))
    assert expected[0] == expected[1]
