"""What finished trials were: the episodes they stand on, and how the search sees them."""

from collections.abc import Sequence

from proxytune.domain import Episode
from proxytune.errors import RunError
from proxytune.search.proposer import Trial
from proxytune.space import Space
from proxytune.storage.records import TrialRecord
from proxytune.storage.store import Store
from proxytune.study.evaluation import plan
from proxytune.study.settings import StudySettings


def as_trials(space: Space, done: Sequence[TrialRecord]) -> list[Trial]:
    """Finished trials as the search sees them; of one that was cut off, the estimate stands for the score."""
    return [Trial(space.values(trial.theta), trial.score) for trial in done]


def episodes_of(settings: StudySettings, trial: TrialRecord) -> list[Episode]:
    """The episodes that a trial stands on: all, or those of the agents decided before it was cut off."""
    planned = plan(settings, trial.theta, settings.seed)
    return [episode for episode in planned if not trial.decided or episode.agent in trial.decided]


def lacks_episodes(store: Store, trial: TrialRecord) -> RunError:
    """What to say where a finished trial's episodes are not in the store."""
    return RunError(f"{store.path}: lacks episodes of trial {trial.number}; move it away and run the study again")
