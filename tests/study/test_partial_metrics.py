"""Metrics that a study is not after may be missing in an episode."""

import pytest

from proxytune.api import read_study
from proxytune.api.study import run_study
from proxytune.cli.main import main
from proxytune.storage import Store
from proxytune.study import open_study

FAMILY = """
from wobbly import Wobbly, wobbly


class Partly(Wobbly):
    def run(self, episode):
        scores = super().run(episode)
        return {key: value for key, value in scores.items() if key == "distance" or episode.start or MISSING}


def make(domain, *, model):
    return Partly(**vars(wobbly(domain, model=model)))
"""


@pytest.fixture
def partly(make_study):
    """A study by distance alone, of which survival_time is missing from start 0, or at all."""

    def make(called, missing, engine):
        changes = {"metrics": '["distance:max"]', "engine": f'"{engine}"', "preflight": "true", "confirm": "1"}
        folder = make_study(called, family='"partly:make"', **changes)
        (folder / "partly.py").write_text(FAMILY.replace("MISSING", missing))
        return folder

    return make


@pytest.mark.slow
@pytest.mark.parametrize("engine", ["gp", "outcomes"])
@pytest.mark.parametrize("missing", ["False", "(episode.agent == 'agent1' and episode.start == 9)"])
def test_a_study_works_where_a_metric_beside_its_own_is_missing_here_and_there(partly, engine, missing):
    folder = partly(f"{engine}{len(missing)}", missing, engine)
    report = run_study(folder)
    assert {trial.failed_episodes for trial in report.result.trials} == {0}
    assert [trial.state for trial in report.result.trials] == ["finished"] * 7
    with Store.read(folder) as store:
        known = store.outcomes(open_study(folder).identity, report.theta).values()
    assert {"survival_time" in (one.metrics or {}) for one in known if one.episode.start == 0} == {False}
    assert read_study(folder).document()["best"] == report.document()["best"]


@pytest.mark.slow
def test_scored_by_a_metric_that_some_episodes_lack_these_count_as_failed(partly, answered):
    folder = partly("plotted", "False", "gp")
    run_study(folder)
    document = answered("plot", folder, "--metric", "survival_time:max")
    assert {trial["failed_episodes"] for trial in document["trials"]} == {6}, "every agent's from start 0"


@pytest.mark.slow
def test_scored_by_a_metric_that_no_episode_has_it_is_one_line(partly, capsys):
    folder = partly("never", "episode.start > 9", "outcomes")
    (folder / "partly.py").write_text(FAMILY.replace("episode.start or MISSING", "False"))
    run_study(folder)
    assert main(["plot", str(folder), "--metric", "survival_time:max"]) == 1
    line = capsys.readouterr().err
    assert "all trials failed, the first because agent 'agent0' failed from every start" in line
    assert line.count("\n") == 1


def test_a_target_is_measured_in_the_metrics_that_all_episodes_have(partly, tmp_path):
    folder = partly("measured", "False", "gp")
    (tmp_path / "model.toml").write_text("trim = 0.1\n")
    words = ["--model", str(tmp_path / "model.toml"), "--output", str(tmp_path / "t.csv")]
    assert main(["measure", str(folder), *words]) == 0
    assert (tmp_path / "t.csv").read_text().splitlines()[0] == "agent,episode,distance"
