"""A family whose code is corrected between two runs: what failed is tried again, what worked is not."""

import sqlite3

import pytest
from stopping import Stopping

from proxytune.api.study import run_study
from proxytune.errors import RunError
from proxytune.storage import Store
from proxytune.study import StudyRun, open_study
from proxytune.study.run import retry_failed

FAMILY = """
from wobbly import Wobbly, wobbly


class Mine(Wobbly):
    def run(self, episode):
        {fault}
        return super().run(episode)


def make(domain, *, model):
    return Mine(**vars(wobbly(domain, model=model)))
"""


@pytest.fixture
def edited(make_study, tmp_path):
    """The study with this fault in its family, under a name that no process has imported yet."""
    number = iter(range(100))
    journal = tmp_path / "journal"

    def edit(fault, **changes):
        name = f"mine_{next(number)}"
        folder = make_study(family='"mine:make"', domain={"journal": f'"{journal}"'}, budget="5", **changes)
        for old in folder.glob("mine*.py"):
            old.unlink()
        (folder / "mine.py").write_text(f"from {name} import make\n")
        (folder / f"{name}.py").write_text(FAMILY.format(fault=fault))
        forget(folder)
        return folder

    return edit


def forget(folder):
    """Let the next study import the module afresh, as another process would."""
    import sys

    for name in [name for name in sys.modules if name.startswith("beside_study_") and name.endswith(".mine")]:
        del sys.modules[name]


def test_all_failing_alike_stops_the_study_in_its_first_trial_and_once_corrected_it_runs(edited):
    broken = edited("raise KeyError('mass')")
    for _ in range(2):
        with pytest.raises(RunError, match=r"^the domain family raised KeyError: 'mass' \(mine_0.py, line 7\); every"):
            run_study(broken)
    with sqlite3.connect(broken / "study.db") as plain:
        assert plain.execute("SELECT count(*), sum(failure IS NOT NULL) FROM episodes").fetchone() == (18, 18)
    report = run_study(edited("pass"))
    assert [trial.state for trial in report.result.trials] == ["finished"] * 5
    assert report.spent.episodes == 5 * 18


AGENT3 = "if episode.agent == 'agent3': raise KeyError('mass')"


def test_failures_of_changed_code_are_driven_again_and_only_these(edited):
    with pytest.raises(RunError, match="all trials failed"):
        run_study(edited(AGENT3))
    report = run_study(edited("pass"))
    assert report.spent.episodes == 5 * 3
    assert [trial.state for trial in report.result.trials] == ["finished"] * 5
    assert {trial.failed_episodes for trial in report.result.trials} == {0}
    assert run_study(edited("pass")).spent.episodes == 0


@pytest.mark.slow
def test_failures_of_the_same_code_are_remembered_until_all_are_to_be_retried(edited):
    folder = edited("if (episode.agent, episode.start) == ('agent3', 1): raise KeyError('mass')")
    assert run_study(folder).spent.episodes == 5 * 18
    (folder / "mine.py").write_text((folder / "mine.py").read_text() + "# a comment changes nothing\n")
    assert run_study(folder).spent.episodes == 0
    again = run_study(folder, retry_failed=True)
    assert again.spent.episodes == 5
    assert {trial.failed_episodes for trial in again.result.trials} == {1}
    assert run_study(folder).spent.episodes == 0


@pytest.mark.slow
@pytest.mark.parametrize("episodes", [1, 3])
def test_a_retry_that_is_stopped_within_a_trial_or_just_before_it_is_kept_goes_on_to_the_same_trials(edited, episodes):
    with pytest.raises(RunError, match="all trials failed"):
        run_study(edited(AGENT3))
    folder = edited("pass")
    with Store.open(folder) as store, pytest.raises(KeyboardInterrupt):
        retry_failed(StudyRun(open_study(folder), store, Stopping(episodes)))
    report = run_study(folder)
    assert report.spent.episodes == 5 * 3 - episodes
    assert [trial.state for trial in report.result.trials] == ["finished"] * 5
    assert {trial.failed_episodes for trial in report.result.trials} == {0}
