import pytest

from proxytune.errors import InputError
from proxytune.storage.store import Store
from proxytune.study.result import result_of
from proxytune.study.study import changes, facts, open_study
from proxytune.study.study_run import StudyRun

BAD = {
    "all agents but one are missing": (
        lambda text: "\n".join(line for line in text.splitlines() if line.startswith(("agent,", "agent4"))),
        "target.csv: has no scores of agent0, agent1, agent2, agent3, agent5; add them, or take them out of the study",
    ),
    "a value is NaN": (lambda text: text.replace("agent2,1,", "agent2,1,nan,#"), "line"),
    "a metric is missing": (lambda text: text.replace("survival_time", "survival"), "no column 'survival_time'"),
    "it is empty": (lambda text: "", "target.csv: is empty"),
}


@pytest.mark.parametrize("case", BAD)
def test_a_target_that_does_not_fit_is_refused_in_one_line(make_study, case):
    edit, expected = BAD[case]
    target = make_study() / "target.csv"
    target.write_text(edit(target.read_text()))
    with pytest.raises(InputError) as told:
        open_study(target.parent)
    assert expected in str(told.value)
    assert "\n" not in str(told.value)


def test_a_missing_target_is_named(make_study):
    folder = make_study(target='"nowhere.csv"')
    with pytest.raises(InputError, match=r"nowhere\.csv: no such file"):
        open_study(folder)


def test_agents_of_the_target_that_are_not_in_the_study_do_not_count(make_study):
    folder = make_study(agents='["agent5", "agent1"]')
    with open(folder / "target.csv", "a") as target:
        target.write("agent77,only_its_own,1.0,2.0\n")
    study = open_study(folder)
    assert study.target.agents == ("agent5", "agent1")
    assert study.target.episodes == ("0", "1", "2")
    assert study.target.complete


def test_the_engine_is_a_fact_but_that_of_before_there_was_a_choice_goes_without_saying(make_study):
    """Trials of then stay valid."""
    before, other = facts(open_study(make_study())), facts(open_study(make_study(engine=None)))
    assert "engine" not in before
    assert changes(before, other) == ['engine (was "gp")']
    assert changes(other, before) == ['engine (was "outcomes")']


def test_what_the_search_learns_from_is_a_fact(make_study):
    """Of an engine that learns from outputs these are the whole table and the pre-flight's noise."""
    target = make_study() / "target.csv"
    alone = {"metrics": '["survival_time:max"]', "engine": '"outcomes"'}
    plain = facts(open_study(make_study(**alone)))
    assert changes(plain, facts(open_study(make_study(preflight="true", **alone)))) == ["preflight (was false)"]
    by_score = {**alone, "engine": '"gp"'}
    score = facts(open_study(make_study(**by_score)))
    target.write_text(target.read_text().replace("agent2,1,", "agent2,1,9"))
    assert changes(plain, facts(open_study(make_study(**alone)))) == ["target (its contents)"]
    assert facts(open_study(make_study(**by_score))) == score


def test_rules_to_stop_are_no_facts(make_study):
    plain = facts(open_study(make_study()))
    assert facts(open_study(make_study(stop="{ wall_time_s = 5, no_improvement = 0.1 }"))) == plain


def test_the_order_of_agents_and_lines_is_no_fact(make_study):
    one = facts(open_study(make_study()))
    agents = '["agent5", "agent4", "agent3", "agent2", "agent1", "agent0"]'
    metrics = '["survival_time:max", "distance:max"]'
    other = facts(open_study(make_study(agents=agents, metrics=metrics)))
    assert one == other
    assert changes(one, other) == []


def test_agents_that_the_target_lacks_are_left_out_and_named(finished):
    target = finished / "target.csv"
    kept = [line for line in target.read_text().splitlines() if not line.startswith(("agent4", "agent5"))]
    target.write_text("\n".join(kept) + "\n")
    study = open_study(finished)
    assert study.settings.agents == study.target.agents == ("agent0", "agent1", "agent2", "agent3")
    with Store.read(finished) as store:
        cautions = result_of(StudyRun(study, store)).cautions
    assert "the target has no scores of agent4, agent5: left out" in cautions


def test_the_truth_is_read_but_nothing_depends_on_it(make_study):
    plain = open_study(make_study())
    (make_study() / "truth.toml").write_text('format = 1\nrobot = "duckiebot"\n[effects.trim]\ntrim = 0.1\n')
    told = open_study(make_study(truth='"truth.toml"'))
    assert (plain.truth, told.truth) == (None, {"trim": 0.1})
    assert facts(plain) == facts(told)
    with pytest.raises(InputError, match="truth: no such file"):
        open_study(make_study(truth='"untruth.toml"'))


def test_of_a_target_with_more_starts_the_study_s_own_are_compared(make_study):
    """So that both sides drive from the same starts; where it lacks one of them, all its episodes count."""
    whole = open_study(make_study())
    fewer = open_study(make_study(starts="2"))
    assert (whole.target.episodes, fewer.target.episodes) == (("0", "1", "2"), ("0", "1"))
    assert fewer.target.means.tolist() == whole.target.values[:, :2].mean(axis=1).tolist()
    assert open_study(make_study(starts="5")).target.episodes == ("0", "1", "2")
