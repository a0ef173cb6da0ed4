"""The answer is what fresh episodes confirm, never the luckiest trial."""

import shutil
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from searched import changed, looked_at, run, searched
from stopping import Stopping

from proxytune.domain import Outcome
from proxytune.errors import EpisodeError, RunError
from proxytune.report import study_document
from proxytune.report.study.page import usefulness_table
from proxytune.running import Silent
from proxytune.search import Knowledge
from proxytune.search.posterior import Misfit
from proxytune.seeds import fresh_seed
from proxytune.storage import Store, TrialRecord
from proxytune.study import (
    StudyRun,
    history_of,
    most_confirmation_episodes,
    open_study,
    plan_episodes,
    result_of,
    score_table,
)
from proxytune.study.answer import (
    MOST_FINALISTS,
    MOST_REPETITIONS,
    UNVISITED,
    _answer,
    _learn_again,
    confirmation_of,
    finalists,
    nominal_theta,
    run_confirmation,
)
from proxytune.study.facts import NOMINAL
from proxytune.study.run import knowledge_of
from proxytune.study.settings import StopRules
from proxytune.usefulness import Estimate, compare
from proxytune.usefulness.pairs import prpv

ONE = 6 * 3
"""Episodes of one repetition of one θ."""


def opened(folder, **changes):
    return changed(folder, **{"confirm": 1, **changes})


def confirmed(folder, watcher=None, **changes):
    """What it cost, and what there is to tell."""
    study = opened(folder, **changes)
    with Store.open(folder) as store:
        study_run = StudyRun(study, store, watcher or Silent())
        run_confirmation(study_run)
        return study_run.spent, result_of(StudyRun(study, store))


@pytest.fixture(scope="module")
def once(finished_once, tmp_path_factory):
    """A study that was confirmed once, by who watched what it cost and found; only to be read."""
    folder, watcher = shutil.copytree(finished_once, tmp_path_factory.mktemp("once") / "study"), Stopping()
    return watcher, *confirmed(folder, watcher)


def test_the_answer_is_told_by_episodes_not_seen_and_what_is_expected_by_those_it_was_not_chosen_by(once):
    watcher, spent, found = once
    answer = found.confirmation.answer
    assert found.best.trial == answer.trial
    own = sum(one.trial.number == UNVISITED for one in found.confirmation.candidates)
    more = found.confirmation.repetitions
    assert spent.episodes == ONE * (len(found.confirmation.candidates) + own + more) == found.episodes - 7 * ONE
    assert len(answer.scores) == more
    assert answer.optimism == np.mean(answer.scores) - answer.trial.prpv
    assert spent.episodes + watcher.off == most_confirmation_episodes(found.study.settings), "the rest is off the bar"
    with Store.read(found.study.settings.folder) as store:
        known = store.outcomes(found.study.identity, answer.trial.theta)
    seen = plan_episodes(found.study.settings, answer.trial.theta, found.study.settings.seed)
    assert len(set(known) - set(seen)) == ONE * (
        more + (answer.trial in [one.trial for one in found.confirmation.candidates])
    )
    assert {e.seed for e in set(known) - set(seen)}.isdisjoint(e.seed for e in seen)
    answer, study, count = found.confirmation.answer, found.study, found.confirmation.repetitions
    assert 0 < count <= MOST_REPETITIONS
    scores = []
    with Store.read(study.settings.folder) as store:
        study_run = StudyRun(study, store)
        for number in range(2, 2 + count):
            planned = plan_episodes(study.settings, answer.trial.theta, fresh_seed(study.settings.seed, number))
            proxy = score_table(list(study_run.known(planned).values()))
            scores.append(prpv(compare(proxy=proxy, target=study.target, metrics=study.settings.metrics)).value)
    value, low, high = found.expected.prpv.value
    assert value == pytest.approx(sum(scores) / count)
    assert low <= value <= high
    assert (found.floor.kind, found.floor.value) == ("same starts", found.expected.prpv.floor.value)
    assert found.excess.value == pytest.approx(value - found.floor.value)


