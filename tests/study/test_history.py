"""A study's trials as a search of any kind has them."""

from dataclasses import replace
from types import SimpleNamespace

from proxytune.storage.records import TrialRecord
from proxytune.study.history import history_of
from proxytune.study.study import open_study

TRIALS = (
    TrialRecord(1, {"delay": 0.1, "trim": 0.0}, "finished", 4.0, {"prpv": 4, "ppv": None}, failed_episodes=1),
    TrialRecord(2, {"delay": 0.2, "trim": 0.1}, "cut", 12.0, {}, decided=("agent1", "agent0"), bound=9.0),
    TrialRecord(3, {"delay": 0.3, "trim": 0.1}, "failed", None, {}, failed_episodes=3, failure="agent0 failed"),
)


def result(folder, **changes):
    study = open_study(folder)
    study = replace(study, objective=replace(study.objective, **changes))
    return SimpleNamespace(study=study, trials=TRIALS, best=SimpleNamespace(trial=TRIALS[0]))


def test_every_trial_has_its_state_its_value_where_it_was_measured_and_what_is_known(make_study):
    found = history_of(result(make_study()))
    assert (found.name, found.space.names, found.answer, found.maximise) == ("wobbly", ("delay", "trim"), 0, False)
    assert [(trial.state, trial.value) for trial in found.trials] == [("finished", 4), ("cut", None), ("failed", None)]
    assert [dict(trial.facts) for trial in found.trials] == [
        {"trial": 1, "prpv": 4, "failed_episodes": 1},
        {"trial": 2, "at_least": 9.0, "expected": 12.0, "failed_episodes": 0},
        {"trial": 3, "failed_episodes": 3, "failure": "agent0 failed"},
    ]


def test_an_objective_that_is_to_be_large_is_one(make_study):
    assert history_of(result(make_study(), maximise=True)).maximise
