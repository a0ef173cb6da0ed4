"""PRPV as composed of metrics: what an engine that models these is told."""

from proxytune.search.proposer import Compose, Trial, Values
from proxytune.study.evaluate import Evaluation, evaluation
from proxytune.study.store import Store, TrialRecord
from proxytune.study.study import Study
from proxytune.usefulness import compare
from proxytune.usefulness.prpv import prpv_of_means


def trial_of(study: Study, store: Store, done: TrialRecord) -> Trial:
    """A finished trial as the search sees it; with its outcome, unless it was cut off."""
    found = evaluation(study, store, done.theta)
    outcome = None if found is None else outcome_of(study, found)
    return Trial(study.settings.space.values(done.theta), done.score, outcome)


def outcome_of(study: Study, found: Evaluation) -> Values | None:
    """Every agent's mean metrics, in the target's order; None where an agent has no episode that worked."""
    if found.proxy is None:
        return None
    inputs = compare(proxy=found.proxy, target=study.target, metrics=study.settings.metrics)
    return tuple(inputs.means[0].ravel().tolist())


def compose_of(study: Study) -> Compose:
    """PRPV of outcomes against the study's target."""
    metrics = study.settings.metrics
    target = compare(proxy=study.target, target=study.target, metrics=metrics).means[1]
    return lambda outcomes: prpv_of_means(outcomes.reshape(*outcomes.shape[:-1], *target.shape), target, metrics)