def test_candidates_are_the_lowest_expected_scores_within_the_noise_with_the_likeliest_and_few(finished):
    study = opened(finished)
    with Store.read(finished) as store:
        trials = store.trials()
        known = knowledge_of(StudyRun(study, store), trials)
    chosen = [study.settings.space.values(trial.theta) for trial in finalists(trials, known)]
    ranked = list(known.expected)
    noise = known.fresh_scores(ranked[0]).std()
    near = [values for values in ranked if known.expected[values] - known.expected[ranked[0]] <= noise]
    assert chosen[0] == known.answer == ranked[0]
    lacks = known.misfit.fits is False
    probable = known.likeliest_of(ranked) if lacks else known.mode
    assert chosen == list(dict.fromkeys([ranked[0], probable, *near[1:]]))[: MOST_FINALISTS - (not lacks)]
    assert known.holds(known.mode)


def plant(study, store, trial, shift):
    """Episodes of this finalist in which the agents rank as on the target, or the other way round."""
    seeds = [
        fresh_seed(study.settings.seed, repetition) for repetition in range(0 if trial.number == UNVISITED else 1, 7)
    ]
    for episode in [one for seed in seeds for one in plan_episodes(study.settings, trial.theta, seed)]:
        row = study.target.agents.index(episode.agent)
        metrics = dict(zip(study.target.metrics, (shift * study.target.means[row]).tolist(), strict=True))
        store.save_outcome(study.identity, Outcome(episode, metrics, "", 0.0))


def test_a_favourite_that_was_lucky_gives_way_to_a_rival_that_fresh_episodes_confirm(finished, monkeypatch):
    study = opened(finished)
    with Store.open(finished) as store:
        trials = store.trials()
        chosen = sorted(trials, key=lambda trial: trial.prpv)[:MOST_FINALISTS]
        monkeypatch.setattr("proxytune.study.answer.finalists", lambda *_: chosen)
        monkeypatch.setattr("proxytune.study.answer._mean_of", lambda *_: [])
        lucky, *rivals = chosen
        plant(study, store, lucky, -1.0)
        for rival in rivals:
            plant(study, store, rival, 1.0)
        found = confirmation_of(StudyRun(study, store), trials, knowledge_of(StudyRun(study, store), trials))
    assert found.answer.trial != lucky
    assert found.answer.scores == (0,) * MOST_REPETITIONS
    assert found.candidates[0].optimism > 0


def test_the_answer_is_the_mean_of_what_trials_and_finalists_tell_unless_prpv_speaks_against_it(once):
    *_, found = once
    trials, (*first, mean) = list(found.trials), found.confirmation.candidates
    with Store.read(found.study.settings.folder) as store:
        run = StudyRun(found.study, store)
        learnt = knowledge_of(run, trials)
        before = _learn_again(run, learnt, first)
        assert knowledge_of(run, trials) is learnt, "it is learnt once"
    assert before.space.theta(before.mean) == mean.trial.theta == found.best.trial.theta
    assert len(found.knowledge.trials) == len(trials) + sum(
        1 + (one.trial.number == UNVISITED) for one in (*first, mean)
    )
    assert {one.placement for one in found.knowledge.trials} == {0, -1}
    same = replace(first[0], fresh=(first[0].fresh[0],) * 3)
    with Store.read(found.study.settings.folder) as store:
        twice = _learn_again(StudyRun(found.study, store), learnt, [same, *first[1:]])
    assert len(twice.trials) == len(before.trials), "what is driven again without any noise tells nothing"
    worse = replace(mean, scores=(1e9,))
    assert _answer([*first, worse], learnt, found.knowledge).trial in [one.trial for one in first]


