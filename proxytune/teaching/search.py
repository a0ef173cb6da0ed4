"""A search for the proxy of highest learning value: θ, or p(θ) by the centre and width of each parameter.

`PlvSearch.run` leaves the order of things to the one search loop, `proxytune.search.Search`, whose trials are
`ProxyTrials`. A proposal is a pure function of seed and finished trials, trials are kept in study.db and trained points
in a cache (`Cache`): a study that is stopped at any moment goes on where it was.

The highest of many uncertain PLVs is partly luck. So the finalists (the best p(θ), the best single θ, all of the box,
and PRPV's choice) are taught anew: what they are worth is told by lessons, learners and examinations that the search
has not used. Where PLV is not known, `why_unknown` says what the learner without a proxy does not show.
"""

import json
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

import numpy as np

from proxytune import learning, search
from proxytune.arrays import Floats
from proxytune.errors import LearnerError, RunError
from proxytune.running import Watcher
from proxytune.seeds import fresh_seed, proposal_seed
from proxytune.space import Space, Theta
from proxytune.storage import Store, TrialRecord
from proxytune.study import StudySettings, nothing_to_gain, out_of_time, score_trials
from proxytune.teaching.examining import count_examinations, examine_curves, needs_of, prepare_points
from proxytune.teaching.experiment import Experiment, TeacherResult, judge_curves, teaching_settings
from proxytune.teaching.points import WIDTH, CurvePoint, TeachingSetup, distribution

BEST, SINGLE, BOX, BY_PRPV = "best p(θ)", "best single θ", "all of the box", "lowest PRPV"
CLOUD = 4096
CLOSER = 2
"""A finalist gets so many times the examinations of a trial, where these are chosen."""


def finalists(
    setup: TeachingSetup, settings: StudySettings, space: Space, trials: Sequence[search.Trial], by_prpv: Theta | None
) -> dict[str, learning.Distribution]:
    """The distributions that are worth a closer look after these trials, by name; none twice.

    The θ of lowest PRPV is one where it is known, and the study's whole box where widths are searched.
    """
    if all(trial.score is None for trial in trials):
        return {}
    surrogate = search.fit_surrogate(space, search.with_failures_as_worst(trials))
    widths = np.array([name.endswith(WIDTH) for name in space.names])
    # The best is looked for in a cloud over the unit cube, and at the points tried.
    tried = search.unit_array(space, [trial.values for trial in surrogate.visited])
    points = np.concatenate(
        (tried, search.unit_points(tried.shape[1], CLOUD, proposal_seed(settings.seed, len(tried))))
    )
    single = _lowest(surrogate, np.where(widths, 0.0, points))
    named = {SINGLE: distribution(setup, {name: one for name, one in single.items() if not name.endswith(WIDTH)})}
    if widths.any():
        whole = {box.name: (box.low, box.high) for box in settings.space.intervals}
        named = {BEST: distribution(setup, _lowest(surrogate, points)), **named, BOX: learning.Distribution(whole)}
    if by_prpv is not None:
        named[BY_PRPV] = distribution(setup, by_prpv)
    return {name: one for name, one in named.items() if name == next(first for first in named if named[first] == one)}


def most_examinations(taught: learning.TeachingSettings) -> int:
    """The most that a search by PLV takes: every trial, four finalists, and the learner without a proxy beside both."""
    return count_examinations(taught, taught.budget + 1) + count_examinations(_closer(taught), 5)


def _closer(taught: learning.TeachingSettings) -> learning.TeachingSettings:
    """The settings by which finalists are examined."""
    return replace(taught, examinations=taught.examinations and CLOSER * taught.examinations)


def teach_finalists(
    settings: StudySettings, setup: TeachingSetup, named: Mapping[str, learning.Distribution], watcher: Watcher
) -> tuple[Experiment, dict[str, str]]:
    """Teach the finalists and the learner without a proxy under fresh seeds; gives why others cannot teach, by name."""
    taught = _closer(setup.settings)
    fresh = replace(setup, seed=fresh_seed(setup.seed, 1), settings=taught)
    unable = {name: reason for name, proxy in named.items() if (reason := _why_unable(fresh, name, proxy))}
    able = {name: proxy for name, proxy in named.items() if name not in unable}
    fresh = replace(fresh, settings=replace(taught, proxies=able))
    scores = examine_curves(fresh, {learning.NONE: None, **able}, settings.jobs, watcher)
    return judge_curves(settings, fresh, learning.curves_of(taught.target_samples, scores)), unable


def _why_unable(setup: TeachingSetup, name: str, proxy: learning.Distribution) -> str:
    """The reason why a proxy cannot teach, empty if it can: nobody has driven in it before."""
    try:
        prepare_points(setup, [CurvePoint(name, proxy, 0, 0)], jobs=1)
    except LearnerError as problem:
        return str(problem)
    return ""


def best_teacher(experiment: Experiment) -> TeacherResult | None:
    """The proxy of highest PLV, the first of them; None where no PLV is known."""
    return max((one for one in experiment.teachers if np.isfinite(plv_or_worst(one))), key=plv_or_worst, default=None)


