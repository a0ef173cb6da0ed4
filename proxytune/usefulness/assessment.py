"""Every measure of one proxy at once with its uncertainty, and the choice among several proxies.

`assess` takes two score tables to an Assessment: PRPV, PPV, correlations and MMRV with their bootstrap intervals, the
noise floor and chance. `select_proxy` ranks several proxies by PRPV, with intervals of

    PRPV(worse) − PRPV(better) ± q · n / (n − 1) · standard deviation over resamples

where q, one for all pairs, is the 95 % quantile of the largest studentised deviation, and n the fewest starts.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import combinations
from typing import TYPE_CHECKING

import numpy as np

from proxytune.errors import InputError, ScoresError
from proxytune.scores import Metric, ScoreTable, score_cautions
from proxytune.settings import check_whole
from proxytune.usefulness import resampling
from proxytune.usefulness.comparison import Comparison, compare, fewest_starts, repeats
from proxytune.usefulness.decision import ASKED, Asked, Decision, Difference, Together, chosen, compare_all, decide
from proxytune.usefulness.expectation import Expectation, noise_floor
from proxytune.usefulness.noise import Chance, NoiseFloor, SuccessRates, chance, success_rates
from proxytune.usefulness.pairs import Prpv, prpv, prpv_of_means
from proxytune.usefulness.predictivity import Correlation, Mmrv, Ppv, kendall_tau, mmrv, ppv, srcc
from proxytune.usefulness.saving import Saving, saving_of
from proxytune.usefulness.sequential import Plan, plan

if TYPE_CHECKING:
    import pandas as pd

PAIRED = "episodes with equal labels are resampled as pairs; use --unpaired if they are not the same starts"
ONE_START = "all episodes are from one start: the intervals do not say what other starts would give"
LEFT_OUT = (
    "the intervals are over starts: they leave out that the same start may turn out otherwise another time, and may be "
    "too narrow; a study drives starts again to know"
)
PERFECT = (
    "PRPV is within the noise floor from the same starts: these episodes show no difference between proxy and target; "
    "take more starts to see one"
)
HALVES = (
    "PRPV is no higher than two halves of the target's episodes may score against each other (95 %); halves hold other "
    "starts, so this does not show that the proxy is perfect; to know, measure the target at least twice from each "
    "start (episodes START/REPEAT), and the proxy from the same starts"
)


@dataclass(frozen=True, repr=False)
class Assessment:
    """The usefulness of one proxy as a predictor of the target.

    Attributes:
        inputs: What was compared, with its sample sizes.
        prpv: How many pairs of agents the proxy ranks unlike the target.
        prpv_interval: The same for resampled episodes.
        ppv: How far the proxy's scores are off.
        srcc: Pearson's correlation per metric.
        kendall_tau: Kendall's correlation per metric.
        mmrv: Mean maximum rank violation per metric.
        intervals: Their bootstrap intervals; None where episodes are not repeated.
        noise_floor: PRPV of the target, or of a domain like it, against itself.
        chance: PRPV of a proxy that ranks at random.
        seed: Seed of the resampling.
        asked: What the decision is asked for.
    """

    inputs: Comparison
    prpv: Prpv
    prpv_interval: resampling.PrpvInterval
    ppv: Ppv
    srcc: Correlation
    kendall_tau: Correlation
    mmrv: Mmrv
    intervals: resampling.Intervals | None
    noise_floor: NoiseFloor
    chance: Chance
    seed: int
    asked: Asked = ASKED

    def __repr__(self) -> str:
        low, high = self.prpv_interval.low, self.prpv_interval.high
        ends = "" if low is None or high is None else f" ({low:.3g} to {high:.3g})"
        return f"Assessment: PRPV {self.prpv.value}{ends} of at most {self.prpv.range[1]}"

    def as_expected(self, expected: Expectation) -> "Assessment":
        """The same with the PRPV that is expected of each repetition by itself, its interval and noise floor.

        All repetitions together, which it was made of, break ties by a single crash.
        """
        mean, low, high = expected.prpv.value
        value = round(mean)
        inner = replace(self.prpv_interval, value=value, low=low, high=high)
        return replace(self, prpv=replace(self.prpv, value=value), prpv_interval=inner, noise_floor=expected.floor)

    @cached_property
    def saves(self) -> Saving:
        """What the proxy's rollouts are worth in rollouts on the target."""
        columns, _ = chosen(self.inputs, self.asked.decide_on)
        return saving_of(self.inputs, columns[0])

    @cached_property
    def decision(self) -> Decision:
        """Which agent to deploy, and what it risks."""
        return decide(self.inputs, self.asked, self.saves, self.seed)

    @cached_property
    def next(self) -> Plan:
        """How many more rollouts of which agents on the target."""
        columns, _ = chosen(self.inputs, self.asked.decide_on)
        means = self.inputs.target.means[:, columns].mean(axis=1)
        scale = 1.0 if means.min() >= 0.0 and means.max() <= 1.0 else float(np.ptp(means)) or 1.0
        counts, stated = self.inputs.target.counts.astype(np.float64), float(self.asked.rollouts or 0)
        made = np.full(len(means), stated) if counts.max() < 2 else counts
        return plan(self.decision, bound=self.asked.bound, made=made, scale=scale)

    def table(self) -> "pd.DataFrame":
        """One row per measure and metric: value, and the ends of its 95 % interval."""
        import pandas as pd

        from proxytune.usefulness.catalogue import MEASURES

        rows = [
            (measure.name_for(metric), one.value, *(one.interval or (None, None)))
            for measure in MEASURES
            for metric, one in measure.measured(self).items()
        ]
        return pd.DataFrame(rows, columns=["measure", "value", "low", "high"]).set_index("measure")

    def _repr_html_(self) -> str:
        value, (_, most) = self.prpv.value, self.prpv.range
        return f"<p>PRPV {value} of at most {most}.</p>\n{self.table().to_html(na_rep='')}"

    @property
    def at_noise_floor(self) -> bool | None:
        """True if PRPV is shown to be what a perfect proxy would score; None where nothing can show it.

        That takes a noise floor of the same starts, and a PRPV that chance does not explain.
        """
        floor = self.noise_floor
        if floor.kind != "same starts" or floor.high is None:
            return None
        return self.prpv.value <= floor.high and not self.chance.explains

    @cached_property
    def success_rates(self) -> tuple[SuccessRates, ...]:
        """The metrics of zeros and ones, with each agent's rate."""
        return success_rates(self.inputs)

    @cached_property
    def cautions(self) -> tuple[str, ...]:
        """Sentences on what is probably not meant in the tables, as another unit on one side."""
        inputs = self.inputs
        return score_cautions(proxy=inputs.proxy, target=inputs.target, metrics=inputs.metrics)

    @property
    def notes(self) -> tuple[str, ...]:
        """Lines on what is undefined or uncertain, and on where PRPV lies between chance and the noise floor."""
        floor, random = self.noise_floor, self.chance
        lines = [*self.ppv.notes, *self.srcc.notes, *self.kendall_tau.notes]
        if self.prpv_interval.reason:
            lines.append(f"no interval: {self.prpv_interval.reason}")
        if floor.reason:
            lines.append(f"no noise floor: {floor.reason}")
        lines += [rates.note for rates in self.success_rates if rates.note]
        if self.intervals is not None:
            sides = (self.inputs.proxy, self.inputs.target)
            fewest = min((repeats(side) > 0).sum(axis=1).min() for side in sides)  # Repeats of a start count once
            lines += [ONE_START] if fewest == 1 else [LEFT_OUT] + [PAIRED] * self.inputs.paired
        if random.too_few:
            lines.append(
                f"these agents cannot exclude chance: a random ranking scores as low with p = {random.p_value:.2g}"
            )
        elif random.explains:
            lines.append(f"PRPV is no better than chance: a random ranking scores as low with p = {random.p_value:.2g}")
        if self.at_noise_floor:
            lines.append(PERFECT)
        if floor.kind == "halves" and floor.high is not None and self.prpv.value <= floor.high:
            lines.append(HALVES)
        return tuple(lines)


