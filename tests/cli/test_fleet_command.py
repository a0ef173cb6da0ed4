"""`fleet` tells θ of each robot and p(θ) over them from what a bank knows; what it cannot use is refused in a line."""

import re
import shutil
from pathlib import Path

import numpy as np
import pytest
from one_line import complaint_of

import proxytune
from proxytune.cli.main import main
from proxytune.files import shipped
from proxytune.running import run_together
from proxytune.scores import write_scores
from proxytune.search import population
from proxytune.seeds import target_seed
from proxytune.study import open_bank, plan_episodes, read_study_settings, score_table
from tests.conftest import write_target

DELAY = 0.12


@pytest.fixture(scope="module", autouse=True)
def _few_draws():
    """Draw a tenth of what a user gets: tests/search counts how well it is told."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(population, "DRAWS", 400)
        patch.setattr(population, "BURN_IN", 100)
        yield


@pytest.fixture(scope="module")
def bank(make_studies):
    """A bank that has been run."""
    folder = make_studies("bank", **{"target": None, "preflight": "true", "budget": "24", "engine": None})
    assert main(["study", str(folder), "--json"]) == 0
    return folder


@pytest.fixture(scope="module")
def trims():
    """The trim of eight robots, whose delay is one and the same."""
    return (0.02 + 0.08 * np.random.default_rng(5).standard_normal(8)).tolist()


@pytest.fixture(scope="module")
def robots(trims, tmp_path_factory):
    """Their tables of scores."""
    home = tmp_path_factory.mktemp("robots")
    return [
        write_target(home / f"robot{row}.csv", {"trim": trim, "delay": DELAY}, 900 + 10 * row)
        for row, trim in enumerate(trims)
    ]


@pytest.fixture(scope="module")
def found(bank, robots):
    """What is told of them."""
    return proxytune.fleet(bank, robots)


def test_what_was_planted_is_told(found, trims):
    """Each robot's θ lies in its intervals, p(θ) holds mean and spread; the delay, which is one, differs by less."""
    told = found.robots()
    assert told["fits"].all()
    for row, trim in enumerate(trims):
        for name, truth in (("trim", trim), ("delay", DELAY)):
            one = told.loc[(f"robot{row}", name)]
            assert one["low"] <= truth <= one["high"]
    population = found.population()
    trim, delay = population.loc["trim"], population.loc["delay"]
    assert trim["varies"]
    assert trim["deviation_low"] < np.std(trims, ddof=1) < trim["deviation_high"]
    assert trim["mean_low"] < np.mean(trims) < trim["mean_high"]
    assert delay["mean_low"] < DELAY < delay["mean_high"]
    assert delay["deviation_middle"] < 0.5 * trim["deviation_middle"]
    assert trim["robots_low"] < min(trims)
    assert max(trims) < trim["robots_high"]


def test_the_command_says_the_same_and_drives_nothing(found, bank, robots, tmp_path, answered):
    """Its document is the report's, with figure and page; study.db stays what it is."""
    before = (bank / "study.db").read_bytes()
    document = answered("fleet", bank, *robots, "--output", tmp_path / "out")
    assert Path(document.pop("figure")).exists()
    page = Path(document.pop("report")).read_text()
    assert document == found.document()
    assert (bank / "study.db").read_bytes() == before
    low, high = document["population"]["next_robot"]["trim"]
    assert f"trim = [{low:.4g}, {high:.4g}]" in page
    assert set(document["robots"]) == {f"robot{row}" for row in range(8)}


def test_a_person_reads_the_lines_to_paste(bank, robots, capsys):
    """They are a table of [teaching.proxies]; with few robots a note says what cannot be told."""
    assert main(["fleet", str(bank), *map(str, robots[:3])]) == 0
    told = capsys.readouterr().out
    assert "[teaching.proxies.fleet]" in told
    assert re.search(r"^trim = \[-?[\d.]+, [\d.]+\]$", told, re.MULTILINE)
    assert "3 robots hardly tell a spread" in " ".join(told.split())


@pytest.mark.slow
def test_a_robot_that_no_theta_explains_is_left_out_by_name(found, bank, robots, tmp_path):
    """p(θ) is what it is without it; its own intervals are still told."""
    odd = write_target(tmp_path / "odd.csv", {"trim": 0.0, "delay": DELAY}, 990, shift=40.0)
    document = proxytune.fleet(bank, [*robots, odd]).document()
    assert document["left_out"] == ["odd"]
    assert document["robots"]["odd"]["given_fleet"] is None
    assert document["population"] == found.document()["population"]
    alone = proxytune.fleet(bank, [robots[0], odd])
    assert alone.document()["population"] is None
    assert "too few for p(θ)" in alone.sentence
    assert "<table" in alone._repr_html_()


@pytest.mark.slow
def test_the_table_of_a_bank_will_do(found, bank, robots, tmp_path):
    """Without study.db it says the same, noise included, to the digits that it has."""
    alone = Path(shutil.copytree(bank, tmp_path / "alone"))
    (alone / "study.db").unlink()
    told = proxytune.fleet(alone, robots)
    assert told.document()["cautions"] == []
    trim = [one.population().loc["trim", "deviation_middle"] for one in (told, found)]
    assert trim[0] == pytest.approx(trim[1], rel=0.1)