def saves_more(experiment: Experiment, name: str, other: str) -> learning.LearningEstimate:
    """The target samples that one proxy saves more than another: what the other needs less what the one needs."""
    return learning.more_needed(experiment.needs, more=other, less=name)


def _lowest(surrogate: search.Surrogate, points: Floats) -> Theta:
    """The θ of the point with the lowest posterior mean score, which is PLV with its sign turned."""
    return surrogate.space.theta(search.from_unit(surrogate.space, points[int(np.argmin(surrogate.mean(points)))]))


RAISE = "raise teaching.target_samples"


class PlvUnknown(NamedTuple):
    """Why PLV is not known, and what to do about it: half a sentence each."""

    reason: str
    remedy: str


def why_unknown(needs: learning.SampleNeeds) -> PlvUnknown | None:
    """The reason why nothing is known of PLV, or no more than a bound; None where it is known."""
    last, tolerance = f"{needs.last:g}", f"{needs.when.tolerance:g}"
    if needs.gain is None:
        half, counts = f"{needs.last / 2.0:.0f}", sorted({*needs.curves[learning.NONE].counts, round(needs.last / 3.0)})
        reason = f"teaching.target_samples has no number from 1 to {half}, which would show a rise towards {last}"
        return PlvUnknown(reason, f"add a number of target samples between 1 and {half}, as {counts}")
    if not needs.settled:
        rises = f"the score still rises by more than {tolerance} over the last doubling to {last} samples"
        return PlvUnknown(f"without a proxy {rises}", RAISE)
    if not np.isfinite(np.median(needs.needed[learning.NONE])):
        reason = f"without a proxy the score does not come to {needs.when.threshold:g} within {last} samples"
        return PlvUnknown(reason, f"lower teaching.level, or {RAISE}")
    alone = learning.samples_needed(needs, learning.NONE)
    if alone.low != alone.high == needs.draws.first:
        reason = f"without a proxy the score comes to {needs.when.threshold:g} by {alone.high:g} samples already"
        return PlvUnknown(reason, "add smaller numbers to teaching.target_samples, or lower teaching.tolerance")
    return None


def caution_of_threshold(needs: learning.SampleNeeds) -> str:
    """A caution where one counts as converged that has hardly learnt anything, so that PLV says little; else empty."""
    alone, threshold = needs.draws.scores[learning.NONE].mean(axis=0), needs.when.threshold
    first = float(alone[np.isfinite(alone)][0])
    if threshold > first:
        return ""
    hardly = f"no more than a learner without a proxy scores after {needs.draws.first:g} samples ({first:.3g})"
    remedy = "lower teaching.tolerance, or state a higher teaching.level"
    return f"the score that counts as converged, {threshold:.3g}, is {hardly}, so PLV says little; {remedy}"


OBJECTIVE = "plv"


@dataclass(frozen=True)
class PlvTrial:
    """One proxy tried as a teacher."""

    number: int  # counted from 1
    theta: Theta  # centre and, where searched, width of each parameter's distribution
    proxy: learning.Distribution  # that p(θ)
    curve: learning.LearningCurve  # its learning curve
    worth: learning.TeachingValue  # what it is worth
    zero_shot: learning.LearningEstimate  # its mean score before any target sample


@dataclass(frozen=True)
class PlvStudy:
    """The result of a study of learning value."""

    settings: StudySettings  # of the study
    space: Space  # the box that was searched: the study's, or what PRPV left of it, and the widths'
    without: learning.LearningCurve  # the learning curve without a proxy
    when: learning.Convergence  # when a learner counts as converged
    trials: tuple[PlvTrial, ...]  # every proxy tried, in order
    stopped: str  # why no further one was
    confirmed: Experiment  # the finalists, taught anew under seeds that the search has not used
    unable: Mapping[str, str] = field(default_factory=dict)  # why finalists cannot teach, by name of those

    @property
    def narrowed(self) -> bool:
        """True if PRPV has narrowed the box first."""
        return teaching_settings(self.settings).narrow

    @property
    def best(self) -> PlvTrial:
        """The trial of highest PLV, the first of them; where none is known, the first."""
        return max(self.trials, key=lambda trial: (plv_or_worst(trial), -trial.number))


def plv_or_worst(one: PlvTrial | TeacherResult) -> float:
    """PLV, minus infinity where it is not known."""
    value = one.worth.plv.value if one.worth else None
    return -np.inf if value is None else value