def assess(
    *,
    proxy: ScoreTable,
    target: ScoreTable,
    metrics: Sequence[Metric],
    beta: Mapping[str, float] | None = None,
    resamples: int = 1000,
    seed: int = 0,
    floor: NoiseFloor | None = None,
    asked: Asked = ASKED,
) -> Assessment:
    """Measure a proxy in every way that score tables allow.

    Args:
        proxy: Scores in the proxy.
        target: Scores on the target.
        metrics: How agents are compared.
        beta: Weights of the metrics in PPV.
        resamples: How many to draw, and permutations.
        seed: Seed of both.
        floor: The noise floor, where one is known; by default it is found from the target's episodes.
        asked: What the decision is asked for.

    Raises:
        ScoresError: If an agent is missing on one side, there are fewer than two, or a metric is unknown.
        InputError: If a weight of PPV is missing, unknown, negative or not finite.
    """
    inputs = compare(proxy=proxy, target=target, metrics=metrics)
    error = ppv(inputs, beta)
    repeated = not resampling.why_not_repeated(inputs)
    means = resampling.bootstrap_means(inputs, resamples=resamples, seed=seed) if repeated else None
    return Assessment(
        inputs=inputs,
        prpv=prpv(inputs),
        prpv_interval=resampling.prpv_interval(inputs, means),
        ppv=error,
        srcc=srcc(inputs),
        kendall_tau=kendall_tau(inputs),
        mmrv=mmrv(inputs),
        intervals=resampling.intervals(inputs=inputs, error=error, means=means),
        noise_floor=floor or noise_floor(inputs, seed),
        chance=chance(inputs, permutations=resamples, seed=seed),
        seed=seed,
        asked=asked,
    )


