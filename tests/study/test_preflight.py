"""A family with one dead parameter, one that moves no more than noise does, and one that matters."""

from dataclasses import replace

import numpy as np
import pytest
from stopping import Stopping

from proxytune.errors import EpisodeError, RunError
from proxytune.search.engines.registry import make_proposer
from proxytune.space import Interval
from proxytune.storage.store import Store
from proxytune.study.run import run_study
from proxytune.study.stages.movement import LEVEL, LOOKS, judge
from proxytune.study.stages.preflight import PAIRS, most_episodes, preflight_of, run_preflight
from proxytune.study.study import open_study
from proxytune.study.study_run import StudyRun


def run(folder, **changes):
    study = open_study(folder)
    study = replace(study, settings=replace(study.settings, **changes))
    with Store.open(folder) as store:
        study_run = StudyRun(study, store)
        run_preflight(study_run)
        spent = study_run.spent
        return spent, preflight_of(StudyRun(study, store))


def told(folder, **changes):
    """What is found of each parameter."""
    return {movement.interval.name: movement for movement in run(folder, **changes)[1].movements}


@pytest.fixture
def planted(make_study):
    """A study of the planted parameters, with so many agents and of this seed."""

    def make(called="planted", agents=6, **changes):
        names = ", ".join(f'"agent{number}"' for number in range(agents))
        return make_study(
            called,
            parameters={"matters": "[-1, 1]", "noise_sized": "[0, 1]", "dead": "[0, 1]"},
            family='"partly_dead:partly_dead"',
            agents=f"[{names}]",
            preflight="true",
            **changes,
        )

    return make


@pytest.mark.parametrize("seed", ["1", "2", "3"])
@pytest.mark.parametrize("agents", [2, 6])
def test_of_the_planted_parameters_only_the_one_that_matters_moves_a_metric_beyond_noise(planted, agents, seed):
    found = told(planted(agents=agents, seed=seed))
    assert {name: (movement.moves, movement.dead) for name, movement in found.items()} == {
        "matters": (True, False),
        "noise_sized": (False, False),
        "dead": (False, True),
    }
    assert found["matters"].change > found["matters"].noise > 0.0


def test_a_parameter_that_matters_is_not_looked_at_twice_and_nothing_is_simulated_again(planted):
    folder = planted(jobs="2")
    spent, found = run(folder)
    looked = {"base and noise": 2 * PAIRS, "matters": 2 * PAIRS // LOOKS, "the others": 4 * PAIRS}
    assert spent.episodes == found.episodes == sum(looked.values())
    assert spent.episodes < most_episodes(open_study(folder).settings)
    assert run(folder) == (replace(spent, episodes=0, seconds=0), found)


@pytest.mark.parametrize("jobs", [1, pytest.param(2, marks=pytest.mark.slow)])
def test_interrupted_anywhere_it_finds_the_same_and_simulates_nothing_twice(planted, jobs):
    _, whole = run(planted("whole"))
    folder = planted("stopped")
    study = open_study(folder)
    study = replace(study, settings=replace(study.settings, jobs=jobs))
    for episodes in (1, 50, 60):
        with Store.open(folder) as store, pytest.raises(KeyboardInterrupt):
            study_run = StudyRun(study, store, Stopping(episodes))
            run_preflight(study_run)
        assert run_free(folder) is None
    spent, found = run(folder, jobs=jobs)
    assert found == whole
    assert spent.episodes == whole.episodes - 111


def run_free(folder):
    with Store.read(folder) as store:
        return preflight_of(StudyRun(open_study(folder), store))


def test_what_need_not_be_run_is_taken_off_the_bar(planted):
    study = open_study(planted())
    watcher = Stopping()
    with Store.open(study.settings.folder) as store:
        study_run = StudyRun(study, store, watcher)
        run_preflight(study_run)
        spent = study_run.spent
    assert spent.episodes + watcher.off == most_episodes(study.settings)


def test_the_trials_are_those_of_a_study_without_it(make_study, finished):
    folder = make_study("checked", preflight="true")
    assert run(folder)[0].episodes > 0
    trials = []
    for one in (folder, finished):
        with Store.open(one) as store:
            study_run = StudyRun(open_study(one), store)
            run_study(study_run, make_proposer("gp", 5))
            trials.append(store.trials())
    assert trials[0] == trials[1]


def test_a_study_whose_trials_have_begun_goes_on_without(finished, make_study):
    make_study(preflight="true")
    spent, found = run(finished)
    assert (spent.episodes, found) == (0, None)


def test_it_can_be_turned_off(make_study):
    folder = make_study(preflight="false")
    spent, found = run(folder)
    assert (spent.episodes, found) == (0, None)
    assert most_episodes(open_study(folder).settings) == 0


def test_failed_episodes_are_left_out_of_the_comparison(make_study):
    found = told(make_study(preflight="true", domain={"faults": '["agent3:1:raises"]'}))
    assert {movement.pairs for movement in found.values()} <= {PAIRS // LOOKS - 1, PAIRS - 2}


def test_where_every_agent_fails_everywhere_it_says_so_once_and_of_what(make_study):
    faults = ", ".join(f'"agent{number}:*:raises"' for number in range(6))
    with pytest.raises(RunError, match="^agent 'agent0' raised ValueError.*; every agent fails so, in all 72 episodes"):
        run(make_study(preflight="true", domain={"faults": f"[{faults}]"}))


def test_where_agents_fail_of_different_things_it_goes_on_and_says_so_once(make_study):
    faults = ", ".join(f'"agent{number}:*:{"raises" if number else "crashes"}"' for number in range(6))
    _, found = run(make_study(preflight="true", domain={"faults": f"[{faults}]"}))
    (warning,) = found.warnings
    assert warning.startswith("pre-flight: every agent fails everywhere, first with: the domain family raised Zero")
    assert warning.endswith("; correct it")
    assert all(not movement.pairs and "cannot be tested" in movement.warning for movement in found.movements)


def test_where_failures_stop_the_study_they_stop_it_here(make_study):
    with pytest.raises(EpisodeError, match="agent 'agent3'"):
        run(make_study(preflight="true", domain={"faults": '["agent3:1:raises"]'}, on_failure='"stop"'))


def test_what_is_wrong_with_a_parameter_and_what_to_do_is_one_line(planted):
    _, found = run(planted())
    dead, noise_sized = found.warnings
    assert dead.startswith("pre-flight: 'dead' changes nothing at all across [0, 1]; remove it from")
    assert noise_sized.startswith("pre-flight: 'noise_sized' is not shown to change a metric across [0, 1]")


def test_a_parameter_that_is_only_one_more_source_of_noise_is_said_to_matter_in_at_most_one_case_in_twenty():
    """Heavy tails too: whatever the noise, the test compares ranks."""
    rng, interval = np.random.default_rng(1), Interval("blur", 0.0, 1.0)
    found = [judge(interval, ["a", "b"], rng.standard_t(2, (PAIRS, 4, 2))) for _ in range(400)]
    assert 0 < sum(movement.moves for movement in found) * LOOKS <= 400 * LEVEL + 9


def test_one_metric_that_a_parameter_moves_is_enough_and_it_is_named():
    values = np.random.default_rng(1).normal(size=(PAIRS, 4, 2))
    values[:, 3, 1] += 10.0
    found = judge(Interval("blur", 0.0, 1.0), ["a", "b"], values)
    assert found.moves
    assert found.metric == "b"
