"""A study's objective and its target's table, as people have it; anything else is refused."""

import re

import numpy as np
import pytest
from one_line import complaint_of
from searched import run

from proxytune.api import drive
from proxytune.errors import InputError
from proxytune.report.study.page import usefulness_table
from proxytune.scores import Metric, ScoreTable
from proxytune.storage import Store
from proxytune.study import PRPV, StudyRun, open_study, result_of, study_facts
from proxytune.study.answer import run_confirmation
from proxytune.study.facts import changes
from proxytune.study.study_run import compose_of

OWN = """
import numpy as np
from proxytune import Measure

def nearness(proxy, target, metrics):
    return -np.abs(proxy - target).max(axis=(-2, -1))

NEARNESS = Measure(key="nearness", name="nearness", title="largest error of a mean, less than 0", better="higher",
                   meaning="up to 0", digits=".3g", on_means=nearness)
"""


@pytest.fixture
def own(make_study):
    """A study that makes its own measure large."""

    def make(**changes):
        folder = make_study(objective='"mine:NEARNESS"', **changes)
        (folder / "mine.py").write_text(OWN)
        return folder

    return make


@pytest.mark.parametrize("engine", [pytest.param("gp", marks=pytest.mark.slow), "outcomes"])
def test_a_measure_of_one_s_own_is_made_large_and_kept_with_every_trial(own, engine):
    folder = own(engine=f'"{engine}"')
    result = run(folder)
    values = [trial.measures["mine:NEARNESS"] for trial in result.trials]
    assert [trial.score for trial in result.trials] == [-value for value in values]
    target = result.study.target
    with Store.read(folder) as store:
        for trial, value in zip(result.trials, values, strict=True):
            proxy = StudyRun(result.study, store).evaluation_of(trial).proxy.arrange(agents=target.agents)
            assert value == -np.abs(proxy.select(target.metrics[:2]).means - target.means).max()
    assert max(values[5:]) > max(values[:5]), "the search gets nearer than its design"
    assert all(set(trial.measures) == {"mine:NEARNESS", "prpv", "ppv"} for trial in result.trials)


def test_where_a_measure_of_one_s_own_is_undefined_no_theta_is_better_than_the_worst(own):
    folder = own(confirm="1", engine='"outcomes"', budget="6")
    distance = "np.abs(proxy - target).max(axis=(-2, -1))"
    (folder / "mine.py").write_text(OWN.replace(f"-{distance}", f"np.where({distance} < 0.5, np.nan, -{distance})"))
    study = run(folder).study
    means = study.target.means.ravel()
    assert compose_of(study)(np.stack([means, means + 1.0, means + 2.0])).tolist() == pytest.approx([2.0, 1.0, 2.0])


@pytest.mark.slow
def test_its_value_is_told_in_the_search_and_on_fresh_episodes(own):
    folder = own(confirm="1")
    run(folder)
    with Store.open(folder) as store:
        again = StudyRun(open_study(folder), store)
        run_confirmation(again)
        result = result_of(again)
    searched, fresh = usefulness_table(result).rows[:2]
    best = result.best.trial.measures["mine:NEARNESS"]
    assert searched[:2] == ("nearness", f"{best:.4g}")
    assert fresh[1] == f"{-np.mean(result.confirmation.answer.scores):.4g}"
    assert searched[3] == "the objective, in the search's own episodes"


@pytest.mark.slow
def test_ppv_is_an_objective_too(make_study):
    result = run(make_study(objective='"ppv"'))
    assert [trial.score for trial in result.trials] == [trial.ppv for trial in result.trials]


@pytest.mark.slow
def test_no_trial_is_cut_off_by_another_objective_than_prpv(own):
    assert {trial.state for trial in run(own(cut_off="true", budget="9")).trials} == {"finished"}


