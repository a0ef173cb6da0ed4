"""What is told of the answers of whole studies is what their episodes say."""

import answers
import numpy as np
import pytest
from study_problems import TruthObjective

from proxytune.search import to_unit
from proxytune.seeds import fresh_seed, target_seed
from proxytune.storage import Store
from proxytune.study import StudyRun, open_study


def row(seed, own, found, away):
    """A truth whose PRPV and that of its answer are so, with an answer so far away in the first parameter."""
    point, both = [0.5, 0.5], {"truth": own, "answer": found}
    return {
        "seed": seed,
        "points": {"truth": point, "answer": [0.5 + away, 0.5], "mode": point, "mean": point},
        "scores": {name: {"known": [one] * 2, "held out": [2 * one] * 2} for name, one in both.items()},
        "expected": [found, 3.5, 100.0],
        "visited": seed > 1,
        "holds": seed > 1,
        "share": 0.01 * seed,
    }


def test_means_ratios_medians_and_counts_are_those_of_the_truths():
    rows = [row(1, 2.0, 3.0, 0.1), row(2, 4.0, 4.0, -0.2), row(3, 6.0, 8.0, 0.4)]
    lines = list(answers.told(rows, ("delay", "trim")))
    assert lines[2].startswith("| the study's agents | 4 (2 to 6) | 5 (3 to 8) | 1.25 (")
    assert lines[3].startswith("| agents held out | 8 (4 to 12) | 10 (6 to 16) | 1.25 (")
    assert lines[7].startswith("| answer | 0.1 (0.05 to 0.2) | 0.200 | 0.000 |")
    assert lines[-1] == (
        "Of 3 truths the 95 % region holds 2, with a median share of 2.0 % of the box; the interval of expected PRPV "
        "holds the mean of the repetitions in 2 of 3; no trial visited the answer in 1."
    )
    before = [row(seed, 1.0, 1.0, 0.0) for seed in (1, 2, 3)]
    assert answers.compared(rows, before).startswith("Less before, means: PRPV 4 (2 to 7); that of agents held out 8 (")


@pytest.fixture
def small(monkeypatch):
    monkeypatch.setattr(answers, "HELD_OUT", ("agent4", "agent5"))
    monkeypatch.setattr(answers, "REPEATS", 2)
    # On so few agents PRPV is mostly 0.
    monkeypatch.setattr(answers, "prpv_of_means", lambda some, target, _: np.array([away(x, target) for x in some]))


def away(one, other):
    """The sum of all distances."""
    return float(np.abs(one - other).sum())


@pytest.mark.slow
def test_a_truth_is_driven_afresh_beside_the_answer_of_its_study_and_nothing_twice(small, make_study, tmp_path):
    journal = tmp_path / "journal"
    agents = '["agent0", "agent1", "agent2", "agent3"]'
    folder = make_study(domain={"journal": f'"{journal}"'}, agents=agents, engine='"outcomes"', confirm="1")
    with Store.open(tmp_path) as store:
        objective = TruthObjective(StudyRun(open_study(folder), store))
        found = answers.run_seed(objective, tmp_path / "7", 7)
        before = journal.read_text()
        assert answers.run_seed(objective, tmp_path / "7", 7) == found
        assert journal.read_text() == before
        truth = objective.truth(7)
        seeds = [target_seed(7), fresh_seed(7, answers.FIRST), fresh_seed(7, answers.FIRST + 1)]
        target, *fresh = answers.means(objective.run, truth, seeds)
    assert found["points"]["truth"] == to_unit(objective.space, truth).tolist()
    own = found["scores"]["truth"]
    assert own["known"] == [away(one[:4], target[:4]) for one in fresh]
    assert own["held out"] == [away(one[4:], target[4:]) for one in fresh]
