"""An agent that comes to other scores in the same episode is named before the first trial."""

import json
import random

import numpy as np
import pytest
from moody import Moody

from proxytune.cli.main import main
from proxytune.domain import make_episode
from proxytune.running.episodes import run_episode
from proxytune.study.stages.repeatable import REMEDY

EPISODE = make_episode({}, agent="agent2", start=0, seed=2**40 + 3)


@pytest.mark.slow
@pytest.mark.parametrize("jobs", ["1", "2"])
def test_agents_that_remember_or_draw_unseeded_are_named_at_once_and_for_good(make_study, capsys, jobs):
    folder = make_study(family='"moody:moody"', preflight="true", jobs=jobs, budget="3", initial="3")
    named = [
        f"pre-flight: agent '{agent}' scores otherwise in the same episode; {REMEDY}" for agent in ("agent1", "agent3")
    ]
    assert main(["study", str(folder), "--json"]) == 0
    first = capsys.readouterr()
    assert [line for line in first.err.splitlines() if "otherwise" in line] == [f"proxytune study: {n}" for n in named]
    assert json.loads(first.out)["preflight"]["warnings"][:2] == named
    assert main(["study", str(folder), "--json"]) == 0
    again = capsys.readouterr()
    assert "otherwise" not in again.err
    assert json.loads(again.out)["preflight"]["warnings"][:2] == named
    assert named[0].removeprefix("pre-flight: ").split(";")[0].replace("'", "&#39;") in (
        (folder / "report.html").read_text().replace("&#x27;", "&#39;")
    )


def test_a_study_of_repeatable_agents_has_nothing_to_say(make_study, capsys):
    assert main(["study", str(make_study(preflight="true", budget="2", initial="2")), "--json"]) == 0
    assert "otherwise" not in "".join(capsys.readouterr())


@pytest.mark.parametrize("agent", ["agent2", "agent4"])
def test_draws_from_the_generators_of_the_process_follow_from_the_episode_s_seed(agent):
    episode, another = (make_episode({}, agent=agent, start=0, seed=seed) for seed in (2**40 + 3, 5))
    np.random.seed(1)
    first, other = run_episode(Moody(), episode).metrics, run_episode(Moody(), another).metrics
    np.random.seed(2)
    random.seed(2)
    assert run_episode(Moody(), episode).metrics == first != other


def test_the_generators_of_the_process_go_on_as_if_no_episode_had_been_driven():
    np.random.seed(1)
    random.seed(1)
    expected = np.random.normal(), random.random()
    np.random.seed(1)
    random.seed(1)
    run_episode(Moody(), EPISODE)
    assert (np.random.normal(), random.random()) == expected