BAD = {
    "no such measure": ('"prvp"', "objective: unknown measure 'prvp' .*; did you mean 'prpv'"),
    "one value per metric": ('"srcc"', "objective: unknown measure 'srcc' .*; known are: plv, ppv, prpv"),
    "no such name in the module": ('"mine:OTHER"', "measure 'mine:OTHER': mine has no 'OTHER'"),
    "no measure": ('"mine:np"', "measure 'mine:np' is a module; make it a proxytune.Measure"),
    "no such module": ('"nowhere:X"', "measure 'nowhere:X': no module 'nowhere'"),
}


ENGINES = {
    "an unknown engine": ('"tpr"', "engine: unknown engine 'tpr' .*; did you mean 'tpe'"),
    "an engine for comparison only": (
        '"compared_engines:SKOPT"',
        "'compared_engines:SKOPT' is for `compare` only; known are: composite, gp",
    ),
    "no engine": ('"mine:nearness"', "engine 'mine:nearness' is a function; make it a proxytune"),
}


@pytest.mark.parametrize(
    ("key", "case"), [*(("objective", case) for case in BAD), *(("engine", case) for case in ENGINES)]
)
def test_what_is_no_objective_or_engine_of_a_study_is_one_line_with_file_and_key(make_study, key, case):
    name, expected = {"objective": BAD, "engine": ENGINES}[key][case]
    folder = make_study(**{key: name})
    (folder / "mine.py").write_text(OWN)
    told = complaint_of(open_study, folder)
    assert f"study.toml: {key}: " in told
    assert re.search(expected, told)


WRONG = {
    "np.abs(proxy - target).mean(axis=-1)": r"gives values \(4, 3\) of means \(4, 3, 2\); give one for each table",
    "1 / 0": r"raised Zero.*: division by zero \(mine.py, line 7\) for means \(4, 3, 2\) against \(3, 2\); correct it",
    "'high'": "raised ValueError: could not convert string to float",
}


@pytest.mark.parametrize("formula", WRONG)
def test_what_a_measure_of_one_s_own_does_wrong_is_told_with_file_and_key_before_any_episode(make_study, formula):
    folder = make_study(objective='"mine:WRONG"')
    (folder / "mine.py").write_text(
        "import numpy as np\n\nfrom proxytune import Measure\n\n\n"
        f"def wrong(proxy, target, metrics):\n    return {formula}\n\n\n"
        'WRONG = Measure("wrong", "Wrong", "wrong", "lower", "", ".2f", on_means=wrong)\n'
    )
    expected = f"study.toml: objective: measure 'mine:WRONG' {WRONG[formula]}"
    assert re.search(expected, complaint_of(open_study, folder))


def test_a_measure_of_one_s_own_that_writes_into_the_means_leaves_prpv_and_ppv_as_they_are(own):
    folders = own(), own(called="writes")
    writes = "    proxy -= target\n    target -= target\n    return"
    (folders[1] / "mine.py").write_text(OWN.replace("    return", writes))
    values = []
    for study in map(open_study, folders):
        scores = {(agent, "0"): {"distance": place} for place, agent in enumerate(study.settings.agents)}
        proxy, metrics = ScoreTable.from_episodes(scores), [Metric("distance")]
        values.append(study.objective.measure(proxy=proxy, target=study.target, metrics=metrics))
    assert values[0] == values[1]


STUDY_OPENING_BAD = {
    "all agents but one are missing": (
        lambda text: "\n".join(line for line in text.splitlines() if line.startswith(("agent,", "agent4"))),
        "target.csv: has no scores of agent0, agent1, agent2, agent3, agent5; add them, or take them out of the study",
    ),
    "a metric is missing": (lambda text: text.replace("survival_time", "survival"), "no column 'survival_time'"),
}


@pytest.mark.parametrize(("edit", "expected"), STUDY_OPENING_BAD.values(), ids=STUDY_OPENING_BAD)
def test_a_target_that_does_not_fit_is_refused_in_one_line(make_study, edit, expected):
    target = make_study() / "target.csv"
    target.write_text(edit(target.read_text()))
    assert expected in complaint_of(open_study, target.parent)


