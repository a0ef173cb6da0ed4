"""A study's trials: what the search is after, how trials are evaluated and kept, and when they end.

The pre-flight (preflight.py) tells the noise, from which follows what the search is after (`goal_of`). `run_trials`
leaves the order of things to the one search loop, `proxytune.search.Search`: that asks `StudyTrials` for the finished
trials, for a reason to end, and to evaluate a batch of θ. Their episodes are simulated by `StudyRun`, all of them or
until a trial is pruned (pruning.py), and come to PRPV in `evaluate_outcomes`. A study ends with its budget or before
(`stopped`): a function of what is stored, so that nothing need be remembered.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from proxytune import search
from proxytune.errors import RunError
from proxytune.space import Space
from proxytune.storage import State, TrialRecord
from proxytune.study.earlier import earlier_trials, known_trials
from proxytune.study.opening import Objective
from proxytune.study.preflight import check_some_work, noise_of
from proxytune.study.pruning import pruning_rule, run_or_prune
from proxytune.study.settings import StopRules
from proxytune.study.study_run import Evaluation, StudyRun, compose_of, plan_episodes, score_trials


@dataclass(frozen=True)
class AfterEarlier:
    """A proposer that is told of earlier studies' trials as of its own: where there are enough, none is a design's."""

    inner: search.Proposer
    earlier: tuple[search.Trial, ...]

    def propose(self, space: Space, trials: Sequence[search.Trial], seed: int) -> search.Values:
        """The next point."""
        return self.inner.propose(space, [*self.earlier, *trials], seed)


def retry_failed(run: StudyRun) -> None:
    """Drive failed episodes of ended trials again where the user's code has changed since; score these trials anew."""
    for trial in run.finished_trials():
        if trial.failed_episodes:
            known = run.known(run.episodes_of(trial))
            failed = [episode for episode, outcome in known.items() if outcome.metrics is None]
            # Where fewer have failed than the trial says, they were tried again before this process.
            if len(failed) != trial.failed_episodes or any(episode in run.corrected for episode in failed):
                # In full, also if it was pruned before; θ of later trials stay what they are.
                planned = plan_episodes(run.settings, trial.theta)
                run.outcomes(planned, f"trial {trial.number} again")
                run.save_trials(record(trial.number, run.evaluation_of(trial)))


def goal_of(run: StudyRun) -> search.Goal:
    """The target as the study's search is after it; a function of the pre-flight and the target's table."""
    table = run.study.target
    outputs = tuple((agent, metric) for agent in table.agents for metric in table.metrics)
    return search.Goal(outputs, table.means.ravel(), noise_of(run).variance.ravel(), compose_of(run.study))


def knowledge_of(run: StudyRun, done: Iterable[TrialRecord]) -> search.Knowledge:
    """All that finished trials say of θ, those of earlier studies too."""
    return run.learn([*known_trials(run), *(run.search_trial(trial) for trial in done)], goal_of(run))


def run_trials(run: StudyRun, proposer: search.Proposer) -> None:
    """Run a study's trials to the end of its budget, or until a rule stops it, from wherever it was left.

    The next batch is a function of the seed and the trials before it alone, and an episode that has been simulated is
    never simulated again: a study stopped at any moment goes on as if it had not been. Facts are those in the store.

    Raises:
        EpisodeError: If an episode fails and the study is to stop then.
        RunError: If the machine fails, every episode of the first trial fails alike, or no trial of the initial
            design has a score.
        StoreError: If the database cannot be written.
    """
    settings = run.settings
    for trial in run.finished_trials():
        planned = run.episodes_of(trial)
        # A damaged study.db may have lost some of its episodes.
        if len(run.known(planned)) < len(planned):
            run.outcomes(planned, f"trial {trial.number} again")
    tried = StudyTrials(run)
    search.Search(settings.space, proposer, settings.seed, settings.budget, settings.initial, settings.batch).run(tried)


