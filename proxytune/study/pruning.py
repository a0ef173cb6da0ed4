"""Pruning: a trial is stopped once it cannot reach the incumbents any more.

Agents are driven in waves (`StudyRun.outcomes`), each from all starts; then its place among those before it is decided,
and the fewest agents that suffice end the trial, whichever were driven beside them. The pairs of decided agents are a
lower bound of PRPV: eq. (4) of the paper is a sum over pairs, none of them negative. As soon as that bound lies above
the limit, the evaluation cannot end among the incumbents (the trials within one standard deviation of the score's noise
of the lowest posterior mean), whatever the other agents do, and they are not driven. The order of the agents puts those
first that disagreed most with the target so far. Order, limit and verdict follow from the finished trials and the
decided agents' episodes alone: a trial comes to the same end with any number of processes and waves of any size.
The trials of a batch are all held against the trials before it, each by its own episodes.

A pruned trial has the state "cut" in study.db. Its score there is an estimate: the bound, divided by the share that
these pairs had of PRPV in the trials that were not pruned.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from proxytune.arrays import Floats
from proxytune.domain import Episode, Instance, Outcome
from proxytune.search import fit_surrogate
from proxytune.storage import TrialRecord
from proxytune.study.opening import PRPV, Study
from proxytune.study.study_run import Spent, StudyRun, disagreement_of, plan_episodes, score_table, score_trials

FEWEST = 3
"""Trials that must have been scored before one is pruned: fewer say nothing of noise."""
PRIOR_DISAGREEMENT = 1e-3
"""Added to every pair, so that a pair that has never disagreed keeps some weight."""


@dataclass(frozen=True)
class PruningRule:
    """The limit that the trials of a batch are held against: a function of the trials finished before it."""

    limit: float
    order: tuple[str, ...]  # in which agents are driven
    disagreement: Floats  # mean |α_proxy − α_target| of pairs of agents, in this order, over scored trials


def pruning_rule(run: StudyRun, done: Sequence[TrialRecord]) -> PruningRule | None:
    """The rule that the next trials are held against; None where none is to be pruned, as during the design."""
    settings = run.settings
    scored = [trial for trial in done if trial.state == "finished"]
    # What is a tie then depends on agents not driven yet; of another objective than PRPV decided pairs say nothing.
    percent = any(metric.percent for metric in settings.metrics)
    prunes = settings.cut_off and not percent and run.study.objective == PRPV
    if not prunes or len(done) < settings.initial or len(scored) < FEWEST:
        return None
    surrogate = fit_surrogate(settings.space, score_trials(settings.space, done))
    means, _ = surrogate.at_visited()
    agents = sorted(settings.agents)
    pairs = [run.evaluation_of(trial).disagreement for trial in scored]
    disagreement = PRIOR_DISAGREEMENT + np.mean([matrix for matrix in pairs if matrix is not None], axis=0)
    rows = [int(np.argmax(disagreement.max(axis=1)))]
    while len(rows) < len(disagreement):
        gains = disagreement[:, rows].sum(axis=1)
        gains[rows] = -1.0
        rows.append(int(np.argmax(gains)))
    limit = float(means.min()) + surrogate.noise_deviation
    return PruningRule(limit, tuple(agents[row] for row in rows), disagreement[np.ix_(rows, rows)])


Plan = tuple[TrialRecord, list[Episode]]
"""A trial with its episodes, agents in the rule's order."""


def run_or_prune(
    run: StudyRun, trials: Sequence[TrialRecord], rule: PruningRule, what: str
) -> list[TrialRecord | None]:
    """Simulate what is missing of the trials until each is through or pruned, and give those that were pruned."""
    study, place = run.study, {agent: number for number, agent in enumerate(rule.order)}
    plans = [
        (trial, sorted(plan_episodes(study.settings, trial.theta), key=lambda one: place[one.agent]))
        for trial in trials
    ]
    planned, plan_at = [one for _, episodes in plans for one in episodes], {plan[1][0].theta: plan for plan in plans}
    before = run.known(planned)

    def enough(instance: Instance, known: Mapping[Episode, Outcome]) -> bool:
        # The bound never falls, so the last of the agents decided tells for those before it.
        count = _decided(study, rule, plan_at[instance], known)
        return count >= 2 and _pruned_at(study, rule, plan_at[instance], known, count) is not None

    run.outcomes(planned, what, enough)
    known = run.known(planned)
    pruned: list[TrialRecord | None] = []
    for plan in plans:
        # By the fewest agents that suffice
        counts = range(2, _decided(study, rule, plan, known) + 1)
        found = (_pruned_at(study, rule, plan, known, count) for count in counts)
        pruned.append(next(filter(None, found), None))
    run.watcher.begin(what, len(planned) - len(known))
    pairs = zip(pruned, plans, strict=True)
    # Other processes have begun these; they are kept in the store, but no trial stands on them.
    vain = [one for trial, (_, episodes) in pairs if trial for one in episodes if one.agent not in trial.decided]
    run.spent += Spent(unused=sum(episode in known and episode not in before for episode in vain))
    return pruned


def rescored_pruned(run: StudyRun, trial: TrialRecord) -> TrialRecord:
    """Score a pruned trial by the study's metrics, if others had led to its end."""
    worked = [outcome for outcome in run.known(run.episodes_of(trial)).values() if outcome.metrics is not None]
    bound = float(disagreement_of(run.study, score_table(worked), trial.decided).sum())
    driven, agents = len(trial.decided), len(run.settings.agents)
    # Every other pair is taken for one like theirs; beside a tolerance in percent the bound is only nearly one.
    return replace(trial, bound=bound, score=bound * agents * (agents - 1) / (driven * (driven - 1)))


def spared(run: StudyRun, trials: Sequence[TrialRecord]) -> tuple[int, float]:
    """Count the episodes that pruned trials did without, none begun in vain, and the seconds of their like."""
    settings, seconds = run.settings, run.store.seconds()
    planned = [one for trial in trials if trial.decided for one in plan_episodes(settings, trial.theta)]
    known = run.known(planned)
    missing = [episode for episode in planned if episode not in known]
    return len(missing), sum(seconds.get((episode.agent, episode.start), 0.0) for episode in missing)


def _decided(study: Study, rule: PruningRule, plan: Plan, known: Mapping[Episode, Outcome]) -> int:
    """Count the agents, in their order and without the last, that have been driven from all starts."""
    starts, most, (_, planned) = study.settings.starts, len(rule.order) - 1, plan
    through = (all(e in known for e in planned[row * starts : (row + 1) * starts]) for row in range(most))
    return next((row for row, done in enumerate(through) if not done), most)


def _pruned_at(
    study: Study, rule: PruningRule, plan: Plan, known: Mapping[Episode, Outcome], count: int
) -> TrialRecord | None:
    """The trial as it was stopped, where the first so many agents are enough to prune it; else None."""
    trial, planned = plan
    names, driven = rule.order[:count], [known[episode] for episode in planned[: count * study.settings.starts]]
    worked = [outcome for outcome in driven if outcome.metrics]
    if {outcome.episode.agent for outcome in worked} != set(names):
        # An agent that failed from every start leaves the trial without a score, not with a bad one.
        return None
    # PRPV of the pairs decided is a bound; what is expected of all pairs is its score.
    bound = float(disagreement_of(study, score_table(worked), names).sum())
    share = rule.disagreement[:count, :count].sum() / rule.disagreement.sum()
    failed, score = len(driven) - len(worked), float(bound / share)
    ended = replace(trial, state="cut", decided=names, bound=bound, score=score, failed_episodes=failed)
    return ended if bound > rule.limit else None