def test_the_engine_is_a_fact_unless_there_was_no_choice_and_rules_to_stop_and_orders_are_none(make_study):
    """Trials of then stay valid."""
    before, other = study_facts(open_study(make_study())), study_facts(open_study(make_study(engine=None)))
    assert "engine" not in before
    assert changes(before, other) == ['engine (was "gp")']
    assert changes(other, before) == ['engine (was "outcomes")']
    plain = study_facts(open_study(make_study()))
    assert study_facts(open_study(make_study(stop="{ wall_time_s = 5, no_improvement = 0.1 }"))) == plain
    one = study_facts(open_study(make_study()))
    agents = '["agent5", "agent4", "agent3", "agent2", "agent1", "agent0"]'
    other = study_facts(open_study(make_study(agents=agents, metrics='["survival_time:max", "distance:max"]')))
    assert one == other
    assert changes(one, other) == []


def test_what_the_search_learns_from_is_a_fact(make_study):
    """Of an engine that learns from outputs these are the whole table and the pre-flight's noise."""
    target = make_study() / "target.csv"
    alone = {"metrics": '["survival_time:max"]', "engine": '"outcomes"'}
    plain = study_facts(open_study(make_study(**alone)))
    assert changes(plain, study_facts(open_study(make_study(preflight="true", **alone)))) == ["preflight (was false)"]
    by_score = {**alone, "engine": '"gp"'}
    score = study_facts(open_study(make_study(**by_score)))
    target.write_text(target.read_text().replace("agent2,1,", "agent2,1,9"))
    assert changes(plain, study_facts(open_study(make_study(**alone)))) == ["target (its contents)"]
    assert study_facts(open_study(make_study(**by_score))) == score


def test_the_truth_is_read_but_nothing_depends_on_it_and_learning_value_is_narrowed_by_prpv(make_study):
    plain = open_study(make_study())
    (make_study() / "truth.toml").write_text('format = 1\nrobot = "duckiebot"\n[effects.trim]\ntrim = 0.1\n')
    told = open_study(make_study(truth='"truth.toml"'))
    assert (plain.truth, told.truth) == (None, {"trim": 0.1})
    assert study_facts(plain) == study_facts(told)
    assert "truth: no such file" in complaint_of(open_study, make_study(truth='"untruth.toml"'))
    assert open_study(make_study(objective='"plv"')).objective == PRPV


def test_starts_of_both_sides_are_compared_and_others_left_out(make_study, rows):
    """So that both sides drive from the same starts; where it lacks one of them, all its episodes count."""
    whole = open_study(make_study())
    fewer = open_study(make_study(starts="2"))
    assert (whole.target.episodes, fewer.target.episodes) == (("0", "1", "2"), ("0", "1"))
    assert fewer.target.means.tolist() == whole.target.values[:, :2].mean(axis=1).tolist()
    assert open_study(make_study(starts="5")).target.episodes == ("0", "1", "2")
    folder = make_study(target='"real.csv"')
    write(folder, real=[HEAD, *rows, *(f"agent{number},17,1,2" for number in range(6))])
    study = open_study(folder)
    assert "17" not in study.target.episodes
    (line,) = [one for one in study.cautions if "taken for this study's starts" in one]
    assert "and 1 of others are left out; raise starts to use them" in line


def test_only_what_both_sides_have_is_compared_and_what_is_left_out_is_named(make_study, rows):
    folder = make_study(target='"real.csv"')
    write(folder, real=[HEAD, *(row for row in rows if "agent5" not in row), "human,0,1,2", "human,1,1,2"])
    study = open_study(folder)
    assert study.settings.agents == tuple(f"agent{number}" for number in range(5))
    assert study.cautions[:2] == (
        "the target has no scores of agent5: left out",
        "the target has scores of human, no agents of this study: left out",
    )

    folder = make_study(agents='["agent5", "agent1"]')
    with open(folder / "target.csv", "a") as target:
        target.write("agent77,only_its_own,1.0,2.0\n")
    study = open_study(folder)
    assert study.target.agents == ("agent5", "agent1")
    assert study.target.episodes == ("0", "1", "2")
    assert study.target.complete