@pytest.mark.slow
def test_a_study_with_a_target_knows_trials_too_and_one_by_learning_value_tells_no_theta(make_study, robots):
    """What it has learnt from a bank counts, whatever its own target is."""
    folder = make_study(budget="12", initial="12", engine=None)
    proxytune.run_study(folder)
    told = proxytune.fleet(folder, robots[:2])
    assert len(told.result.robots[0].knowledge.trials) == 12
    assert told.result.robots[0].knowledge.goal.values[0] != told.result.robots[1].knowledge.goal.values[0]
    # A study by PLV is refused, and so is one table in place of a list.
    assert "'plv' is not searched by scores" in complaint_of(proxytune.fleet, make_study(objective='"plv"'), robots)
    assert "give a list of tables" in complaint_of(proxytune.fleet, make_study(), str(robots[0]))


@pytest.mark.slow
def test_what_a_robot_says_depends_on_no_other_and_names_alike_have_their_folders(found, bank, robots, tmp_path):
    """Calibration is shared, so the first of the tables is told as any other."""
    few = proxytune.fleet(bank, [robots[3], robots[0]]).document()["robots"]
    all_of_them = found.document()["robots"]
    for name in ("robot3", "robot0"):
        for key in ("theta_interval", "region_share", "p_value"):
            assert few[name][key] == all_of_them[name][key]
    paths = []
    for name in ("robot1", "robot2"):
        (tmp_path / name).mkdir()
        paths.append(shutil.copy(found.result.robots[int(name[-1])].path, tmp_path / name / "target.csv"))
    assert list(proxytune.fleet(bank, paths).document()["robots"]) == ["robot1/target", "robot2/target"]
    copies = [paths[0], shutil.copy(paths[0], tmp_path / "copy.csv")]
    assert "scores as target to the last digit" in str(proxytune.fleet(bank, copies).document()["cautions"])


BAD = {
    "one table": (lambda bank, robots, home: robots[:1], "a fleet takes at least 2 tables, got 1"),
    "one robot twice": (lambda bank, robots, home: [robots[0], robots[1], robots[0]], "is given twice"),
    "no such table": (lambda bank, robots, home: [robots[0], home / "none.csv"], "none.csv"),
    "other agents": (
        lambda bank, robots, home: [robots[0], _edited(robots[1], home, "agent", "driver")],
        "has no scores of agent",
    ),
    "another metric": (
        lambda bank, robots, home: [robots[0], _edited(robots[1], home, "survival_time", "score")],
        "survival_time",
    ),
    "no trials": (lambda bank, robots, home: _unrun(bank, robots), "run the study first"),
}


def _unrun(bank, robots):
    for name in ("study.db", "bank.json"):
        (bank / name).unlink()
    return robots


def _edited(path, home, before, after):
    edited = home / "edited.csv"
    edited.write_text(path.read_text().replace(before, after).replace(f"{after},episode", "agent,episode"))
    return edited


@pytest.mark.parametrize(("spoil", "words"), BAD.values(), ids=BAD)
def test_what_cannot_be_used_is_refused_in_one_line(spoil, words, bank, robots, tmp_path, refused):
    """The line names the file and what is wrong; the exit status is 2."""
    own = Path(shutil.copytree(bank, tmp_path / "bank"))
    told = refused("fleet", own, *spoil(own, robots, tmp_path))
    assert words in told
    assert told.startswith("proxytune fleet: ")


@pytest.mark.slow
def test_a_fleet_on_the_planar_plant_is_told_by_the_shipped_bank(tmp_path):
    """Ten robots whose trim and delay are drawn from normal distributions: p(θ) holds mean and spread of both."""
    home = shipped("studies") / "duckiebot_bank"
    study, rng = open_bank(read_study_settings(home)), np.random.default_rng(11)
    trim, delay = 0.05 * rng.standard_normal(10), 0.12 + 0.03 * rng.standard_normal(10)
    paths = []
    for row in range(10):
        theta = {"trim": trim[row], "delay": delay[row], "blur": 0.04, "camera_pitch": 19.0}
        planned = plan_episodes(study.settings, theta, target_seed(700 + row))
        paths.append(tmp_path / f"robot{row}.csv")
        write_scores(score_table(run_together(study.family, planned) or ()), paths[-1])
    told = proxytune.fleet(home, paths)
    assert told.document()["left_out"] == []
    population = told.population()
    for name, truth in (("trim", trim), ("delay", delay)):
        one = population.loc[name]
        assert one["varies"]
        assert one["mean_low"] < truth.mean() < one["mean_high"]
        assert one["deviation_low"] < truth.std(ddof=1) < one["deviation_high"]
        own = told.robots().xs(name, level="parameter")
        assert ((own["low"] <= truth) & (truth <= own["high"])).sum() >= 9