@pytest.mark.slow
def test_the_nominal_theta_is_driven_once_beside_the_trials_and_told(finished):
    study = opened(finished)
    assert looked_at(open_study(finished)).nominal is None
    family = SimpleNamespace(**{name: getattr(study.family, name) for name in ("identity", "metrics", "parameters")})
    family.nominal = {"delay": 0.1}
    assert nominal_theta(replace(study, family=family)) is None, "of one parameter nothing is known"
    family.nominal["trim"] = 0
    theta = nominal_theta(replace(study, family=family))
    with Store.open(finished) as store:
        store.save_fact(NOMINAL, theta)
        study_run = StudyRun(study, store)
        study_run.outcomes(plan_episodes(study.settings, theta, study.settings.seed), "nominal")
        before = result_of(study_run)
        assert before.trials == tuple(store.trials())
        told = study_document(before)["nominal"]
        value = study_run.evaluation(theta).prpv
    assert told["theta"] == {"delay": 0.1, "trim": 0.0}
    assert told["expected_prpv"]["value"] == value
    assert usefulness_table(before).rows[-4][:2] == ("  nominal", f"{value:.0f}")


@pytest.mark.slow
def test_trials_do_not_depend_on_it(finished):
    with Store.read(finished) as store:
        before = store.trials()
    plain = shutil.copytree(finished, finished.parent / "plain")
    confirmed(finished)
    _, trials = searched(opened(finished, budget=9))
    assert trials == searched(opened(plain, budget=9, confirm=0))[1]
    assert trials[:7] == before


@pytest.mark.slow
def test_every_repetition_has_episodes_and_a_score_of_its_own(finished):
    _, found = confirmed(finished, confirm=2)
    answer, more = found.confirmation.answer, found.confirmation.repetitions
    assert [len(one.scores) for one in found.confirmation.candidates] == [2, 2, 2]
    assert len(answer.scores) == more > 1
    assert int(answer.assessment.inputs.proxy.counts.min()) == 3 * more
    assert answer.optimism == pytest.approx(sum(answer.scores) / more - answer.trial.prpv)


@pytest.mark.slow
def test_it_waits_for_the_end_of_the_study_which_a_rule_may_bring(make_study, finished):
    assert confirmed(finished, budget=8)[0].episodes == 0
    folder = make_study("ruled")
    assert len(searched(opened(folder, stop=StopRules(no_improvement=1e9)))[1]) == 5
    assert confirmed(folder, stop=StopRules(no_improvement=1e9))[0].episodes >= ONE


@pytest.mark.slow
def test_the_time_of_fresh_episodes_does_not_count_for_the_rule_to_stop(finished):
    study = opened(finished, budget=8)
    with Store.open(finished) as store:
        taken = sum(o.seconds for t in store.trials() for o in store.outcomes(study.identity, t.theta).values())
    confirmed(finished, confirm=9)
    _, found = confirmed(finished, budget=8, stop=StopRules(wall_time_s=1.01 * taken))
    assert found.stopped == ""


@pytest.mark.slow
def test_an_agent_that_fails_in_all_fresh_episodes_leaves_the_answer_without_a_score(finished):
    _, found = confirmed(finished)
    study, theta, more = found.study, found.best.trial.theta, found.confirmation.repetitions
    with Store.open(finished) as store:
        for number in range(2, 2 + more):
            for episode in plan_episodes(study.settings, theta, fresh_seed(study.settings.seed, number)):
                if episode.agent == "agent3":
                    store.save_outcome(study.identity, Outcome(episode, None, "it fell", 0.0))
        found = result_of(StudyRun(study, store))
    assert found.confirmation.answer.scores == (None,) * more
    assert found.expected is None
    assert usefulness_table(found).rows[0][1:] == ("–", "", "none on fresh episodes: an agent failed in all of them")
    assert study_document(found)["best"]["fresh"]["prpv"] is None


def test_where_failures_stop_the_study_they_stop_it_here(finished):
    broken = opened(finished, stop_on_failure=True)
    broken = replace(broken, family=replace(broken.family.family, faults=("agent3:1:raises",)))
    with Store.open(finished) as store, pytest.raises(EpisodeError, match="agent 'agent3'"):
        run_confirmation(StudyRun(broken, store))