HEAD = "agent,episode,distance,survival_time"


@pytest.fixture
def rows(make_study):
    """The rows of the target of a study, which is there from now on."""
    return (make_study() / "target.csv").read_text().splitlines()[1:]


def write(folder, **files):
    for name, lines in files.items():
        (folder / f"{name}.csv").write_text("\n".join(lines) + "\n")


def test_targets_of_several_files_and_names_are_as_one_and_where_none_agrees_a_table_is_the_remedy(make_study, rows):
    whole = open_study(make_study())
    folder = make_study(target='["monday.csv", "tuesday.csv"]')
    write(folder, monday=[HEAD, *rows[:7]], tuesday=[HEAD, *rows[7:]])
    assert study_facts(open_study(folder)) == study_facts(whole)
    columns = '{ agent = "policy", episode = "trial", distance = "dist_m" }'
    folder = make_study(target='"real.csv"', target_columns=columns)
    european = [row.replace(",", ";").replace(".", ",") for row in rows]
    write(folder, real=["policy;trial;dist_m;survival_time", *european])
    assert study_facts(open_study(folder)) == study_facts(whole)
    make_study(target='"real.csv"', target_columns='{ agent = "polcy" }')
    assert "no column 'agent'; columns found: policy, trial, dist_m, survival_time" in complaint_of(open_study, folder)
    folder = make_study(target='"real.csv"')
    write(folder, real=[HEAD, *(row.replace("agent", "a") for row in rows)])
    with pytest.raises(InputError, match=r"its agents are a0, a1.*by a table \[agents\] in study.toml: a0 = 'agent0'"):
        open_study(folder)


@pytest.mark.parametrize(
    ("target", "says"),
    [
        ("[]", "target: must be text"),
        ("3", "target: must be text"),
        ("[3]", "list of texts"),
        ('"nowhere.csv"', "nowhere.csv: no such file"),
    ],
)
def test_a_target_of_another_kind_or_none_is_refused(make_study, target, says):
    assert says in complaint_of(open_study, make_study(target=target))


READS = """
from pathlib import Path

from wobbly import Wobbly, wobbly


class Reads(Wobbly):
    def truth(self, model):
        return {"trim": float(Path(model).read_text()), "else": VALUE}


def make(domain, *, model):
    return Reads()
"""


def test_the_truth_of_a_family_of_one_s_own_is_what_its_method_reads_and_without_one_that_is_said(make_study):
    folder = make_study(truth='"truth.toml"')
    (folder / "truth.toml").write_text("trim = 0.1\n")
    told = complaint_of(open_study, folder)
    assert "study.toml: truth: " in told
    assert "truth.toml: trim: unknown key" in told
    assert (
        "wobbly:wobbly has no method truth(model), so truth.toml can hold effects alone; add one that gives θ" in told
    )
    told = complaint_of(drive, folder, "agent0", str(folder / "truth.toml"))
    assert told.startswith("theta ")
    assert "wobbly:wobbly has no method truth(model)" in told
    for number, (value, expected) in enumerate({"2": None, "'high'": "gives no number for 'else'"}.items()):
        folder = make_study(truth='"truth.txt"', family=f'"reads_{number}:make"')
        (folder / f"reads_{number}.py").write_text(READS.replace("VALUE", value))
        (folder / "truth.txt").write_text("0.1")
        if expected:
            assert expected in complaint_of(open_study, folder)
        else:
            assert open_study(folder).truth == {"trim": 0.1}
    (folder / "truth.txt").write_text("no number")
    assert "truth of reads_1:make raised ValueError" in complaint_of(open_study, folder)