@dataclass(frozen=True)
class PlvSearch:
    """A search for the proxy of highest learning value: what its trials are a function of, and where they are kept."""

    settings: StudySettings  # of the study
    setup: TeachingSetup  # where learners are taught and examined
    store: Store  # where trials are kept
    space: Space  # the box that is searched
    watcher: Watcher  # hears of every point of a learning curve

    def run(self, proposer: search.Proposer, by_prpv: Theta | None = None) -> PlvStudy:
        """Try proxies until the budget of [teaching] is spent or a rule says stop, from wherever it was left.

        Args:
            proposer: Proposes what is tried next.
            by_prpv: The θ of lowest PRPV, where that is known: it is taught beside the finalists.

        Raises:
            RunError: If the learner does not converge without a proxy, so that PLV is not known.
            LearnerError: If an expert cannot drive somewhere in the box.
        """
        settings, taught = self.settings, self.setup.settings
        alone = examine_curves(self.setup, {learning.NONE: None}, settings.jobs, self.watcher)
        needs = needs_of(self.setup, learning.curves_of(taught.target_samples, alone))
        if unknown := why_unknown(needs):
            raise RunError(f"{settings.path}: {unknown.reason}, so PLV is not known; {unknown.remedy}")
        # Trials that were made under other facts are begun afresh; what was taught is kept, so little is lost.
        stored = self.store.facts()
        if stored.get(OBJECTIVE) != self.facts():
            self.store.begin({**stored, OBJECTIVE: self.facts()}, OBJECTIVE)
        tried = ProxyTrials(self, alone)
        self.watcher.begin("learning", count_examinations(taught, tried.done))
        search.Search(self.space, proposer, settings.seed, taught.budget, settings.initial, settings.batch).run(tried)
        named = finalists(self.setup, settings, self.space, tried.trials(), by_prpv)
        confirmed, unable = teach_finalists(settings, self.setup, named, self.watcher)
        trials, ended = tuple(tried.tried()), tried.ended()
        return PlvStudy(settings, self.space, needs.curves[learning.NONE], needs.when, trials, ended, confirmed, unable)

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


class ProxyTrials:
    """The proxies tried, as the search loop evaluates them."""

    def __init__(self, plv: PlvSearch, alone: learning.ExaminationScores) -> None:
        self._search, self._alone = plv, alone
        self._records = [trial for trial in plv.store.trials(OBJECTIVE) if trial.state != "open"]

    @property
    def done(self) -> int:
        """The number of proxies that have been tried."""
        return len(self._records)

    def trials(self) -> Sequence[search.Trial]:
        """The finished trials, in order."""
        return score_trials(self._search.space, self._records)

    def ended(self) -> str:
        """The reason why no further proxy is tried; empty while one is."""
        plv, done = self._search, self._records
        if len(done) >= plv.setup.settings.budget:
            return f"the budget of {plv.setup.settings.budget} proxies is spent"
        rules = plv.settings.stop
        late = out_of_time(sum(record.seconds for record in done), rules)
        if late or rules.no_improvement is None or len(done) < plv.settings.initial:
            return late
        if not any(record.state == "finished" for record in done):
            return ""
        return nothing_to_gain("PLV", search.expected_improvement(plv.space, self.trials(), plv.settings.seed), rules)

    def evaluate(self, batch: range, propose: search.BatchPoints) -> None:
        """Teach from what is left of a batch of proxies, all together, and keep what each was worth."""
        begun = time.perf_counter()
        points = list(zip(batch, propose(), strict=True))[len(self._records) - batch.start :]
        thetas = {number + 1: self._search.space.theta(values) for number, values in points}
        made = [self._try(number, theta) for number, theta in thetas.items()]
        seconds = (time.perf_counter() - begun) / len(made)
        records = [_record(trial, seconds) for trial in made]
        self._search.store.save_trial(self._search.setup.identities[0], *records, objective=OBJECTIVE)
        self._records += records
        for record in records:
            came = "not converged" if record.score is None else f"PLV {-record.score:g}"
            self._search.watcher.finished(f"trial {record.number} of {self._search.setup.settings.budget}: {came}")

    def tried(self) -> list[PlvTrial]:
        """Every proxy tried, in order, with its learning curve."""
        return [self._try(record.number, record.theta) for record in self._records]

    def _try(self, number: int, theta: Theta) -> PlvTrial:
        """Teach from one proxy: what that comes to depends on no other trial."""
        plv, name = self._search, f"trial {number}"
        setup, proxy = plv.setup, distribution(plv.setup, theta)
        scores = examine_curves(setup, {name: proxy}, plv.settings.jobs, plv.watcher, self._alone)
        needs = needs_of(setup, learning.curves_of(setup.settings.target_samples, scores))
        worth = learning.teaching_value(needs, name)
        return PlvTrial(number, theta, proxy, needs.curves[name], worth, learning.mean_score(needs, name, 0))


def _record(trial: PlvTrial, seconds: float) -> TrialRecord:
    """A trial as the store keeps it; where the learner did not converge it has failed, which is as bad as the worst."""
    if (plv := trial.worth.plv.value) is None:
        failure = f"the learner does not converge within {trial.curve.counts[-1]} target samples"
        return TrialRecord(trial.number, trial.theta, "failed", failure=failure, seconds=seconds)
    measures = {OBJECTIVE: plv, "needed": trial.worth.needed.value, "zero_shot": trial.zero_shot.value}
    return TrialRecord(trial.number, trial.theta, "finished", -plv, measures, seconds=seconds)