def test_the_document_has_the_answer_and_every_candidate_and_the_row_of_the_search_how_much_was_luck(once):
    *_, found = once
    fresh = study_document(found)["best"]["fresh"]
    answer = found.confirmation.answer
    inner = answer.assessment.prpv_interval
    assert (fresh["prpv"], fresh["prpv_interval"]) == (answer.scores[0], [inner.low, inner.high])
    assert fresh["optimism"] == answer.optimism
    assert [one["index"] for one in fresh["candidates"]] == [
        one.trial.number or None for one in found.confirmation.candidates
    ]
    lucky = replace(answer, scores=(int(answer.trial.prpv) + 4,))
    fresh, searched = usefulness_table(replace(found, confirmation=replace(found.confirmation, answer=lucky))).rows[:2]
    assert fresh[:2] == ("PRPV", f"{found.expected.prpv.value.value:.0f}")
    assert "; expected, in " in fresh[3]
    assert searched[:2] == ("  in search", str(found.best.assessment.prpv.value))
    assert searched[3].startswith("4 lower by luck")
    other = replace(found.study, settings=replace(found.study.settings, objective="ppv"))
    (_, *_, luck) = usefulness_table(replace(found, study=other)).rows[1]
    assert luck.startswith("wrongly ordered pairs, 0 to ")
    unlucky = replace(answer, scores=(int(answer.trial.prpv),))
    searched = usefulness_table(replace(found, confirmation=replace(found.confirmation, answer=unlucky))).rows[1]
    assert searched[3].startswith("no optimism")


@pytest.mark.slow
def test_perfect_is_only_what_neither_prpv_nor_any_other_output_tells_from_the_target(finished, monkeypatch):
    study = opened(finished)
    monkeypatch.setattr("proxytune.study.answer._mean_of", lambda *_: [])
    with Store.open(finished) as store:
        for trial in finalists(store.trials(), knowledge_of(StudyRun(study, store), store.trials())):
            plant(study, store, trial, 1.0)
        found = result_of(StudyRun(study, store))
    assert found.judged.prpv.value == 0
    assert found.judged.at_noise_floor is True
    worse = replace(found.expected.ppv, excess=Estimate(0.3, 0.2, 0.4))
    apart = replace(found.confirmation, expected=replace(found.expected, ppv=worse))
    assert (found.perfect, replace(found, confirmation=apart).perfect) == (True, False)
    for inside, fits, perfect in ((True, True, True), (False, True, False), (True, False, False)):
        one = replace(found)
        monkeypatch.setattr(type(found.knowledge), "holds", lambda *_, inside=inside: inside)
        one.knowledge.__dict__["misfit"] = Misfit(1.0, 1.0, 0.5 if fits else 0.01)
        assert one.perfect is perfect, (inside, fits)


@pytest.mark.parametrize(("p_value", "warned"), [(0.01, True), (None, False)])
def test_a_caution_says_not_to_trust_theta_where_no_theta_explains_the_target(finished, monkeypatch, p_value, warned):
    monkeypatch.setattr(Knowledge, "misfit", Misfit(3.0, 1.0, p_value))
    cautions = looked_at(opened(finished)).cautions
    assert any("divided by 3.0); do not trust θ elsewhere" in line for line in cautions) is warned


TRIALS = (
    TrialRecord(1, {"delay": 0.1, "trim": 0.0}, "finished", 4.0, {"prpv": 4, "ppv": None}, failed_episodes=1),
    TrialRecord(2, {"delay": 0.2, "trim": 0.1}, "cut", 12.0, {}, decided=("agent1", "agent0"), bound=9.0),
    TrialRecord(3, {"delay": 0.3, "trim": 0.1}, "failed", None, {}, failed_episodes=3, failure="agent0 failed"),
)


def result(folder, **changes):
    study = open_study(folder)
    study = replace(study, objective=replace(study.objective, **changes))
    return SimpleNamespace(study=study, trials=TRIALS, best=SimpleNamespace(trial=TRIALS[0]))


