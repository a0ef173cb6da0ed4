"""The answer of a study that has been run: what a sweep holds the other parameters at."""

from proxytune.errors import InputError, SettingsError
from proxytune.space import Theta
from proxytune.storage.database import is_begun
from proxytune.storage.store import FILE_NAME, Store
from proxytune.study.result import result_of
from proxytune.study.run import stored_run
from proxytune.study.settings import LEARNING
from proxytune.study.study import Study


def has_answer(study: Study) -> bool:
    """Whether a trial of the study's search by predictivity is finished; a search for PLV has its answer elsewhere."""
    if study.settings.objective == LEARNING or not is_begun(study.settings.home / FILE_NAME):
        return False
    with Store.read(study.settings.home) as store:
        return any(trial.state == "finished" for trial in store.trials(study.objective.name))


def best_theta(study: Study, option: str = "--at") -> Theta:
    """The best θ that the study has found so far; the option that asks for it is named in complaints.

    Raises:
        InputError: If no trial is finished, or the study was changed since.
    """
    if not has_answer(study):
        folder = study.settings.home
        raise InputError(f"{folder}: has no finished trial; run it first (python -m proxytune study {folder})")
    with Store.read(study.settings.home) as store:
        try:
            run = stored_run(study, store)
        except SettingsError as problem:
            raise InputError(f"{problem}; or hold other values: {option} nominal") from None
        return dict(result_of(run).best.trial.theta)