class StudyTrials:
    """The trials of a study, as the search loop evaluates them."""

    def __init__(self, run: StudyRun) -> None:
        self._run = run
        self._done = run.finished_trials()

    def trials(self) -> Sequence[search.Trial]:
        """The finished trials, in order."""
        return [self._run.search_trial(trial) for trial in self._done]

    def ended(self) -> str:
        """The reason why the study runs no further; empty while it does."""
        why = stopped(self._run, self._done)
        failed = all(trial.state == "failed" for trial in self._done)
        if not why and failed and len(self._done) >= self._run.settings.initial:
            raise RunError(f"all {len(self._done)} trials failed; the first: {self._done[0].failure}")
        return why

    def evaluate(self, batch: range, propose: search.BatchPoints) -> None:
        """Simulate what is left of a batch, all its trials together, and keep how they ended."""
        run, trials = self._run, self._open(batch, propose)
        first, last, budget = trials[0].number, trials[-1].number, run.settings.budget
        what = f"trial {first} of {budget}" if first == last else f"trials {first} to {last} of {budget}"
        pruned: Sequence[TrialRecord | None] = [None] * len(trials)
        if rule := pruning_rule(run, self._done[: batch.start]):
            pruned = run_or_prune(run, trials, rule, what)
        else:
            outcomes = run.outcomes([one for trial in trials for one in run.episodes_of(trial)], what)
            if not self._done:
                check_some_work(outcomes.values(), what)
        pairs = zip(trials, pruned, strict=True)
        ended = [one or record(trial.number, run.evaluation_of(trial)) for trial, one in pairs]
        run.save_trials(*ended)
        self._done += ended
        self._tell(ended)

    def _open(self, batch: range, propose: search.BatchPoints) -> list[TrialRecord]:
        """The trials that are left of a batch: open in the store, or else proposed, and in the store from now on."""
        done = len(self._done)
        trials = [trial for trial in self._run.open_trials() if done < trial.number <= batch.stop]
        if len(trials) < batch.stop - done:
            thetas = enumerate(map(self._run.settings.space.theta, propose()), start=batch.start + 1)
            trials += [TrialRecord(number, theta) for number, theta in thetas if number > done + len(trials)]
            self._run.save_trials(*trials)
        return trials

    def _tell(self, ended: Sequence[TrialRecord]) -> None:
        """Tell who watches of the best score so far and of each trial."""
        watcher, objective, settings = self._run.watcher, self._run.study.objective, self._run.settings
        scores = [trial.score for trial in self._done if trial.state == "finished" and trial.score is not None]
        if scores:
            watcher.best(objective.sign * min(scores))
        best = f", best so far {objective.sign * min(scores):g}" if scores else ""
        for trial in ended:
            watcher.finished(f"trial {trial.number} of {settings.budget}: {came_to(trial, objective)}{best}")


def came_to(trial: TrialRecord, objective: Objective) -> str:
    """The end of a trial, in one phrase."""
    if trial.state == "cut":
        return f"stopped early, {objective.label} at least {trial.bound:g}"
    return "failed" if trial.score is None else f"{objective.label} {objective.sign * trial.score:g}"


def record(number: int, evaluation: Evaluation) -> TrialRecord:
    """A trial as the store keeps it, from what its episodes came to."""
    state: State = "failed" if evaluation.failure else "finished"
    measures, failed = evaluation.measures if state == "finished" else {}, len(evaluation.failures)
    return TrialRecord(number, evaluation.theta, state, evaluation.score, measures, failed, evaluation.failure)


def stopped(run: StudyRun, done: Sequence[TrialRecord]) -> str:
    """The reason why a study with these finished trials runs no further, in one phrase; empty while it goes on.

    Only finished trials and the time of their own episodes count, never the clock of this process: a study that was
    stopped stays so when it is run again, and without the rule it goes on to the trials it would have had anyway. Rules
    are asked where a batch has ended: a budget that cut one short has no say in what they would have said of the whole.
    """
    settings, rules = run.settings, run.settings.stop
    if not settings.budget and not done:
        return "the budget is 0 trials: earlier studies alone tell"
    if len(done) >= settings.budget:
        kept = f"; all {len(done)} that are finished count" if len(done) > settings.budget else ""
        return f"the budget of {settings.budget} trial{'' if settings.budget == 1 else 's'} is spent{kept}"
    if search.batch_at(len(done), settings.batch, settings.initial).start < len(done):
        return ""
    if rules.wall_time_s is not None and (late := out_of_time(seconds_of(run, done), rules)):
        return late
    scored = len(done) >= settings.initial and any(trial.state == "finished" for trial in done)
    if rules.no_improvement is None or not scored:
        return ""
    return nothing_to_gain(run.study.objective.label, _gain(run, done), rules)


def seconds_of(run: StudyRun, done: Sequence[TrialRecord]) -> float:
    """Seconds that the episodes of finished trials have taken, all runs together, divided by the processes [s]."""
    settings = run.settings
    seeds = {episode.seed for episode in plan_episodes(settings, {})}
    return run.store.seconds_of_trials(run.study.objective.name, len(done), seeds) / settings.jobs


def out_of_time(seconds: float, rules: StopRules) -> str:
    """The phrase where so many seconds are more than the rules allow; empty where they are not."""
    if rules.wall_time_s is None or seconds < rules.wall_time_s:
        return ""
    told = f"episodes took {seconds:.3g} s and stop.wall_time_s is {rules.wall_time_s:g}"
    return f"{told}; raise or remove it to continue"


def nothing_to_gain(label: str, gain_and_noise: tuple[float, float], rules: StopRules) -> str:
    """The phrase where the most that any θ is expected to improve an objective is too little; else empty."""
    gain, noise = gain_and_noise
    if rules.no_improvement is None or gain >= rules.no_improvement * noise:
        return ""
    remedy = f"stop.no_improvement is {rules.no_improvement:g}; lower or remove it to continue"
    return f"no θ is expected to improve {label} by more than {gain:.2g}; its noise is {noise:.2g} and {remedy}"


def _gain(run: StudyRun, done: Sequence[TrialRecord]) -> tuple[float, float]:
    """The most that any θ is expected to improve the objective, and its noise, as the study's engine sees it."""
    settings = run.settings
    if run.study.engine.learns_from == "outputs":
        trials = [*known_trials(run), *(run.search_trial(trial) for trial in done)]
        return search.expected_gain(settings.space, trials, goal_of(run), settings.seed)
    scored = [*earlier_trials(run), *score_trials(settings.space, done)]
    return search.expected_improvement(settings.space, scored, settings.seed)
