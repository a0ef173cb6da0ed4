"""Usefulness from DataFrames is what the command says of the same tables, and complaints name side, row and column."""

import json
import re

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings, strategies as st
from one_line import complaint_of

from proxytune.api.scores import score
from proxytune.cli.main import main
from proxytune.report import score_document
from proxytune.scores import Metric, read_scores

METRICS = ["distance:max", "time:min:5%"]


def table(seed, agents="ABCDE", episodes=4):
    """Scores of a few agents that differ by more than their episodes do."""
    random = np.random.default_rng(seed)
    labels = [(agent, episode) for agent in agents for episode in range(episodes)]
    frame = pd.DataFrame(labels, columns=["agent", "episode"])
    strength = frame.agent.map({agent: random.normal(5.0, 1.0) for agent in agents})
    return frame.assign(
        distance=strength + random.normal(0.0, 0.5, len(frame)), time=20.0 - strength + random.random(len(frame))
    )


def documented(assessment):
    return json.loads(json.dumps(score_document(assessment)))


@pytest.fixture
def by_command(tmp_path, capsys):
    """The document of the command for two DataFrames, and the files that it read."""

    def run(proxy, target, *words):
        paths = [tmp_path / "sim.csv", tmp_path / "real.csv"]
        for frame, path in zip((proxy, target), paths, strict=True):
            frame.to_csv(path, index=False)
        metrics = [word for metric in METRICS for word in ("--metric", metric)]
        assert main(["score", "--proxy", str(paths[0]), "--target", str(paths[1]), *metrics, *words, "--json"]) == 0
        return json.loads(capsys.readouterr().out), paths

    return run


def test_the_numbers_of_two_dataframes_are_those_of_the_command_also_with_weights_and_a_seed(by_command):
    proxy, target = table(1), table(2)
    printed, paths = by_command(proxy, target)
    found = documented(score(proxy=proxy, target=target, metrics=METRICS))
    assert found == {key: printed[key] for key in found}
    assert documented(score(proxy=str(paths[0]), target=paths[1], metrics=METRICS)) == found
    printed, _ = by_command(proxy, target, "--beta", "distance:2", "--beta", "time:0.5", "--seed", "3")
    found = documented(score(proxy=proxy, target=target, metrics=METRICS, beta={"distance": 2, "time": 0.5}, seed=3))
    assert found == {key: printed[key] for key in found}
    assert found != documented(score(proxy=proxy, target=target, metrics=METRICS))


@pytest.mark.slow
def test_several_proxies_by_name_are_those_of_the_command(by_command, tmp_path, answered):
    proxy, target = table(1), table(2)
    _, paths = by_command(proxy, target)
    table(3).to_csv(tmp_path / "other.csv", index=False)
    words = [word for metric in METRICS for word in ("--metric", metric)]
    words += ["--proxy", str(paths[0]), "--proxy", str(tmp_path / "other.csv"), "--target", str(paths[1])]
    printed = answered("score", *words)
    found = score(proxy={"sim": proxy, "other": table(3)}, target=target, metrics=METRICS)
    document = json.loads(json.dumps(found.document))
    assert document == {key: printed[key] for key in document}
    assert document["together"]["saves"].keys() == document["proxies"][0]["saves"].keys()
    assert found["other"].prpv.value == {one["proxy"]: one["prpv"] for one in document["proxies"]}["other"]
    assert repr(found).startswith("Ranking: ")
    assert "together: " in found._repr_html_()
    assert set(found.to_frame().index.get_level_values("proxy")) == {"sim", "other"}
    assert "two tables or more" in complaint_of(score, proxy={"sim": proxy}, target=target, metrics=METRICS)


@settings(max_examples=20)
@given(values=st.lists(st.floats(-1e6, 1e6), min_size=4, max_size=8, unique=True))
def test_no_digit_of_a_score_is_lost_on_the_way(values):
    frame = pd.DataFrame({"agent": [f"a{place}" for place in range(len(values))], "distance": values})
    assert score(proxy=frame, target=frame, metrics="distance:max").inputs.proxy.means[:, 0].tolist() == values


def test_one_metric_may_be_text_and_agents_the_index(tmp_path):
    proxy, target = table(1), table(2)
    metric = Metric("distance", tolerance=0.1)
    one = score(proxy=proxy, target=target, metrics="distance:max:0.1")
    assert documented(one) == documented(score(proxy=proxy, target=target, metrics=metric))
    assert documented(one) == documented(score(proxy=proxy, target=target, metrics=[metric]))
    plain = documented(score(proxy=proxy, target=target, metrics=METRICS))
    indexed = proxy.set_index(["agent", "episode"])
    assert documented(score(proxy=indexed, target=target.set_index("agent"), metrics=METRICS)) == plain
    assert list(indexed.index.names) == ["agent", "episode"], "the user's table stays as it is"
    (left_out,) = score(proxy=proxy, target=table(2, "ABCDEF"), metrics=METRICS, common=True).left_out
    assert left_out.endswith("F of target")


