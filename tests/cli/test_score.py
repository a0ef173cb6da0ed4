"""`score` reads tables as people keep them and prints every measure, for people and as JSON."""

import argparse
import json
import re
from pathlib import Path

import pandas as pd
import pytest
from one_line import complaint_of
from readable import on_terminal

from proxytune.cli import score
from proxytune.cli.commands import add_options

SIM = "agent,episode,distance,time\n" + "".join(
    f"{agent},{episode},{base + 0.1 * ((episode * base) % 3)},{10 - base}\n"
    for base, agent in enumerate("ABCD")
    for episode in (1, 2, 3)
)
REAL = SIM.replace("C,", "c,").replace("D,", "C,").replace("c,", "D,")
PROMISED = {"prpv", "prpv_normalised", "ppv", "srcc", "mmrv", "kendall_tau", "prpv_interval", "noise_floor", "chance"}
PROMISED |= {"noise_floor_interval", "noise_floor_kind", "at_noise_floor", "chance_deviation", "p_value"}


@pytest.fixture
def tables(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("sim.csv").write_text(SIM)
    Path("real.csv").write_text(REAL)
    both = [f"{name},{line}" for name, text in (("sim", SIM), ("real", REAL)) for line in text.splitlines()[1:]]
    Path("both.csv").write_text("\n".join(["domain,agent,episode,distance,time", *both]) + "\n")


def run(*words):
    parser = argparse.ArgumentParser()
    add_options(parser, "score")
    return score.run(parser.parse_args(list(words)))


def document(*words):
    return json.loads(json.dumps(run(*words).document, allow_nan=False))


def shown(*words):
    return on_terminal(run(*words).text)


METRIC = ("--metric", "distance:max", "--metric", "time:min")
SIDES = ("--proxy", "sim.csv", "--target", "real.csv")


def test_one_proxy_has_the_promised_keys_at_the_top_level_and_domains_of_one_file_can_be_either_side(tables):
    found = document(*SIDES, *METRIC)
    assert found.keys() >= PROMISED
    assert (found["proxy"], found["target"], found["prpv"]) == ("sim", "real", 2)
    assert found["prpv_normalised"] == pytest.approx(2 / 12)
    assert found["prpv_interval"][0] <= 2 <= found["prpv_interval"][1]
    assert found["pairs"] == [{"better": "C", "worse": "D", "flip": "reversed"}]
    assert found["srcc"].keys() == found["mmrv"].keys() == found["kendall_tau"].keys() == {"distance", "time"}
    assert document("--proxy", "both.csv:sim", "--target", "both.csv:real", *METRIC) == found
    assert document("--proxy", "both.csv", "--target", "both.csv:real", *METRIC) == found


def test_several_proxies_are_ranked_with_their_differences_and_told_apart_by_their_paths(tables):
    Path("worse.csv").write_text(SIM.replace("A,", "x,").replace("D,", "A,").replace("x,", "D,"))
    found = document("--proxy", "worse.csv", *SIDES, *METRIC)
    assert [(one["rank"], one["proxy"]) for one in found["proxies"]] == [(1, "sim"), (2, "worse")]
    assert all(one.keys() >= PROMISED for one in found["proxies"])
    difference = found["differences"][0]
    assert (difference["better"], difference["worse"]) == ("sim", "worse")
    assert difference["difference"] == found["proxies"][1]["prpv"] - found["proxies"][0]["prpv"]
    assert difference["beyond_noise"] is difference["interval"] is None, "of three starts"
    assert "fewer than four starts" in found["notes"][0]
    assert "note: no intervals of the differences: fewer than four" in shown("--proxy", "worse.csv", *SIDES, *METRIC)
    Path("other").mkdir()
    Path("other/sim.csv").write_text(SIM)
    found = document("--proxy", "sim.csv", "--proxy", "other/sim.csv", "--target", "real.csv", *METRIC)
    assert {one["proxy"] for one in found["proxies"]} == {"sim", str(Path("other/sim.csv"))}
    Path("run:1.csv").write_text(SIM)
    assert document("--proxy", "run:1.csv", "--target", "real.csv", *METRIC)["proxy"] == "run:1"


def test_the_table_shows_each_measure_its_interval_and_notes_and_calls_no_rate_a_rollout(tables):
    text = shown(*SIDES, *METRIC)
    for part in (
        "PRPV",
        "halves",
        "upper bound of the noise floor",
        "chance",
        "PPV",
        "SRCC distance",
        "Kendall τ time",
        "MMRV time",
        "1 reversed",
    ):
        assert part in text
    assert "leave out that the same start may turn out otherwise" in " ".join(text.split())
    assert "sim as a proxy of real: 4 agents, 3 proxy episodes and 3 target episodes each" in text
    Path("both.csv").write_text("Policy,Sim success (%),Real success (%),Real n\nA,48,40,20\nB,72,65,20\nC,81,45,20\n")
    text = " ".join(shown("both.csv").split())
    assert "or a mean of an unknown number, which says nothing about noise" in text
    assert "1 simulated rollouts" not in text


def test_halves_are_called_halves_repeats_of_starts_a_noise_floor_and_a_constant_metric_null(tables):
    base = ("--proxy", "sim.csv", "--target")
    halves = document(*base, "real.csv", *METRIC)
    assert (halves["noise_floor_kind"], halves["at_noise_floor"]) == ("halves", None)
    rows = [line.split(",", 2) for line in REAL.splitlines()]
    again = [f"{agent},{episode}/{repeat},{rest}" for agent, episode, rest in rows[1:] for repeat in (0, 1)]
    Path("twice.csv").write_text("\n".join([",".join(rows[0]), *again]) + "\n")
    found = document(*base, "twice.csv", *METRIC)
    assert (found["noise_floor_kind"], found["noise_floor"]) == ("same starts", 0.0)
    assert found["at_noise_floor"] is False
    assert found["prpv_interval"] == halves["prpv_interval"]
    text = shown(*base, "twice.csv", *METRIC)
    assert "target against itself from the same" in text
    assert "halves" not in text
    head, *rest = SIM.splitlines()
    moved = [
        ",".join([agent, f"other{episode}", scores]) for agent, episode, scores in (row.split(",", 2) for row in rest)
    ]
    Path("moved.csv").write_text("\n".join([head, *moved]) + "\n")
    text = shown("--proxy", "moved.csv", *base, "twice.csv", *METRIC)
    assert "noise floor (sim) 0" in text
    assert "halves (moved)" in text
    loose = document(*base, "twice.csv", *METRIC, "--unpaired")
    assert (loose["noise_floor_kind"], loose["at_noise_floor"]) == ("halves", None)
    for file in ("flat.csv", "again.csv"):
        Path(file).write_text("agent,distance\nA,1\nB,1\nC,1\n")
    found = document("--proxy", "again.csv", "--target", "flat.csv", "--metric", "distance:max")
    assert found["srcc"] == found["kendall_tau"] == {"distance": None}
    assert found["ppv"] is None
    assert len(found["notes"]) == len(set(found["notes"])) == 8


def test_weights_unpaired_episodes_and_the_seed_are_obeyed(tables):
    base = (*SIDES, *METRIC)
    assert document(*base, "--beta", "distance:2", "--beta", "time:0")["beta"] == {"distance": 2.0, "time": 0.0}
    assert document(*base, "--unpaired")["episodes"]["paired"] is False
    assert document(*base)["episodes"] == {"proxy": [3, 3], "target": [3, 3], "paired": True, "resamples": 1000}
    assert document(*base, "--seed", "1") == document(*base, "--seed", "1")


def test_a_file_that_is_named_as_both_sides_is_a_perfect_proxy_and_told(tables):
    found = document("--proxy", "real.csv", "--target", "real.csv", *METRIC)
    assert (found["prpv"], found["ppv"], found["srcc"]["distance"]) == (0, 0.0, 1.0)
    assert found["cautions"][0].startswith("real.csv is given as the proxy and as the target")


@pytest.mark.slow
def test_figures_are_drawn_where_asked(tables):
    found = document(*SIDES, *METRIC, "--output", "out")
    assert found["report"] == "out/report.html"
    assert "As a proxy of real, sim has a PRPV" in Path("out/report.html").read_text()
    assert [Path(path).name for path in found["figures"]] == ["scatter.png", "flipped_pairs.png", "decision.png"]
    Path("b a.csv").write_text(SIM)
    found = document("--proxy", "sim.csv", "--proxy", "b a.csv", "--target", "real.csv", *METRIC, "--output", "many")
    assert sorted(path.name for path in Path("many").iterdir()) == [
        "decision_b_a.png",
        "decision_sim.png",
        "flipped_pairs_b_a.png",
        "flipped_pairs_sim.png",
        "report.html",
        "scatter_b_a.png",
        "scatter_sim.png",
    ]
    assert all(Path(path).exists() for path in found["figures"])


@pytest.mark.parametrize(
    ("words", "complaint"),
    [
        (("--proxy", "none.csv", "--target", "real.csv", *METRIC), "none.csv: no such file"),
        (("real.csv", *METRIC), "'distance' would be both proxy and target"),
        (("--proxy", "sim.csv", *METRIC), "--target is missing"),
        ((), "--proxy is missing"),
        (("sim.csv", "--proxy", "sim.csv", *METRIC), "give one table of both sides, or --proxy and --target"),
        (SIDES, "--metric is missing"),
        ((*SIDES, *METRIC, "--regret", "-1"), "must be above 0"),
        ((*SIDES, *METRIC, "--rollouts", "0"), "rollouts must be between"),
        ((*SIDES, *METRIC, "--decide-on", "distanse"), "did you mean 'distance'"),
        ((*SIDES, *METRIC, "--sequential"), "goes beyond 0 and 1"),
        (("--proxy", "both.csv:sm", "--target", "real.csv", *METRIC), "no domain 'sm'; did you mean 'sim'"),
        (("--proxy", "sim.csv", "--target", "both.csv", *METRIC), "choose one, as in both.csv:sim"),
        (
            ("--proxy", "sim.csv", "--target", "both.csv:real", "--target", "real.csv", *METRIC),
            "several files make one table; give all of them one domain, or none",
        ),
        (("--proxy", "sim.csv", *SIDES, *METRIC), "given twice"),
        ((*SIDES, "--metric", "distanc:max"), "did you mean 'distance'"),
        ((*SIDES, "--metric", "distance"), "write NAME:max"),
        ((*SIDES, *METRIC, "--resamples", "3"), "resamples must be between"),
        ((*SIDES, *METRIC, "--beta", "distance"), "write NAME:WEIGHT"),
        ((*SIDES, *METRIC, "--beta", "distance:1"), "no weight is given for time"),
    ],
)
def test_bad_input_gives_one_line_that_says_what_to_change(tables, words, complaint):
    assert complaint in complaint_of(run, *words)


@pytest.fixture
def own(tables):
    """A target in two files, with semicolons, decimal commas, names of its own and an agent of its own."""
    rows = [line.replace(",", ";").replace(".", ",") for line in REAL.splitlines()[1:]]
    head = "policy;trial;dist_m;time"
    Path("monday.csv").write_text("\n".join([head, *rows[:6]]) + "\n")
    Path("tuesday.csv").write_text("\n".join([head, *rows[6:]]) + "\n")
    Path("people.csv").write_text("policy;trial;dist_m;time\nhuman;1;9;1\n")


COLUMNS = ("--columns", "agent=policy,episode=trial,distance=dist_m")
OWN = ("--proxy", "sim.csv", "--target", "monday.csv", "--target", "tuesday.csv")


def test_a_target_as_people_keep_it_gives_the_figures_of_a_tidy_one_and_agents_of_one_side_are_named(own):
    found = document(*OWN, *COLUMNS, *METRIC)
    assert found.pop("target") == "monday, tuesday"
    tidy = document(*SIDES, *METRIC)
    assert tidy.pop("target") == "real"
    assert found == tidy
    assert found["left_out"] == []
    words = (*SIDES, *METRIC, "--table", "real.csv")
    assert "real.csv: is read by this command, and would be lost" in complaint_of(run, *words)
    words = (*OWN, "--target", "people.csv", *COLUMNS, *METRIC)
    assert re.search(r"the proxy lacks scores of human, .* \(score --common\)", complaint_of(run, *words))
    assert document(*words, "--common")["left_out"] == ["left out, since not all sides have them: human of the target"]
    assert document(*words, "--common")["prpv"] == document(*OWN, *COLUMNS, *METRIC)["prpv"]
    assert "note: left out, since not all sides have them: human of the target" in shown(*words, "--common")


@pytest.mark.parametrize(
    ("columns", "complaint"),
    [
        ("agent=polcy", "--columns agent=polcy: no table has a column 'polcy'; did you mean 'policy'"),
        ("agent", "--columns agent: write NAME=COLUMN,..., as in agent=policy"),
        ("agent=", "write NAME=COLUMN"),
    ],
)
def test_a_column_map_that_cannot_be_is_one_line(own, columns, complaint):
    assert complaint in complaint_of(run, *OWN, "--columns", columns, *METRIC)


def test_success_rates_stand_in_table_and_document_and_ties_are_told(tables):
    wins = {"A": 2, "B": 2, "C": 5, "D": 8}
    rows = [f"{agent},{episode},{int(episode < wins[agent])}" for agent in wins for episode in range(9)]
    for file in ("rates.csv", "again.csv"):
        Path(file).write_text("\n".join(["agent,episode,success", *rows]) + "\n")
    words = ("--proxy", "again.csv", "--target", "rates.csv", "--metric", "success:max")
    rate = document(*words)["success_rates"]["success"]["C"]["target"]
    assert (rate["value"], rate["episodes"]) == (pytest.approx(5 / 9), 9)
    assert rate["low"] < 5 / 9 < rate["high"]
    assert "C      0.56 (0.27 to 0.81)         9  0.56 (0.27 to 0.81)         9" in shown(*words)
    assert "1 of 6 pairs of agents tie in the proxy, 1 on the target" in shown(*words)


def test_all_measures_are_also_a_table_for_programs_or_latex_and_no_other_kind_is_written(tables):
    found = document(*SIDES, *METRIC, "--table", "new/t.csv")
    assert found["table"] == "new/t.csv"
    table = pd.read_csv("new/t.csv").set_index("measure")
    assert list(table.columns) == ["proxy", "value", "low", "high", "better"]
    assert table.value["prpv"] == found["prpv"]
    assert table.loc["prpv", ["low", "high"]].tolist() == found["prpv_interval"]
    assert table.value["srcc_distance"] == found["srcc"]["distance"]
    run("--proxy", "both.csv:sim", "--proxy", "both.csv:real", "--target", "real.csv", *METRIC, "--table", "t.tex")
    lines = Path("t.tex").read_text().splitlines()
    assert lines[2] == r"measure & sim & real \\"
    row = next(line for line in lines if line.startswith("PRPV"))
    assert re.fullmatch(r"PRPV & 2 \(\d+ to \d+\) & 0 \(\d+ to \d+\) \\\\", row)
    assert r"Kendall $\tau$ distance" in Path("t.tex").read_text()
    words = (*SIDES, *METRIC, "--table", "t.xlsx", "--output", "out")
    assert "--table t.xlsx: a table is written as .csv or .tex" in complaint_of(run, *words)
    assert not Path("out").exists()


BOTH = "Policy,Sim success (%),Real success (%)\nACT,62,48\nDiffusion,81,70\npi0,90,85\nOpenVLA,40,52\n"


def test_a_papers_table_gives_the_decision_with_the_promised_keys(tables):
    Path("both.csv").write_text(BOTH)
    found = document("both.csv", "--rollouts", "25")
    decision = found["decision"]
    assert (decision["winner"], decision["chosen_on"]) == ("pi0", "success")
    assert decision["not_told_apart"] == ["Diffusion"]
    assert 0.8 < decision["probability_best"] < 0.95
    assert set(decision["expected_regret"]) == {"ACT", "Diffusion", "pi0", "OpenVLA"}
    assert found["observed"]["proxy_winner"] == found["observed"]["target_winner"] == "pi0"
    assert found["observed"]["regret"] == 0.0
    assert found["p_exact"] == pytest.approx(4 / 24)
    assert set(found["saves"]) >= {"real_rollouts_worth", "interval"}
    assert "Diffusion" in found["next"]
    assert found["mmrv_conventions"]["success"]["simpler"] == pytest.approx(found["mmrv"]["success"])
    bare = document("both.csv")["decision"]
    assert (bare["winner"], bare["probability_best"]) == ("pi0", None)
    assert "Deploy pi0" in " ".join(shown("both.csv", "--rollouts", "25").split())


def test_lerobots_files_give_the_sentence_and_a_test_after_each_rollout(tables):
    for side, count, rates in (("sim", 60, (0.6, 0.95)), ("real", 30, (0.2, 0.9))):
        for agent, rate in zip(("act", "pi0"), rates, strict=True):
            episodes = [{"success": (7 * i) % 10 < 10 * rate, "seed": None} for i in range(count)]
            Path(side, agent).mkdir(parents=True)
            Path(side, agent, "eval_info.json").write_text(json.dumps({"per_episode": episodes}))
    words = ("--proxy", "sim", "--target", "real", "--metric", "success:max", "--sequential")
    found = document(*words)
    assert found["sequential"]["winner"] == found["decision"]["winner"] == "pi0"
    assert found["sequential"]["decided_at"] <= 30
    assert "sequential test: pi0 is shown to be the best" in " ".join(shown(*words).split())


def test_of_several_proxies_it_is_told_what_choosing_by_each_costs(tables):
    target = "agent,success\na,0.2\nb,0.9\nc,0.3\n"
    Path("real.csv").write_text(target)
    Path("right.csv").write_text(target.replace("0.9", "0.8"))
    Path("wrong.csv").write_text("agent,success\na,0.9\nb,0.1\nc,0.3\n")
    words = ("--proxy", "right.csv", "--proxy", "wrong.csv", "--target", "real.csv", "--metric", "success:max")
    (choice,) = document(*words, "--rollouts", "50")["choices"]
    assert (choice["better"], choice["worse"], choice["beyond_noise"]) == ("right", "wrong", True)
    assert choice["difference"] == pytest.approx(0.68, abs=0.05)
    assert document(*words)["choices"][0]["interval"] is None
