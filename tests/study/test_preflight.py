"""Noise is that of placement; dead parameters and agents that do not repeat are named before the first trial."""

import json
import random
from dataclasses import replace

import numpy as np
import pytest
from deadly import Deadly
from searched import changed, looked_at, running, searched
from stopping import Stopping

from proxytune.cli.main import main
from proxytune.domain import Outcome, make_episode
from proxytune.errors import EpisodeError, RunError
from proxytune.running import run_episode
from proxytune.space import Interval
from proxytune.storage import Store
from proxytune.study import StudyRun, goal_of, most_preflight_episodes, open_study, preflight, run_preflight


def outcome(agent, failure=""):
    return Outcome(make_episode({}, agent=agent, start=0, seed=0), None if failure else {"distance": 1.0}, failure, 0.1)


ALIKE = [outcome(f"agent{n}", f"agent 'agent{n}' raised KeyError at 1.{n} s: 'mass' (sim.py, line 7)") for n in (0, 1)]


def test_where_all_fail_alike_the_line_begins_with_the_failure_and_its_place():
    expected = r"^agent 'agent0' raised KeyError at 1.0 s: 'mass' \(sim.py, line 7\); every agent fails so, in all 2"
    with pytest.raises(RunError, match=expected) as told:
        preflight.check_some_work(ALIKE, "trial 1 of 20")
    assert str(told.value).endswith("of trial 1 of 20: correct it and run the same command again")


@pytest.mark.parametrize(
    "outcomes",
    [[], [*ALIKE, outcome("agent2")], [ALIKE[0], outcome("agent1", "agent 'agent1' raised ValueError: no mass")]],
    ids=["none was driven", "one worked", "they fail of different things"],
)
def test_anything_else_goes_on(outcomes):
    preflight.check_some_work(outcomes, "the pre-flight")


def edited(folder, edit):
    target = folder / "target.csv"
    head, *rows = target.read_text().splitlines()
    target.write_text("\n".join([head, *edit(rows)]) + "\n")
    return folder


def means_only(rows):
    """One row an agent, as papers print them."""
    return list({row.split(",")[0]: row for row in rows}.values())


def other_starts(rows):
    return [row.replace(",", ",other", 1) for row in rows]


def with_holes(rows):
    return [row for row in rows if not row.startswith("agent2,1,")]


def test_noise_is_that_of_placement_and_less_with_repeats(make_study):
    with running(make_study(preflight="true")) as study_run:
        run_preflight(study_run)
        found, pairs = preflight.noise_of(study_run), preflight.placement_pairs(study_run)
        unknown = preflight.noise_of(StudyRun(open_study(make_study(preflight="false")), study_run.store))
        folder = make_study(preflight="true")
        edited(folder, twice)
        study = open_study(folder)
        assert preflight.shares_starts(study)
        again = preflight.noise_of(StudyRun(study, study_run.store))
    assert found.caution == ""
    assert pairs.shape[1:] == (2, 6, 2)
    # Wobbly's scores wobble by 0.15, so a difference of two means over three starts has a variance of 2 · 0.15² / 3.
    assert np.median(found.variance) == pytest.approx(2 * 0.15**2 / 3, rel=0.8)
    assert (found.variance > 0.0).all()
    assert again.variance == pytest.approx(0.75 * found.variance)
    assert unknown.caution.startswith("noise is estimated from the spread between the target's episodes")


def from_one(rows):
    split = [row.split(",", 2) for row in rows]
    return [f"{agent},{int(start) + 1},{rest}" for agent, start, rest in split]


def test_episodes_that_are_numbered_from_one_are_pointed_out_where_noise_is_not_known(make_study):
    folder = make_study(preflight="false")
    edited(folder, from_one)
    with running(folder) as study_run:
        caution = preflight.noise_of(study_run).caution
    assert caution.endswith("; if its episodes 1 to 3 are these starts, number them 0 to 2")


def twice(rows):
    """Every start driven twice, labelled START/REPEAT."""
    split = [row.split(",", 2) for row in rows]
    return [f"{agent},{start}/{repeat},{rest}" for agent, start, rest in split for repeat in (0, 1)]


@pytest.mark.slow
@pytest.mark.parametrize("edit", [means_only, other_starts, with_holes])
def test_any_other_table_works_and_says_what_it_loses(finished, edit):
    assert len(looked_at(open_study(finished)).cautions) == 1  # this study has no pre-flight
    found = looked_at(open_study(edited(finished, edit)))
    assert not preflight.shares_starts(found.study)
    (caution,) = found.cautions
    assert caution.startswith("noise is ")
    assert "; to know θ better, measure the target" in caution
    assert found.best.trial in found.trials
    for low, high in found.knowledge.intervals.values():
        assert low < high


def test_failed_episodes_are_left_out_of_noise_and_comparison(make_study):
    with running(make_study(domain={"faults": '["agent3:1:raises"]'}, preflight="true")) as study_run:
        run_preflight(study_run)
        found = preflight.noise_of(study_run)
        assert np.array_equal(goal_of(study_run).noise, found.variance.ravel())
    assert np.isfinite(found.variance).all()
    found = told(make_study(preflight="true", domain={"faults": '["agent3:1:raises"]'}))
    assert {movement.pairs for movement in found.values()} <= {
        preflight.PAIRS // preflight.LOOKS - 1,
        preflight.PAIRS - 2,
    }


def run(folder, **changes):
    with running(changed(folder, **changes)) as study_run:
        run_preflight(study_run)
        return study_run.spent, preflight.preflight_of(StudyRun(study_run.study, study_run.store))


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