@dataclass(frozen=True)
class Selection:
    """Proxies ranked by PRPV."""

    ranking: tuple[tuple[str, int], ...]  # names and PRPV, best first
    # every two proxies, the better one first; the intervals hold for all of them at once
    differences: tuple[Difference, ...]
    reason: str = ""  # why there are no intervals, or not all, empty if there are
    # every two compared by what choosing by them gains, and by what they save; none if not assessed
    choices: tuple[Difference, ...] = ()
    together: Together | None = None  # the two that save most, used at once; None likewise


FEWEST_STARTS = 4
FEW_STARTS = "fewer than four starts say too little of the noise of a difference"
FEWEST_RESAMPLES, MOST_RESAMPLES = 100, 1_000_000
"""Of a bootstrap that people ask for."""


def assess_each(
    *,
    proxies: Mapping[str, ScoreTable],
    target: ScoreTable,
    metrics: Sequence[Metric],
    beta: Mapping[str, float] | None = None,
    asked: Asked = ASKED,
    resamples: int = 1000,
    seed: int = 0,
) -> tuple[dict[str, Assessment], Selection | None]:
    """Assess proxies of one target by name, and rank them where there are several."""
    check_whole("seed", seed)
    if not FEWEST_RESAMPLES <= resamples <= MOST_RESAMPLES:
        raise InputError(f"resamples must be between {FEWEST_RESAMPLES} and {MOST_RESAMPLES}, got {resamples}")
    found = {
        name: assess(proxy=one, target=target, metrics=metrics, beta=beta, asked=asked, resamples=resamples, seed=seed)
        for name, one in proxies.items()
    }
    if len(found) == 1:
        return found, None
    inputs, saves = {name: one.inputs for name, one in found.items()}, {name: one.saves for name, one in found.items()}
    choices, together = compare_all(inputs, saves, asked, seed)
    selection = select_proxy(proxies=proxies, target=target, metrics=metrics, resamples=resamples, seed=seed)
    return found, replace(selection, choices=choices, together=together)


def select_proxy(
    *,
    proxies: Mapping[str, ScoreTable],
    target: ScoreTable,
    metrics: Sequence[Metric],
    resamples: int = 1000,
    seed: int = 0,
) -> Selection:
    """Rank proxies by PRPV, and tell by a paired bootstrap which differences are beyond noise.

    All proxies meet the same resampled target. The intervals are simultaneous: their width is set by the largest
    studentised deviation among all differences, so that looking at many pairs makes no false find more likely. A
    bootstrap of n starts sees √((n − 1)/n) of their deviation, and four say little of what that is: the width is
    n/(n − 1) times its own, by which equal proxies are told apart as seldom as it says. Of fewer starts no noise is
    known.
    """
    if not proxies:
        raise ScoresError("no proxy is given; name at least one")
    inputs = {name: compare(proxy=proxy, target=target, metrics=metrics) for name, proxy in proxies.items()}
    values = {name: round(float(prpv_of_means(*side.means, side.metrics))) for name, side in inputs.items()}
    ranking = tuple(sorted(values.items(), key=lambda item: item[1]))
    pairs = list(combinations([name for name, _ in ranking], 2))
    observed = np.array([values[worse] - values[better] for better, worse in pairs])
    reason = next(filter(None, map(resampling.why_not_repeated, inputs.values())), "")
    if reason or not pairs:
        bare = (Difference(*pair, int(value), None, None) for pair, value in zip(pairs, observed, strict=True))
        return Selection(ranking, tuple(bare), reason)
    # The same seed resamples the target alike for every proxy.
    means = {name: resampling.bootstrap_means(side, resamples=resamples, seed=seed) for name, side in inputs.items()}
    resampled = {name: resampling.prpv_in_blocks(*sides, metrics) for name, sides in means.items()}
    differences = np.array([resampled[worse] - resampled[better] for better, worse in pairs])
    deviation = differences.std(axis=1)
    centred = np.abs(differences - differences.mean(axis=1, keepdims=True))
    studentised = centred / np.where(deviation > 0, deviation, np.inf)[:, None]
    fewest = {name: fewest_starts(side) for name, side in inputs.items()}
    starts = np.array([min(fewest[name] for name in pair) for pair in pairs])
    half = np.quantile(studentised.max(axis=0), resampling.CONFIDENCE) * deviation * starts / (starts - 1)
    rows = zip(pairs, observed, half, starts >= FEWEST_STARTS, strict=True)
    told = tuple(
        Difference(*pair, int(v), *((float(v - h), float(v + h)) if enough else (None, None)))
        for pair, v, h, enough in rows
    )
    return Selection(ranking, told, FEW_STARTS if starts.min() < FEWEST_STARTS else "")
