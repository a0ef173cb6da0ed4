"""A study's trials, run in this process, and what came of them."""

from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

from proxytune.running import Silent
from proxytune.search import make_proposer
from proxytune.storage import Store
from proxytune.study import StudyRun, check_facts, goal_of, open_study, result_of, run_trials


def changed(folder, **changes):
    """The study in a folder, with changes of its settings."""
    study = open_study(folder)
    return replace(study, settings=replace(study.settings, **changes))


def searched(study, watcher=None):
    """Run a study's trials, as far as its watcher lets it: what it cost, and the trials."""
    with Store.open(study.settings.folder) as store:
        proposer = make_proposer(study.settings.engine, study.settings.initial, goal_of(StudyRun(study, store)))
        run = StudyRun(study, store, watcher or Silent())
        check_facts(run)
        run_trials(run, proposer)
        return run.spent, store.trials()


def looked_at(study):
    """What came of a study, looked at without a simulation."""
    with Store.read(study.settings.folder) as store:
        return result_of(StudyRun(study, store))


def run(folder):
    """What came of the study in a folder, whose trials are run now."""
    searched(open_study(folder))
    return looked_at(open_study(folder))


@contextmanager
def running(study):
    """The run of a study, or of the study in a folder."""
    study = open_study(study) if isinstance(study, Path) else study
    with Store.open(study.settings.folder) as store:
        yield StudyRun(study, store)
