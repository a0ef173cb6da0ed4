"""When a study ends, before or with its budget: a function of what is stored, so nothing need be remembered."""

from collections.abc import Sequence

from proxytune.search.engines.composite import expected_gain
from proxytune.search.engines.gaussian_process import expected_improvement
from proxytune.search.proposer import batch_at
from proxytune.storage.records import TrialRecord
from proxytune.study.evaluation import plan
from proxytune.study.knowledge import goal_of
from proxytune.study.outputs import score_trials
from proxytune.study.stop_rules import StopRules
from proxytune.study.study_run import StudyRun

FILE_REMEDY = "raise or remove it to continue"


def stopped(run: StudyRun, done: Sequence[TrialRecord]) -> str:
    """Why a study with these finished trials runs no further, in one phrase; empty while it goes on.

    Only finished trials and the time of their own episodes count, never the clock of this process: a study that was
    stopped stays so when it is run again, and without the rule it goes on to the trials it would have had anyway. Rules
    are asked where a batch has ended: a budget that cut one short has no say in what they would have said of the whole.
    """
    settings = run.settings
    if len(done) >= settings.budget:
        kept = f"; all {len(done)} that are finished count" if len(done) > settings.budget else ""
        return f"the budget of {settings.budget} trials is spent{kept}"
    if batch_at(len(done), settings.batch, settings.initial).start < len(done):
        return ""
    return _out_of_time(run, done) or _nothing_to_gain(run, done)


def seconds_of(run: StudyRun, done: Sequence[TrialRecord]) -> float:
    """How long the episodes of finished trials have taken, all runs together, divided by the processes [s]."""
    settings = run.settings
    seeds = {episode.seed for episode in plan(settings, {}, settings.seed)}
    return run.store.seconds_of_trials(run.study.objective.name, len(done), seeds) / settings.jobs


def out_of_time(seconds: float, rules: StopRules) -> str:
    """What to say where so many seconds are more than the rules allow; empty where they are not."""
    if rules.wall_time_s is None or seconds < rules.wall_time_s:
        return ""
    return f"episodes took {seconds:.3g} s and stop.wall_time_s is {rules.wall_time_s:g}; {FILE_REMEDY}"


def nothing_to_gain(label: str, gain_and_noise: tuple[float, float], rules: StopRules) -> str:
    """What to say where the most that any θ is expected to improve an objective is too little; else empty."""
    gain, noise = gain_and_noise
    if rules.no_improvement is None or gain >= rules.no_improvement * noise:
        return ""
    return (
        f"no θ is expected to improve {label} by more than {gain:.2g}; its noise is {noise:.2g} and"
        f" stop.no_improvement is {rules.no_improvement:g}; lower or remove it to continue"
    )


def _out_of_time(run: StudyRun, done: Sequence[TrialRecord]) -> str:
    rules = run.settings.stop
    return "" if rules.wall_time_s is None else out_of_time(seconds_of(run, done), rules)


def _nothing_to_gain(run: StudyRun, done: Sequence[TrialRecord]) -> str:
    rules = run.settings.stop
    finished = any(trial.state == "finished" for trial in done)
    if rules.no_improvement is None or len(done) < run.settings.initial or not finished:
        return ""
    return nothing_to_gain(run.study.objective.label, _gain(run, done), rules)


def _gain(run: StudyRun, done: Sequence[TrialRecord]) -> tuple[float, float]:
    """The most that any θ is expected to improve the objective, and its noise, as the study's engine sees it."""
    settings = run.settings
    if run.study.engine.learns_from == "outputs":
        trials = [run.search_trial(trial) for trial in done]
        return expected_gain(settings.space, trials, goal_of(run), settings.seed)
    return expected_improvement(settings.space, score_trials(settings.space, done), settings.seed)