def test_a_table_that_was_read_before_may_be_either_side(by_command):
    proxy, target = table(1), table(2)
    _, paths = by_command(proxy, target)
    read = read_scores(str(paths[0]), ["time", "distance"])
    mixed = score(proxy=read, target=target, metrics=METRICS)
    assert documented(mixed) == documented(score(proxy=proxy, target=target, metrics=METRICS))
    assert complaint_of(score, proxy=read, target=target, metrics="speed:max").startswith("proxy: no metric 'speed'")


def spoilt(**changes):
    frame = table(1).astype({"distance": object})
    for column, (row, value) in changes.items():
        frame.loc[row, column] = value
    return frame


TWO_DOMAINS = pd.concat([table(1).assign(domain="sim"), table(2).assign(domain="real")])
WRONG = {
    "a missing column": (table(1).drop(columns="distance"), "proxy: no column 'distance'"),
    "no agents": (table(1).drop(columns="agent"), "proxy: no column 'agent'; columns are episode, distance, time"),
    "a missing agent": (table(1, "ABCD"), "the proxy lacks scores of E, which the target has; add or remove them"),
    "a hole": (spoilt(distance=(3, np.nan)), r"proxy: row 3, column 'distance': must be a finite number, got ''"),
    "a word": (spoilt(distance=(0, "far")), "proxy: row 0, column 'distance': must be a finite number, got 'far'"),
    "an episode twice": (spoilt(episode=(1, 0)), "proxy: row 1: agent 'A' has episode '0' twice; number the episodes"),
    "several domains": (TWO_DOMAINS, r"proxy: has several domains; select one, as in scores\[scores.domain == 'sim'\]"),
    "no table": ({"agent"}, "proxy: must be a DataFrame, a CSV file or a ScoreTable, got set"),
    "no rows": (table(1).head(0), "proxy: has no rows; add one per agent and episode"),
    "no file": ("nowhere.csv", "nowhere.csv: no such file; check the path"),
}


@pytest.mark.parametrize("name", WRONG)
def test_what_cannot_be_used_is_one_line_with_the_side(name):
    proxy, words = WRONG[name]
    told = complaint_of(score, proxy=proxy, target=table(2), metrics=METRICS)
    assert re.search(words, told)
    assert "tmp" not in told
    assert ".csv" not in told or name == "no file"


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"metrics": "distance"}, "metric 'distance': write NAME:max or NAME:min"),
        ({"metrics": []}, "no metric is given; name at least one"),
        ({"seed": -1}, "seed must be at least 0, got -1"),
        ({"beta": {"distance": 1.0}}, "time"),
    ],
)
def test_wrong_arguments_are_one_line(changes, words):
    assert words in complaint_of(score, **{"proxy": table(1), "target": table(2), "metrics": METRICS, **changes})


def test_one_table_of_both_sides_gives_a_decision_figures_a_page_and_frames(tmp_path):
    columns = {"policy": ["act", "pi0"], "Sim success (%)": [62, 90], "Real success (%)": [48, 84]}
    found = score(pd.DataFrame(columns), rollouts=25)
    assert found.decision.winner == "pi0"
    assert set(found.figures()) == {"scatter", "flipped_pairs", "decision"}
    assert found.page(tmp_path / "page.html") == (tmp_path / "page.html").read_text(encoding="utf-8")
    assert "Deploy pi0" in found.page()
    assert found.to_frame().loc["PRPV", "value"] == 0
    assert found.decision.to_frame().loc["act", "score"] == pytest.approx(0.48)
    assert repr(found).startswith("ScoreReport: As a proxy of real, sim has a PRPV")
    assert "\n" not in repr(found)
    assert found.document == score_document(found)


def test_one_column_is_not_compared_with_itself_and_sides_are_given_whole():
    table = pd.DataFrame({"agent": ["a", "b"], "success": [0.1, 0.2]})
    assert "would be both proxy and target" in complaint_of(score, table, metrics="success:max")
    for sides in ({}, {"proxy": table}):
        assert "or one table of both sides" in complaint_of(score, **sides, metrics="success:max")
    assert "no metric is given" in complaint_of(score, proxy=table, target=table)


def test_the_target_is_named_where_it_is_the_target_that_lacks_something():
    told = complaint_of(score, proxy=table(1), target=table(2).drop(columns="time"), metrics=METRICS)
    assert re.match("target: no column 'time'; (did you mean|known are)", told)
