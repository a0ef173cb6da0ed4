"""A search for the proxy of highest learning value: θ, or p(θ) by the centre and width of each parameter.

A proposal is a pure function of seed and finished trials, trials are kept in study.db and trained points in a cache
(see `Cache`): a study that is stopped at any moment goes on where it was.
"""

import json
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from proxytune.errors import RunError
from proxytune.learning.curves import Curve
from proxytune.learning.lessons import Distribution
from proxytune.learning.plv import Convergence, Estimate, Teaching, mean_score, teaching
from proxytune.learning.settings import NONE
from proxytune.learning.spending import Scores, curves_of
from proxytune.running.progress import Watcher
from proxytune.search.engines.gaussian_process import expected_improvement
from proxytune.search.loop import Propose, Search
from proxytune.search.proposer import Proposer, Trial
from proxytune.space import Space, Theta
from proxytune.storage.records import TrialRecord
from proxytune.storage.store import Store
from proxytune.study.outputs import score_trials
from proxytune.study.settings import StudySettings
from proxytune.study.stages.stopping import nothing_to_gain, out_of_time
from proxytune.teaching.box import distribution
from proxytune.teaching.convergence import why_unknown
from proxytune.teaching.examining import count_examinations, examine_curves, needs_of
from proxytune.teaching.experiment import Experiment, teaching_settings
from proxytune.teaching.finalists import confirm, finalists
from proxytune.teaching.points import TeachingSetup

OBJECTIVE = "plv"


@dataclass(frozen=True)
class PlvTrial:
    """One proxy tried as a teacher.

    Attributes:
        number: Counted from 1.
        theta: Centre and, where searched, width of each parameter's distribution.
        proxy: That p(θ).
        curve: Its learning curve.
        worth: What it is worth.
        zero_shot: Its mean score before any target sample.
    """

    number: int
    theta: Theta
    proxy: Distribution
    curve: Curve
    worth: Teaching
    zero_shot: Estimate


@dataclass(frozen=True)
class PlvStudy:
    """What a study of learning value has found.

    Attributes:
        settings: Of the study.
        space: The box that was searched: the study's, or what PRPV left of it, and the widths'.
        without: The learning curve without a proxy.
        when: When a learner counts as converged.
        trials: Every proxy tried, in order.
        stopped: Why no further one was.
        confirmed: The finalists, taught anew under seeds that the search has not used.
        unable: Why finalists cannot teach, by name of those.
    """

    settings: StudySettings
    space: Space
    without: Curve
    when: Convergence
    trials: tuple[PlvTrial, ...]
    stopped: str
    confirmed: Experiment
    unable: Mapping[str, str] = field(default_factory=dict)

    @property
    def narrowed(self) -> bool:
        """Whether PRPV has narrowed the box first."""
        return teaching_settings(self.settings).narrow

    @property
    def best(self) -> PlvTrial:
        """The trial of highest PLV, the first of them; where none is known, the first."""
        return max(self.trials, key=lambda trial: (plv_or_worst(trial), -trial.number))


def plv_or_worst(trial: PlvTrial) -> float:
    """PLV, minus infinity where the learner did not converge."""
    value = trial.worth.plv.value
    return float("-inf") if value is None else value


@dataclass(frozen=True)
class PlvSearch:
    """A search for the proxy of highest learning value: what its trials are a function of, and where they are kept.

    Attributes:
        settings: Of the study.
        setup: Where learners are taught and examined.
        store: Where trials are kept.
        space: The box that is searched.
        watcher: Hears of every point of a learning curve.
    """

    settings: StudySettings
    setup: TeachingSetup
    store: Store
    space: Space
    watcher: Watcher

    def run(self, proposer: Proposer, by_prpv: Theta | None = None) -> PlvStudy:
        """Try proxies until the budget of [teaching] is spent or a rule says stop, from wherever it was left.

        Args:
            proposer: Proposes what is tried next.
            by_prpv: The θ of lowest PRPV, where that is known: it is taught beside the finalists.

        Raises:
            RunError: If the learner does not converge without a proxy, so that PLV is not known.
            LearnerError: If an expert cannot drive somewhere in the box.
        """
        settings, taught = self.settings, self.setup.settings
        alone = examine_curves(self.setup, {NONE: None}, settings.jobs, self.watcher)
        needs = needs_of(self.setup, curves_of(taught.target_samples, alone))
        if unknown := why_unknown(needs):
            raise RunError(f"{settings.path}: {unknown.reason}, so PLV is not known; {unknown.remedy}")
        self._check_facts()
        tried = ProxyTrials(self, alone)
        self.watcher.begin("learning", count_examinations(taught, tried.done))
        Search(self.space, proposer, settings.seed, taught.budget, settings.initial, settings.batch).run(tried)
        named = finalists(self.setup, settings, self.space, tried.trials(), by_prpv)
        last = confirm(settings, self.setup, named, self.watcher)
        trials, ended = tuple(tried.tried()), tried.ended()
        return PlvStudy(
            settings, self.space, needs.curves[NONE], needs.when, trials, ended, last.experiment, last.unable
        )

    def facts(self) -> dict[str, Any]:
        """All that a trial depends on; if it changes, trials lose their meaning."""
        settings, taught = self.settings, self.setup.settings
        named = ("proxy_samples", "target_samples", "seeds", "lesson_s", "level", "tolerance", "examinations")
        return {
            "domains": list(self.setup.identities),
            "learner": self.setup.learner_identity,
            **{name: json.loads(json.dumps(getattr(taught, name))) for name in named},
            **taught.later_keys,
            **{name: getattr(settings, name) for name in ("starts", "seed", "initial", "batch", "engine")},
            "box": {box.name: [box.low, box.high] for box in self.space.intervals},
        }

    def _check_facts(self) -> None:
        """Begin afresh where trials were made under other facts; what was taught is kept, so little is lost."""
        facts = self.store.facts()
        if facts.get(OBJECTIVE) != self.facts():
            self.store.begin({**facts, OBJECTIVE: self.facts()}, OBJECTIVE)