def test_every_trial_has_its_state_its_value_where_it_was_measured_and_the_objective_its_direction(make_study):
    found = history_of(result(make_study()))
    assert (found.name, found.space.names, found.answer, found.maximise) == ("wobbly", ("delay", "trim"), 0, False)
    assert [(trial.state, trial.value) for trial in found.trials] == [("finished", 4), ("cut", None), ("failed", None)]
    assert [dict(trial.facts) for trial in found.trials] == [
        {"trial": 1, "prpv": 4, "failed_episodes": 1},
        {"trial": 2, "at_least": 9.0, "expected": 12.0, "failed_episodes": 0},
        {"trial": 3, "failed_episodes": 3, "failure": "agent0 failed"},
    ]
    assert history_of(result(make_study(), maximise=True)).maximise


def test_the_best_theta_is_visited_and_not_the_luckiest(finished):
    found = looked_at(open_study(finished))
    assert found.best.trial in found.trials
    assert found.best.assessment.prpv.value == found.best.trial.prpv
    assert found.best.assessment.ppv.value == found.best.trial.ppv
    assert (found.episodes, found.failed_episodes, found.failures) == (7 * 18, 0, ())

    study = open_study(finished)
    with Store.open(finished) as store:
        worst = max(store.trials(), key=lambda trial: trial.prpv)
        near = {name: value + 1e-4 for name, value in worst.theta.items()}
        lucky = TrialRecord(8, near, "finished", 0.0, {"prpv": 0.0})
        StudyRun(study, store).evaluate(near, "")
        store.save_trial(study.identity, lucky)
    assert looked_at(open_study(finished)).best.trial.number not in (8, worst.number)


@pytest.mark.slow
def test_failures_are_counted_and_the_first_are_told(make_study):
    found = run(make_study(domain={"faults": '["agent3:1:raises", "agent2:0:nan"]'}))
    assert found.failed_episodes == 14
    assert len(found.failures) == 10
    assert found.failures[0].startswith("trial 1: agent 'agent2' failed from start 0: ")


@pytest.mark.slow
def test_an_open_trial_does_not_count(finished):
    study = open_study(finished)
    with Store.open(finished) as store:
        store.save_trial(study.identity, TrialRecord(8, {"trim": 0.0, "delay": 0.0}))
    assert len(looked_at(open_study(finished)).trials) == 7


def test_without_a_scored_trial_it_says_so(make_study):
    folder = make_study()
    with Store.open(folder) as store:
        study = open_study(folder)
        with pytest.raises(RunError, match="no trial is finished yet"):
            result_of(StudyRun(study, store))
        store.save_trial(
            study.identity, TrialRecord(1, {"trim": 0.0, "delay": 0.0}, "failed", failure="agent 'x' fell")
        )
        with pytest.raises(RunError, match="all trials failed, the first because agent 'x' fell"):
            result_of(StudyRun(study, store))


@pytest.mark.slow
def test_a_study_can_be_summed_up_from_its_first_trial_on(make_study):
    for budget in ("1", "2"):
        found = run(make_study(budget=budget, initial="1"))
        assert len(found.trials) == int(budget)
        assert found.knowledge.misfit.fits is None
        assert 0.0 < found.knowledge.posterior.share <= 1.0
        assert found.knowledge.as_good[0] >= 0.0


def test_the_nominal_theta_of_a_family_that_tells_none_is_neutral_where_it_follows_no_model(make_study):
    study = open_study(make_study())
    neutral = {"trim": 0.0, "delay": 0.0}
    assert nominal_theta(study) is None, "it says that it has none"
    parameters = {**study.family.parameters, "trim": replace(study.family.parameters["trim"], neutral="wheel_radius")}
    for nominal, expected in ((None, neutral), ((("trim", 1.0),), neutral), ({"trim": 0.1}, None)):
        family = SimpleNamespace(parameters=study.family.parameters, nominal=nominal)
        assert nominal_theta(replace(study, family=family)) == expected
    assert nominal_theta(replace(study, family=SimpleNamespace(parameters=parameters))) is None
    family = SimpleNamespace(parameters=study.family.parameters)
    assert nominal_theta(replace(study, family=family)) == neutral
    held = replace(study.settings, proxy=study.settings.folder / "model.toml")
    assert nominal_theta(replace(study, settings=held, family=family)) is None, "the model may hold others"
