"""Every form in which evaluators have their scores is read, and what is wrong in one is said in a line."""

import json

import numpy as np
import pytest
from one_line import complaint_of

from proxytune.errors import ScoresError
from proxytune.scores import both_metrics, expand, read_scores


@pytest.fixture
def file(tmp_path):
    def write(text, name="scores.csv"):
        path = tmp_path / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text if isinstance(text, str) else json.dumps(text))
        return path

    return write


def means(path, metric="success", **how):
    table = read_scores(path, [metric], **how)
    return dict(zip(table.agents, table.means[:, 0].round(6).tolist(), strict=True))


BOTH = "Policy,Sim success (%),Real success (%)\nACT,62,48\npi0,90,85\n"


def test_one_table_of_both_sides_gives_each_its_own_column_as_a_share_and_patterns_stand_for_columns(file):
    assert means(file(BOTH), side="proxy") == {"ACT": 0.62, "pi0": 0.9}
    assert means(file(BOTH), side="target") == {"ACT": 0.48, "pi0": 0.85}
    assert both_metrics(["Policy", "Sim success (%)", "Real success (%)", "Real n", "Sim n"]) == ["success"]
    expanded = expand(["task_*:max", "time:min"], ["agent", "task_a", "task_b", "time"])
    assert expanded == ["task_a:max", "task_b:max", "time:min"]


def test_a_quoted_decimal_comma_is_one_wherever_it_stands(file):
    assert means(file('Policy,success\nACT,"61,5 %"\npi0,90 %\n')) == {"ACT": 0.615, "pi0": 0.9}
    assert means(file({"lift": {"ACT": "61,5 %", "pi0": "90 %"}}, "a.json"), "lift") == {"ACT": 0.615, "pi0": 0.9}


@pytest.mark.parametrize("cell", ["120", "-20", "100.5%"])
def test_a_success_rate_beyond_all_rollouts_is_refused_by_its_line_and_other_percentages_are_not(file, cell):
    with pytest.raises(ScoresError, match="line 2, column 'success': a success rate lies between 0 and 100 %"):
        means(file(f"Policy,success (%)\nACT,{cell}\npi0,90\n"))
    assert means(file("Policy,progress (%)\nACT,120\npi0,90\n"), "progress") == {"ACT": 1.2, "pi0": 0.9}


@pytest.mark.parametrize(
    "text",
    [
        "policy,success\na,18 of 25\nb,5/25\n",
        "policy,success,n\na,18,25\nb,5,25\n",
        "policy,success,trials\na,0.72,25\nb,0.2,25\n",
        "policy,success (%),rollouts\na,72,25\nb,20,25\n",
    ],
)
def test_counts_become_a_row_a_rollout(file, text):
    table = read_scores(file(text), ["success"])
    assert table.counts.tolist() == [25, 25]
    assert table.means[:, 0].tolist() == [0.72, 0.2]
    assert not table.complete  # rollouts of two agents are no pairs


def test_standard_errors_are_read_from_cells_or_a_column_and_a_lerobot_folder_is_a_row_a_rollout(file):
    for text in ("success\na,0.61 ± 0.05\nb,20 % +/- 4 %\n", "success,success se\na,0.61,0.05\nb,0.2,0.04\n"):
        table = read_scores(file(f"policy,{text}"), ["success"])
        assert np.allclose(table.means[:, 0], [0.61, 0.2])
        assert np.allclose(table.errors[:, 0], [0.05, 0.04])
    episodes = [{"episode_ix": i, "sum_reward": 1.5, "success": i < 3, "seed": 7 + i} for i in range(4)]
    file({"per_episode": episodes, "aggregated": {"pc_success": 75.0}}, "evals/act/eval_info.json")
    tasks = [{"task_group": "t", "task_id": 0, "metrics": {"successes": [True, False], "sum_rewards": [1.0, 0.0]}}]
    path = file({"per_task": tasks, "overall": {}}, "evals/pi0/eval_info.json").parent.parent
    assert means(path) == {"act": 0.75, "pi0": 0.5}
    assert means(path / "act" / "eval_info.json", "sum_reward") == {"act": 1.5}


def test_dictionaries_in_a_python_file_are_read_and_nothing_is_run(file, tmp_path):
    text = f'open({str(tmp_path / "ran")!r}, "w")\n'
    text += 'REAL = {"pick": {"x": 0.9, "y": 0.5}, "w": {"z": 0.1}}\nSIM = {}\n'
    assert means(file(text, "metrics.py"), "pick", domain="REAL") == {"x": 0.9, "y": 0.5}
    assert not (tmp_path / "ran").exists()
    with pytest.raises(ScoresError, match="did you mean 'REAL'"):
        means(file(text, "metrics.py"), "pick", domain="REEL")
    assert means(file({"pick": {"x": 0.9}}, "one.json"), "pick") == {"x": 0.9}


@pytest.mark.parametrize(
    ("name", "text", "complaint"),
    [
        ("a.csv", "policy,success,n\na,30,25\n", "30 successes of 25 rollouts cannot be"),
        ("a.csv", "policy,success,n\na,0.5,x\n", "must be a whole number"),
        ("a.csv", "policy,success,n\na,0.333,4\n", "no whole number of successes"),
        ("a.csv", "policy,success\na,26 of 25\n", "must be a finite number, got '26 of 25'"),
        ("a.csv", "policy,success\na,18 of 25\nb,x of 25\n", "line 3, column 'success': must be a finite number"),
        ("a.csv", "policy,success\na,18 of 25\nb,0.5\n", "line 3: has no counts of rollouts, as other lines have"),
        ("a.csv", "policy,success,success se\na,0.5,-1\n", "standard error must be zero or more"),
        ("a.csv", "policy,success,n\na,0.5," + 5000 * "9" + "\n", "line 2"),
        ("a.csv", "policy,success,n\na,0.5," + 400 * "9" + "\n", "line 2"),
        ("a.csv", "policy,success\na," + 5000 * "9" + "/" + 5000 * "9" + "\n", "line 2"),
        ("a.py", "X = {[1]: 2}", "has none that is written out"),
        ("a.json", "{", "not readable as JSON"),
        ("a.json", '{"pick": 3}', "holds no scores by agent"),
        ("a.json", '{"pick": {"x": 0.5, "x": 0.7}}', "'x' twice in one object"),
        ("a.json", '{"aggregated": {}}', "aggregates alone"),
        ("a.json", '{"per_episode": [3]}', "per_episode, entry 0"),
        ("a.json", '{"per_task": [{"metrics": {"successes": 3}}]}', "lists of one length"),
        ("a.py", "def f(:", "not readable as Python"),
        ("a.py", "x = 3", "has none"),
    ],
)
def test_what_is_wrong_is_one_line(file, name, text, complaint):
    assert complaint in complaint_of(read_scores, file(text, name), ["success"])