class ProxyTrials:
    """The proxies tried, as the search loop evaluates them."""

    def __init__(self, search: PlvSearch, alone: Scores) -> None:
        self._search, self._alone = search, alone
        self._records = [trial for trial in search.store.trials(OBJECTIVE) if trial.state != "open"]

    @property
    def done(self) -> int:
        """How many have been tried."""
        return len(self._records)

    def trials(self) -> Sequence[Trial]:
        """The finished trials, in order."""
        return score_trials(self._search.space, self._records)

    def ended(self) -> str:
        """Why no further proxy is tried; empty while one is."""
        search, done = self._search, self._records
        if len(done) >= search.setup.settings.budget:
            return f"the budget of {search.setup.settings.budget} proxies is spent"
        rules = search.settings.stop
        late = out_of_time(sum(record.seconds for record in done), rules)
        if late or rules.no_improvement is None or len(done) < search.settings.initial:
            return late
        if not any(record.state == "finished" for record in done):
            return ""
        return nothing_to_gain("PLV", expected_improvement(search.space, self.trials(), search.settings.seed), rules)

    def evaluate(self, batch: range, propose: Propose) -> None:
        """Teach from what is left of a batch of proxies, all together, and keep what each was worth."""
        begun = time.perf_counter()
        points = list(zip(batch, propose(), strict=True))[len(self._records) - batch.start :]
        thetas = {number + 1: self._search.space.theta(values) for number, values in points}
        made = self._tried(thetas)
        seconds = (time.perf_counter() - begun) / len(made)
        records = [_record(trial, seconds) for trial in made]
        self._search.store.save_trial(self._identity, *records, objective=OBJECTIVE)
        self._records += records
        for record in records:
            came = "not converged" if record.score is None else f"PLV {-record.score:g}"
            self._search.watcher.finished(f"trial {record.number} of {self._search.setup.settings.budget}: {came}")

    def tried(self) -> list[PlvTrial]:
        """Every proxy tried, in order, with its learning curve."""
        return self._tried({record.number: record.theta for record in self._records})

    @property
    def _identity(self) -> str:
        return self._search.setup.identities[0]

    def _tried(self, thetas: Mapping[int, Theta]) -> list[PlvTrial]:
        return [self._try(number, theta) for number, theta in thetas.items()]

    def _try(self, number: int, theta: Theta) -> PlvTrial:
        """Teach from one proxy: what that comes to depends on no other trial."""
        search, name = self._search, f"trial {number}"
        setup, proxy = search.setup, distribution(search.setup, theta)
        scores = examine_curves(setup, {name: proxy}, search.settings.jobs, search.watcher, self._alone)
        needs = needs_of(setup, curves_of(setup.settings.target_samples, scores))
        worth = teaching(needs, none=NONE, proxy=name)
        return PlvTrial(number, theta, proxy, needs.curves[name], worth, mean_score(needs, name, 0))


def _record(trial: PlvTrial, seconds: float) -> TrialRecord:
    """A trial as the store keeps it; where the learner did not converge it has failed, which is as bad as the worst."""
    plv = trial.worth.plv.value
    if plv is None:
        failure = f"the learner does not converge within {trial.curve.counts[-1]} target samples"
        return TrialRecord(trial.number, trial.theta, "failed", failure=failure, seconds=seconds)
    measures = {OBJECTIVE: plv, "needed": trial.worth.needed.value, "zero_shot": trial.zero_shot.value}
    return TrialRecord(trial.number, trial.theta, "finished", -plv, measures, seconds=seconds)
