"""A study's objective is a measure that it names: PRPV, PPV, or one of one's own; anything else is refused."""

import numpy as np
import pytest

from proxytune.errors import SettingsError
from proxytune.report.study.usefulness_table import objective_rows, usefulness_rows
from proxytune.search.engines.registry import make_proposer
from proxytune.storage.store import Store
from proxytune.study.knowledge import goal_of
from proxytune.study.objective import PRPV
from proxytune.study.result import result_of
from proxytune.study.run import run_study
from proxytune.study.stages.confirmation import run_confirmation
from proxytune.study.study import open_study
from proxytune.study.study_run import StudyRun

OWN = """
import numpy as np
from proxytune import Measure

def nearness(proxy, target, metrics):
    return -np.abs(proxy - target).max(axis=(-2, -1))

NEARNESS = Measure(key="nearness", name="nearness", title="largest error of a mean, less than 0", better="higher",
                   meaning="up to 0", digits=".3g", on_means=nearness)
"""


def run(folder, engine):
    study = open_study(folder)
    with Store.open(folder) as store:
        study_run = StudyRun(study, store)
        run_study(study_run, make_proposer(engine, study.settings.initial, goal_of(study_run)))
        return study_run, result_of(study_run)


@pytest.fixture
def own(make_study):
    """A study that makes its own measure large."""

    def make(**changes):
        folder = make_study(objective='"mine:NEARNESS"', **changes)
        (folder / "mine.py").write_text(OWN)
        return folder

    return make


@pytest.mark.parametrize("engine", ["gp", "outcomes"])
def test_a_measure_of_one_s_own_is_made_large_and_kept_with_every_trial(own, engine):
    study_run, result = run(own(engine=f'"{engine}"'), engine)
    values = [trial.measures["mine:NEARNESS"] for trial in result.trials]
    assert [trial.score for trial in result.trials] == [-value for value in values]
    for trial, value in zip(result.trials, values, strict=True):
        proxy = study_run.evaluation_of(trial).proxy.arrange(agents=study_run.study.target.agents)
        assert (
            value
            == -np.abs(proxy.select(study_run.study.target.metrics[:2]).means - study_run.study.target.means).max()
        )
    assert max(values[5:]) > max(values[:5]), "the search gets nearer than its design"
    assert all(set(trial.measures) == {"mine:NEARNESS", "prpv", "ppv"} for trial in result.trials)


def test_its_value_is_told_in_the_search_and_on_fresh_episodes(own):
    folder = own(confirm="1")
    study_run, _ = run(folder, "gp")
    with Store.open(folder) as store:
        again = StudyRun(study_run.study, store)
        run_confirmation(again)
        result = result_of(again)
    searched, fresh = objective_rows(result)
    best = result.best.trial.measures["mine:NEARNESS"]
    assert searched[:2] == ("nearness", f"{best:.4g}")
    assert fresh[1] == f"{-result.confirmation.answer.scores[0]:.4g}"
    assert usefulness_rows(result)[0] == searched


def test_ppv_is_an_objective_too(make_study):
    _, result = run(make_study(objective='"ppv"'), "gp")
    assert [trial.score for trial in result.trials] == [trial.ppv for trial in result.trials]


def test_no_trial_is_cut_off_by_another_objective_than_prpv(own):
    _, result = run(own(cut_off="true", budget="9"), "gp")
    assert {trial.state for trial in result.trials} == {"finished"}


def test_another_objective_is_another_study(own, make_study):
    folder = own()
    run(folder, "gp")
    make_study(objective='"prpv"')
    with pytest.raises(SettingsError, match="changed since the first trial: objective"):
        run(folder, "gp")


def test_a_study_of_learning_value_is_narrowed_by_prpv(make_study):
    assert open_study(make_study(objective='"plv"')).objective == PRPV


BAD = {
    "no such measure": ('"prvp"', "objective: unknown measure 'prvp' .*; did you mean 'prpv'"),
    "one value per metric": ('"srcc"', "objective: unknown measure 'srcc' .*; known are: plv, ppv, prpv"),
    "no such name in the module": ('"mine:OTHER"', "measure 'mine:OTHER': mine has no 'OTHER'"),
    "no measure": ('"mine:np"', "measure 'mine:np' is a module; make it a proxytune.Measure"),
    "no such module": ('"nowhere:X"', "measure 'nowhere:X': no module 'nowhere'"),
}


ENGINES = {
    "an unknown engine": ('"tpr"', "engine: unknown engine 'tpr' .*; did you mean 'tpe'"),
    "an engine for comparison only": ('"skopt"', "engine: 'skopt' is for `compare` only; known are: composite, gp"),
    "no engine": ('"mine:nearness"', "engine 'mine:nearness' is a function; make it a proxytune"),
}


@pytest.mark.parametrize(
    ("key", "case"), [*(("objective", case) for case in BAD), *(("engine", case) for case in ENGINES)]
)
def test_what_is_no_objective_or_engine_of_a_study_is_one_line_with_file_and_key(make_study, key, case):
    name, expected = {"objective": BAD, "engine": ENGINES}[key][case]
    folder = make_study(**{key: name})
    (folder / "mine.py").write_text(OWN)
    with pytest.raises(SettingsError, match=expected) as caught:
        open_study(folder)
    assert f"study.toml: {key}: " in str(caught.value)
    assert "\n" not in str(caught.value)


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
    with pytest.raises(SettingsError, match=f"study.toml: objective: measure 'mine:WRONG' {WRONG[formula]}") as told:
        open_study(folder)
    assert "\n" not in str(told.value)