@pytest.mark.parametrize(("agents", "seed"), [(2, "1"), (6, "2")])
def test_of_the_planted_parameters_only_the_one_that_matters_moves_a_metric_beyond_noise(planted, agents, seed):
    found = told(planted(agents=agents, seed=seed))
    assert {name: (movement.moves, movement.dead) for name, movement in found.items()} == {
        "matters": (True, False),
        "noise_sized": (False, False),
        "dead": (False, True),
    }
    assert found["matters"].change > found["matters"].noise > 0.0


@pytest.mark.slow
def test_a_parameter_that_matters_is_not_looked_at_twice_and_nothing_is_simulated_again(planted):
    folder = planted(jobs="2")
    spent, found = run(folder)
    looked = {
        "base and noise": 2 * preflight.PAIRS,
        "matters": 2 * preflight.PAIRS // preflight.LOOKS,
        "the others": 4 * preflight.PAIRS,
    }
    assert spent.episodes == found.episodes == sum(looked.values())
    assert spent.episodes < most_preflight_episodes(open_study(folder).settings)
    assert run(folder) == (replace(spent, episodes=0, seconds=0), found)


def test_what_need_not_be_run_is_taken_off_the_bar(planted):
    study = open_study(planted())
    watcher = Stopping()
    with Store.open(study.settings.folder) as store:
        study_run = StudyRun(study, store, watcher)
        run_preflight(study_run)
        spent = study_run.spent
    assert spent.episodes + watcher.off == most_preflight_episodes(study.settings)


def test_the_trials_are_those_of_a_study_without_it_also_where_they_have_begun(make_study, finished):
    folder = make_study("checked", preflight="true")
    assert run(folder)[0].episodes > 0
    assert searched(open_study(folder))[1] == searched(open_study(finished))[1]
    make_study(preflight="true")
    spent, found = run(finished)
    assert (spent.episodes, found) == (0, None)


def test_where_every_agent_fails_everywhere_it_says_so_once_and_where_failures_stop_they_stop_it_here(make_study):
    faults = ", ".join(f'"agent{number}:*:raises"' for number in range(6))
    with pytest.raises(RunError, match="^agent 'agent0' raised ValueError.*; every agent fails so, in all 72 episodes"):
        run(make_study(preflight="true", domain={"faults": f"[{faults}]"}))
    with pytest.raises(EpisodeError, match="agent 'agent3'"):
        run(make_study(preflight="true", domain={"faults": '["agent3:1:raises"]'}, on_failure='"stop"'))


def test_where_agents_fail_of_different_things_it_goes_on_and_says_so_once(make_study):
    faults = ", ".join(f'"agent{number}:*:{"raises" if number else "crashes"}"' for number in range(6))
    _, found = run(make_study(preflight="true", domain={"faults": f"[{faults}]"}))
    (warning,) = found.warnings
    assert warning.startswith("pre-flight: every agent fails everywhere, first with: the domain family raised Zero")
    assert warning.endswith("; correct it")
    assert all(not movement.pairs and "cannot be tested" in movement.warning for movement in found.movements)


def test_one_line_says_what_is_wrong_with_a_parameter_and_one_metric_that_moves_is_enough(planted):
    _, found = run(planted())
    dead, noise_sized = found.warnings
    assert dead.startswith("pre-flight: 'dead' changes nothing at all across [0, 1]; remove it from")
    assert noise_sized.startswith("pre-flight: 'noise_sized' is not shown to change a metric across [0, 1]")
    values = np.random.default_rng(1).normal(size=(preflight.PAIRS, 4, 2))
    values[:, 3, 1] += 10.0
    found = preflight.judge(Interval("blur", 0.0, 1.0), ["a", "b"], values)
    assert found.moves
    assert found.metric == "b"


@pytest.mark.slow
def test_a_parameter_that_is_only_one_more_source_of_noise_is_said_to_matter_in_at_most_one_case_in_twenty():
    """Heavy tails too: whatever the noise, the test compares ranks."""
    rng, interval = np.random.default_rng(1), Interval("blur", 0.0, 1.0)
    found = [preflight.judge(interval, ["a", "b"], rng.standard_t(2, (preflight.PAIRS, 4, 2))) for _ in range(400)]
    assert 0 < sum(movement.moves for movement in found) * preflight.LOOKS <= 400 * preflight.LEVEL + 9


MOODY = Deadly(
    faults=("agent1:*:remembers", "agent2:*:draws by NumPy", "agent3:*:draws", "agent4:*:draws by Python"),
)


@pytest.mark.slow
@pytest.mark.parametrize("jobs", ["1", "2"])
def test_agents_that_remember_or_draw_unseeded_are_named_at_once_and_for_good(make_study, capsys, jobs):
    domain = {"faults": str(list(MOODY.faults))}
    folder = make_study(family='"deadly:deadly"', domain=domain, preflight="true", jobs=jobs, budget="3", initial="3")
    named = [
        f"pre-flight: agent '{agent}' scores otherwise in the same episode; {preflight.REMEDY}"
        for agent in ("agent1", "agent3")
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


@pytest.mark.parametrize("agent", ["agent2", "agent4"])
def test_draws_from_the_generators_of_the_process_follow_from_the_episode_s_seed(agent):
    episode, another = (make_episode({}, agent=agent, start=0, seed=seed) for seed in (2**40 + 3, 5))
    np.random.seed(1)
    first, other = run_episode(MOODY, episode).metrics, run_episode(MOODY, another).metrics
    np.random.seed(2)
    random.seed(2)
    assert run_episode(MOODY, episode).metrics == first != other


def test_the_generators_of_the_process_go_on_as_if_no_episode_had_been_driven():
    np.random.seed(1)
    random.seed(1)
    expected = np.random.normal(), random.random()
    np.random.seed(1)
    random.seed(1)
    run_episode(MOODY, make_episode({}, agent="agent2", start=0, seed=2**40 + 3))
    assert (np.random.normal(), random.random()) == expected
