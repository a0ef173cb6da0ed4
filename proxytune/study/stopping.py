"""When a study ends, before or with its budget: a function of what is stored, so nothing need be remembered."""

from collections.abc import Sequence

from proxytune.search.engines.composite import expected_gain
from proxytune.search.engines.gaussian_process import expected_improvement
from proxytune.search.engines.registry import WITH_OUTPUTS
from proxytune.search.proposer import batch_at
from proxytune.storage.records import TrialRecord
from proxytune.storage.store import Store
from proxytune.study.evaluation import plan
from proxytune.study.history import as_trials
from proxytune.study.outputs import goal_of, trials_of
from proxytune.study.settings import StudySettings
from proxytune.study.study import Study

FILE_REMEDY = "raise or remove it to continue"


def stopped(study: Study, store: Store, done: Sequence[TrialRecord]) -> str:
    """Why a study with these finished trials runs no further, in one phrase; empty while it goes on.

    Only finished trials and the time of their own episodes count, never the clock of this process: a study that was
    stopped stays so when it is run again, and without the rule it goes on to the trials it would have had anyway. Rules
    are asked where a batch has ended: a budget that cut one short has no say in what they would have said of the whole.
    """
    settings = study.settings
    if len(done) >= settings.budget:
        kept = f"; all {len(done)} that are finished count" if len(done) > settings.budget else ""
        return f"the budget of {settings.budget} trials is spent{kept}"
    if batch_at(len(done), settings.batch, settings.initial).start < len(done):
        return ""
    return _out_of_time(settings, store, done) or _nothing_to_gain(study, store, done)


def _out_of_time(settings: StudySettings, store: Store, done: Sequence[TrialRecord]) -> str:
    limit = settings.stop.wall_time_s
    if limit is None:
        return ""
    seeds = {episode.seed for episode in plan(settings, {}, settings.seed)}
    seconds = store.seconds_of_trials(len(done), seeds) / settings.jobs
    if seconds < limit:
        return ""
    return f"episodes took {seconds:.3g} s and stop.wall_time_s is {limit:g}; {FILE_REMEDY}"


def _nothing_to_gain(study: Study, store: Store, done: Sequence[TrialRecord]) -> str:
    settings = study.settings
    limit = settings.stop.no_improvement
    if limit is None or len(done) < settings.initial or all(trial.prpv is None for trial in done):
        return ""
    gain, noise = _gain(study, store, done)
    if gain >= limit * noise:
        return ""
    return (
        f"no θ is expected to lower PRPV by more than {gain:.2g}; its noise is {noise:.2g} and"
        f" stop.no_improvement is {limit:g}; lower or remove it to continue"
    )


def _gain(study: Study, store: Store, done: Sequence[TrialRecord]) -> tuple[float, float]:
    """The most that any θ is expected to improve PRPV, and its noise, as the study's engine sees it."""
    settings = study.settings
    if settings.engine in WITH_OUTPUTS:
        return expected_gain(settings.space, trials_of(study, store, done), goal_of(study, store), settings.seed)
    return expected_improvement(settings.space, as_trials(settings.space, done), settings.seed)
