"""The decision: which agent to deploy on the target, what it risks, and which others may be as good.

    regret of agent i = max_j μ_j − μ_i                with μ the true mean scores on the target, more being better
    expected regret   = its mean over draws of μ       given the target's episodes, and the proxy's where they help

μ is drawn of each agent and metric by what is known of it: of successes a Beta(successes + 1, failures + 1), the prior
uniform, and repeats of a start counting as far as they are independent; of other scores Student's t, its spread pooled
over agents; of a published mean with a standard error a normal; of a published mean alone nothing is known of its
noise, and no probability is given.
"""

import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Literal

import numpy as np

from proxytune.arrays import NORMAL_95, Floats
from proxytune.errors import InputError
from proxytune.scores import ROUNDING, ScoreTable
from proxytune.settings import nearest
from proxytune.usefulness.comparison import Comparison, by_start, independence, start_of
from proxytune.usefulness.predictivity import orders
from proxytune.usefulness.resampling import CONFIDENCE, Ends, interval
from proxytune.usefulness.saving import Rectified, Saving, is_rate, is_sorted, rate_intervals, saving_of

if TYPE_CHECKING:
    import pandas as pd

DRAWS, FEWEST_DRAWS = 40_000, 1000
MOST_DRAWN = 1_000_000
"""Draws of all agents together."""
MOST_COMPARED, FEW_TASKS = 2000, 3
BARELY_BEST = 0.3
"""An agent's interval of regret begins at 0 if it is the best with more than this over the cube of the number of
agents. Intervals of two to twenty equal agents then hold about 96 %; with a limit of 2.5 % those of four would hold
87 %, of eight 67 %."""
PRIOR = 1.0
"""Successes and failures before the first episode: every rate is as probable as any other."""


@dataclass(frozen=True)
class Asked:
    """What a decision is asked for.

    Attributes:
        decide_on: The metric to choose by, or "mean"; "" for the mean of success rates, else the first metric.
        rollouts: Rollouts on the target behind each published mean of a success rate; None if not known.
        bound: The regret that is still accepted, in the metric's unit; None for 5 % of the scores' scale.

    Raises:
        InputError: If there is no rollout, or the bound is none.
    """

    decide_on: str = ""
    rollouts: int | None = None
    bound: float | None = None

    def __post_init__(self) -> None:
        if self.rollouts is not None and not 1 <= self.rollouts <= 10**6:
            raise InputError(f"rollouts must be between 1 and 1000000, got {self.rollouts}")
        if self.bound is not None and not (math.isfinite(self.bound) and self.bound > 0):
            raise InputError(f"the regret that is accepted must be above 0, got {self.bound}")


ASKED = Asked()
"""Nothing in particular."""


@dataclass(frozen=True)
class Panel:
    """Observed winners on a part of the tables."""

    name: str  # the task, or the one that is left out
    proxy_winners: tuple[str, ...]  # the agents of the highest mean in the proxy
    target_winners: tuple[str, ...]  # the same on the target
    regret: float  # the most that choosing a winner of the proxy costs by the target's means
    # of deploying each agent there; None where nothing is known of the noise
    expected_regret: Mapping[str, float] | None = None

    @property
    def agrees(self) -> bool | None:
        """True if every winner in the proxy is one on the target; None if only some of those that tie are."""
        if set(self.proxy_winners) <= set(self.target_winners):
            return True
        return None if set(self.proxy_winners) & set(self.target_winners) else False


@dataclass(frozen=True)
class Decision:
    """The agent to deploy, and what it risks."""

    winner: str  # the agent of the lowest expected regret
    probability_best: float | None  # that it is the target's best; None where nothing is known of the target's noise
    expected_regret: Mapping[str, float]  # of deploying each agent, in the metric's unit
    # the 95 % interval of each agent's regret; None where nothing is known of the noise
    regret_interval: Mapping[str, Ends] | None
    best_probabilities: Mapping[str, float] | None  # of each agent that it is the target's best; None likewise
    not_told_apart: tuple[str, ...]  # other agents that belong to the smallest set which holds the best with 95 %
    chosen_on: str  # what was chosen by: a metric's name, or "mean of …"
    observed: Panel  # winners by the means as they are, and the regret of the proxy's
    tasks: tuple[Panel, ...]  # the same on each task alone
    without: tuple[Panel, ...]  # the same without each task
    least_told: float | None  # the difference of two agents that so many rollouts can tell apart; None likewise
    basis: str  # what the draws rest on, in a phrase
    # mean of each agent on the target with its 95 % interval; None likewise
    scores: Mapping[str, tuple[float, Ends]] | None
    draws: Floats | None  # draws of the true means, shape (draws, agents), more being better; None likewise
    counts: tuple[float, ...]  # rollouts on the target that each agent's mean is worth; none where that is not known
    reason: str = ""  # why no probability can be told; "" where one is

    def to_frame(self) -> "pd.DataFrame":
        """One row per agent: score, probability to be the best and expected regret, with intervals."""
        import pandas as pd

        rows = {}
        for agent, regret in self.expected_regret.items():
            mean, ends = self.scores[agent] if self.scores else (None, (None, None))
            span = self.regret_interval[agent] if self.regret_interval else (None, None)
            best = self.best_probabilities[agent] if self.best_probabilities else None
            rows[agent] = (mean, *ends, best, regret, *span)
        heads = ["score", "score_low", "score_high", "best_with", "expected_regret", "regret_low", "regret_high"]
        return pd.DataFrame.from_dict(rows, orient="index", columns=heads).rename_axis("agent")

    @property
    def chosen_by_proxy(self) -> str:
        """The agent of the highest mean in the proxy; of several that tie, the one of the highest expected regret."""
        return max(self.observed.proxy_winners, key=lambda agent: self.expected_regret[agent])

    @property
    def notes(self) -> tuple[str, ...]:
        """Lines on what the decision rests on, or why it says little."""
        lines = [self.reason or f"chosen by {self.basis}"]
        if len(self.observed.proxy_winners) > 1:
            lines.append(f"{' and '.join(self.observed.proxy_winners)} tie in the proxy; regret is that of the worse")
        return tuple(lines)


def decide(inputs: Comparison, asked: Asked, saving: Saving | None = None, seed: int = 0) -> Decision:
    """Say which agent to deploy.

    What the proxy adds to the target's means where starts are paired (`saving`) counts where that is beyond noise.
    """
    columns, chosen_on = chosen(inputs, asked.decide_on)
    signs = np.array([1.0 if inputs.metrics[column].direction == "max" else -1.0 for column in columns])
    proxy, target = ((means[:, columns] * signs) for means in inputs.means)
    sides = proxy.mean(axis=1), target.mean(axis=1)
    agents = inputs.agents
    observed = _panel("", agents, *sides)
    parts = [(inputs.metrics[column].name, proxy[:, k], target[:, k]) for k, column in enumerate(columns)]
    if len(parts) == 1:
        parts = _parts_by_start(inputs, columns[0], float(signs[0]))
    rng = np.random.default_rng(seed)
    if asked.rollouts is not None and inputs.target.counts.min() > 1:
        raise InputError("rollouts: are stated for means alone, and the target has each rollout; leave that out")
    known = draw_means(inputs.target, columns, signs, asked.rollouts, saving, rng)
    each = None if known is None else known[0]
    if len(columns) == 1 and len(parts) > 1:
        each = _draws_by_start(inputs.target, [name for name, _, _ in parts], columns, signs, rng)
    places = range(len(parts) if len(parts) > 1 else 0)
    tasks = tuple(_part(agents, parts, each, [k]) for k in places)
    rest = [(out, [k for k in places if k != out]) for out in places]
    without = tuple(replace(_part(agents, parts, each, others), name=parts[out][0]) for out, others in rest)
    regrets = sides[1].max() - sides[1]
    bare = Decision(
        winner=observed.target_winners[0], probability_best=None, regret_interval=None, best_probabilities=None,
        expected_regret=dict(zip(agents, map(float, regrets), strict=True)),
        not_told_apart=observed.target_winners[1:], chosen_on=chosen_on, observed=observed, tasks=tasks,
        without=without, least_told=None, basis="", scores=None, draws=None, counts=(),
    )  # fmt: skip
    if known is None:
        return replace(bare, reason=_unknown(inputs.target, columns))
    every, counts, means, basis = known
    draws, sign = np.mean(every, axis=0), signs[0]
    stretch = _stretch(inputs.target, columns)
    if stretch > 1.0:
        middle = draws.mean(axis=0)
        # Not beyond what the metrics' own draws reach, as rates of 0 and 1
        draws = np.clip(middle + stretch * (draws - middle), np.min(every), np.max(every))
    regret = draws.max(axis=1, keepdims=True) - draws
    on_top = regret <= ROUNDING * max(1.0, float(np.abs(draws).max()))
    # Agents that tie, as those that never differ, share the probability.
    expected, best = regret.mean(axis=0), (on_top / on_top.sum(axis=1, keepdims=True)).mean(axis=0)
    place = int(expected.argmin())
    order = np.argsort(-best, kind="stable")
    held = order[: int(np.searchsorted(np.cumsum(best[order]), CONFIDENCE - ROUNDING)) + 1]
    spread = draws.std(axis=0)
    middle, low, high = _spans(inputs.target, columns, means, counts, stretch, saving)
    centre, most = sign * middle, np.zeros(len(agents))
    if all(_has_prior(inputs.target, column) for column in columns):
        # Of agents that, or whose best rival, always or never succeeded: there the prior pulls draws away from rates
        # at the end of what can be. The ends of their regrets follow from those of both scores.
        worse, better = (middle - low, high - middle)[:: int(sign)]
        best_rival, settled = int(centre.argmax()), (middle <= 0.0) | (middle >= 1.0)
        reach = np.hypot(better[best_rival], worse)
        most = np.where(settled | settled[best_rival], centre[best_rival] - centre + reach, 0.0)
    highest = np.array([most, expected])
    return replace(
        bare,
        winner=agents[place],
        probability_best=float(best[place]),
        expected_regret=dict(zip(agents, map(float, expected), strict=True)),
        regret_interval={
            # No regret at all belongs to it unless the agent is very unlikely to be the best; the expected one always.
            agent: (0.0 if best[row] > BARELY_BEST / len(agents) ** 3 else least, float(max(top, *highest[:, row])))
            for row, (agent, (least, top)) in enumerate(zip(agents, map(interval, regret.T), strict=True))
        },
        best_probabilities=dict(zip(agents, map(float, best), strict=True)),
        not_told_apart=tuple(agents[row] for row in held if row != place),
        least_told=float(NORMAL_95 * np.sqrt(2.0) * np.median(spread)),
        basis=basis,
        scores={agent: (float(middle[row]), (float(low[row]), float(high[row]))) for row, agent in enumerate(agents)},
        draws=draws,
        counts=tuple(map(float, np.mean(counts, axis=0))),
    )


def chosen(inputs: Comparison, decide_on: str) -> tuple[list[int], str]:
    """The metrics that a decision averages over, by column, and what that is called; two directions have no average."""
    names = [metric.name for metric in inputs.metrics]
    alike = len({metric.direction for metric in inputs.metrics}) == 1
    driven = np.concatenate([side.values[side.driven].ravel() for side in (inputs.proxy, inputs.target)])
    shares = bool(driven.min() >= 0.0 and driven.max() <= 1.0)
    if decide_on in names:
        return [names.index(decide_on)], decide_on
    if decide_on not in ("", "mean"):
        raise InputError(f"--decide-on {decide_on}: no such metric is compared; {nearest(decide_on, [*names, 'mean'])}")
    if decide_on == "mean" and not alike:
        raise InputError("--decide-on mean: metrics of two directions have no mean; name one of them")
    if len(names) > 1 and alike and (shares or decide_on == "mean"):
        told = ", ".join(names) if len(names) <= FEW_TASKS else f"{len(names)} metrics"
        return list(range(len(names))), f"mean of {told}"
    return [0], names[0]


def _panel(name: str, agents: Sequence[str], proxy: Floats, target: Floats) -> Panel:
    """The winners of mean scores, more being better."""
    best = [np.flatnonzero(side.max() - side <= ROUNDING * max(1.0, np.abs(side).max())) for side in (proxy, target)]
    regret = float((target.max() - target[best[0]]).max())
    winners, others = (tuple(agents[int(row)] for row in rows) for rows in best)
    return Panel(name, winners, others, regret)


def _parts_by_start(inputs: Comparison, column: int, sign: float) -> list[tuple[str, Floats, Floats]]:
    """The tasks that the labels of episodes name (TASK/NUMBER), where both sides have several, all of every agent."""
    sides = inputs.proxy, inputs.target
    if not all("/" in label for side in sides for label in side.episodes):
        return []
    one, other = (by_start(side) for side in sides)
    if set(one.episodes) != set(other.episodes) or not (one.complete and other.complete):
        return []
    places = {start: row for row, start in enumerate(one.episodes)}
    return [
        (start, sign * one.values[:, places[start], column], sign * other.values[:, row, column])
        for row, start in enumerate(other.episodes)
    ]


def _draws_by_start(
    target: ScoreTable, tasks: Sequence[str], columns: Sequence[int], signs: Floats, rng: np.random.Generator
) -> list[Floats] | None:
    """Draws of each agent's mean on each task; None where some task has one rollout of an agent."""
    found = []
    for task in tasks:
        labels = [label for label in target.episodes if start_of(label) == task]
        drawn = draw_means(target.arrange(agents=target.agents, episodes=labels), columns, signs, None, None, rng)
        if drawn is None:
            return None
        found += drawn[0]
    return found


def _part(
    agents: Sequence[str], parts: Sequence[tuple[str, Floats, Floats]], each: Sequence[Floats] | None, of: Sequence[int]
) -> Panel:
    """The mean over some tasks."""
    proxy, target = np.mean([parts[k][1] for k in of], axis=0), np.mean([parts[k][2] for k in of], axis=0)
    panel = _panel(parts[of[0]][0], agents, proxy, target)
    if each is None:
        return panel
    draws = np.mean([each[k] for k in of], axis=0)
    regrets = (draws.max(axis=1, keepdims=True) - draws).mean(axis=0)
    return replace(panel, expected_regret=dict(zip(agents, map(float, regrets), strict=True)))


def draw_means(
    target: ScoreTable,
    columns: Sequence[int],
    signs: Floats,
    rollouts: int | None,
    saving: Saving | None,
    rng: np.random.Generator,
) -> tuple[list[Floats], list[Floats], list[Floats], str] | None:
    """Draws of each agent's true mean by each metric, shape (draws, agents); rollouts, means of each, and their basis.

    None where nothing is known of the noise of some metric.
    """
    draws = max(FEWEST_DRAWS, min(DRAWS, MOST_DRAWN // len(target.agents)))
    found, worth, centres, bases = list[Floats](), list[Floats](), list[Floats](), []
    for column, sign in zip(columns, signs, strict=True):
        means, counts = target.means[:, column], target.counts.astype(np.float64)
        rectified = saving.rectified.get(target.metrics[column]) if saving is not None else None
        if rectified is not None:
            means, counts = rectified.means, rectified.worth
        if is_rate(target, column):
            independent = counts * independence(target, column)
            drawn, basis = _rates(means, independent, draws, rng), "successes, uniform prior"
        elif target.counts.min() > 1:
            drawn, counts = _means(target, column, rectified, draws, rng)
            basis = "episodes' spread, drawn to what agents have in common"
        elif target.errors is not None and _has_errors(target, column):
            noise = target.errors[:, column] * rng.standard_normal((draws, len(means)))
            drawn, basis = means + noise, "published standard errors"
        elif rollouts is not None and (means >= 0.0).all() and (means <= 1.0).all():
            counts = np.full(len(means), float(rollouts))
            drawn = _rates(means, counts, draws, rng)
            basis = f"{rollouts} rollouts behind each mean as stated, uniform prior"
        else:
            return None
        if rectified is not None:
            basis += ", rectified by the proxy's paired starts"
        found.append(sign * drawn)
        worth.append(counts)
        centres.append(means)
        bases.append(basis)
    return found, worth, centres, " and ".join(dict.fromkeys(bases))


def _has_errors(target: ScoreTable, column: int) -> bool:
    """True if each agent's mean was published with a standard error."""
    return target.errors is not None and bool((target.errors[:, column] > 0.0).all())


def _has_prior(target: ScoreTable, column: int) -> bool:
    """True if draws of a metric have the uniform prior of rates, of its rollouts or of those stated."""
    return is_rate(target, column) or (target.counts.min() < 2 and not _has_errors(target, column))


def _unknown(target: ScoreTable, columns: Sequence[int]) -> str:
    """Say why nothing is known of the noise of the target's means."""
    errors = np.zeros((len(target.agents), 1)) if target.errors is None else target.errors[:, columns]
    bare = [agent for agent, own in zip(target.agents, errors, strict=True) if not (own > 0.0).all()]
    what = "means without the number of rollouts"
    if len(bare) < len(target.agents):
        names = ", ".join(bare[:3]) + (f" and {len(bare) - 3} others" if len(bare) > 3 else "")
        what = f"no standard error above 0, nor the number of rollouts, of {names}"
    return f"the target gives {what}: no probability can be told; give it (score --rollouts)"


def _stretch(target: ScoreTable, columns: Sequence[int]) -> float:
    """How much wider a mean of metrics spreads than if those of an episode were independent, pooled within agents."""
    # Cells as 18/25 have no episodes: their outcomes are sorted, and go together for that alone.
    if len(columns) == 1 or target.counts.min() < 2 or any(is_sorted(target, column) for column in columns):
        return 1.0
    values = target.values[..., columns]
    residuals = values - np.nanmean(values, axis=1, keepdims=True)
    apart, whole = np.nansum(residuals**2) / len(columns) ** 2, np.nansum(residuals.mean(axis=-1) ** 2)
    return math.sqrt(whole / apart) if whole > apart else 1.0


def _spans(
    target: ScoreTable,
    columns: Sequence[int],
    means: Sequence[Floats],
    counts: Sequence[Floats],
    stretch: float,
    saving: Saving | None,
) -> tuple[Floats, Floats, Floats]:
    """Each agent's mean over metrics and the ends of its 95 % interval, stretched as the draws are.

    These follow from the ends by each metric (Zou and Donner, 2008, "Construction of confidence limits about effect
    measures").
    """
    squares = np.zeros((2, len(target.agents)))
    for column, own, count in zip(columns, means, counts, strict=True):
        if _has_prior(target, column):
            ends = np.transpose(rate_intervals(own, count * independence(target, column)))
        elif target.counts.min() > 1:
            ends = own + _own_reach(target, column, saving) * [[-1.0], [1.0]]
        else:
            ends = own + NORMAL_95 * np.asarray(target.errors)[:, column] * [[-1.0], [1.0]]
        squares += (ends - own) ** 2
    below, above = stretch * np.sqrt(squares) / len(columns)
    middle = np.mean(means, axis=0)
    if all(_has_prior(target, column) for column in columns):
        return middle, (middle - below).clip(0.0), (middle + above).clip(max=1.0)
    return middle, middle - below, middle + above


def _rates(means: Floats, counts: Floats, draws: int, rng: np.random.Generator) -> Floats:
    means = np.clip(means, 0.0, 1.0)
    return rng.beta(counts * means + PRIOR, counts * (1.0 - means) + PRIOR, (draws, len(means)))


TINY = 1e-3
"""A variance below this share of the pooled one is taken for as much: a few alike scores are no certainty."""
FEWEST_MODERATED = 3
"""So many agents tell how much their spreads differ."""
NEWTON_STEPS = 50


def _means(
    table: ScoreTable, column: int, rectified: Rectified | None, draws: int, rng: np.random.Generator
) -> tuple[Floats, Floats]:
    """Student's t about each mean, and the rollouts that each is worth, (agents,).

    Where all agents share their starts, what these do to all alike is left out.
    """
    starts, agents = by_start(table), len(table.agents)
    shared = starts.complete and len(starts.episodes) > 1
    if not shared and starts.counts.sum() == agents:  # one start alone, driven many times
        starts = table
    degrees: Floats = np.asarray(starts.counts - 1.0, dtype=np.float64) * (1.0 - shared / agents)

    def moderated(values: Floats) -> tuple[Floats, float]:
        residuals = values - np.nanmean(values, axis=1, keepdims=True)
        residuals -= residuals.mean(axis=0) if shared else 0.0
        squares = np.nansum(residuals**2, axis=1)
        own = squares / np.where(degrees > 0.0, degrees, 1.0)
        if shared and agents > 2:  # an agent's residuals have a share of all agents' noise
            own = (own * (agents - 1.0) - squares.sum() / degrees.sum()) / (agents - 2.0)
        return moderate(own, degrees, float(squares.sum() / degrees.sum()))

    means, (own, common) = table.means[:, column], moderated(starts.values[..., column])
    variances = own
    if rectified is not None:
        means = rectified.means
        variances = own + rectified.shares * (moderated(rectified.rest)[0] - own)
        # What is chosen for being alike is too much alike.
        variances = np.maximum(variances, own * table.counts / rectified.worth)
    # Each agent's spread is uncertain by itself, but for one that all have.
    all_alike = common == np.inf
    freedom = degrees.sum() if all_alike else np.minimum(common + degrees, degrees.sum())
    chances = rng.chisquare(freedom, (draws, 1 if all_alike else agents))
    scale = np.sqrt(variances / starts.counts * freedom / chances)
    worth = np.multiply(
        table.counts, np.divide(own, variances, out=np.ones(agents), where=variances > 0.0), dtype=float
    )
    return means + scale * rng.standard_normal((draws, agents)), worth


def moderate(own: Floats, degrees: Floats, pooled: float) -> tuple[Floats, float]:
    """Draw agents' variances (agents,) to what they have in common, and tell how many degrees of freedom that counts.

    Variances that differ by no more than chance are the pooled one, and it counts infinitely many.
    Source: Smyth, Linear models and empirical Bayes methods for assessing differential expression in microarray
    experiments, 2004.
    """
    from scipy.special import digamma, polygamma

    alike = np.full(len(own), pooled), np.inf
    if len(own) < FEWEST_MODERATED or not pooled > 0.0 or degrees.min() <= 0.0:
        return alike
    own = np.maximum(own, TINY * pooled)
    logs = np.log(own) - digamma(degrees / 2.0) + np.log(degrees / 2.0)
    apart = float(logs.var(ddof=1) - polygamma(1, degrees / 2.0).mean())
    if apart <= 0.0:
        return alike
    half = 0.5 + 1.0 / apart
    for _ in range(NEWTON_STEPS):  # trigamma(half) = apart
        half += polygamma(1, half) * (1.0 - polygamma(1, half) / apart) / polygamma(2, half)
    common = np.exp(logs.mean() + digamma(half) - np.log(half))
    return (2.0 * half * common + degrees * own) / (2.0 * half + degrees), 2.0 * half


def _own_reach(table: ScoreTable, column: int, saving: Saving | None) -> Floats:
    """Student's t of each agent's own scores about its mean: what a start does to all agents alike belongs to it."""
    from scipy.special import stdtrit

    starts = by_start(table)
    starts = starts if starts.counts.min() > 1 else table
    variances = np.nanvar(starts.values[..., column], axis=1, ddof=1)
    rectified = saving.rectified.get(table.metrics[column]) if saving is not None else None
    if rectified is not None:
        variances += rectified.shares * (np.nanvar(rectified.rest, axis=1, ddof=1) - variances)
    quantile = stdtrit(starts.counts - 1.0, 0.5 + CONFIDENCE / 2.0)
    return np.asarray(quantile * np.sqrt(variances / starts.counts), dtype=np.float64)


@dataclass(frozen=True)
class Difference:
    """The lead of one proxy over another."""

    better: str  # the better proxy
    worse: str  # the other
    value: float  # how much lower its PRPV is, or what choosing by it gains on the target or saves of real rollouts
    low: float | None  # lower end of the 95 % interval; None if nothing is known of noise
    high: float | None  # upper end of the same; None likewise
    on: Literal["prpv", "regret", "rollouts"] = "prpv"  # by what it is better

    @property
    def beyond_noise(self) -> bool | None:
        """True if the interval leaves out zero; None if there is none."""
        return None if self.low is None else self.low > 0


def compare_choices(inputs: Mapping[str, Comparison], asked: Asked, seed: int = 0) -> tuple[Difference, ...]:
    """Compare every two proxies of one target by what their winners do there, by the target's rollouts alone."""
    found = {name: decide(one, asked, None, seed) for name, one in inputs.items()}
    choices = []
    for pair in itertools.combinations(found, 2):
        # The target is one: regrets and draws of both are the same.
        target, agents = found[pair[0]], inputs[pair[0]].agents
        winner = {name: found[name].chosen_by_proxy for name in pair}
        better, worse = sorted(pair, key=lambda name: target.expected_regret[winner[name]])
        gain = target.expected_regret[winner[worse]] - target.expected_regret[winner[better]]
        ends: tuple[float | None, float | None] = (None, None)
        if target.draws is not None:
            lead, other = (target.draws[:, agents.index(winner[name])] for name in (better, worse))
            ends = interval(lead - other)
        choices.append(Difference(better, worse, gain, *ends, "regret"))
    return tuple(choices)


def compare_savings(savings: Mapping[str, Saving]) -> tuple[Difference, ...]:
    """Compare every two proxies of one target by the real rollouts that they save, where both are known.

    The interval is made of those of both (Zou 2007), as if these were independent, which they are not: it is too wide.
    """
    found = []
    for pair in itertools.combinations(savings, 2):
        better, worse = sorted(pair, key=lambda name: -(savings[name].real_rollouts_worth or 0.0))
        (more, ends), (less, others) = ((savings[n].real_rollouts_worth, savings[n].interval) for n in (better, worse))
        if more is None or less is None or ends is None or others is None:
            continue
        low = math.hypot(more - ends[0], others[1] - less)
        high = math.hypot(ends[1] - more, less - others[0])
        found.append(Difference(better, worse, more - less, more - less - low, more - less + high, "rollouts"))
    return tuple(found)


@dataclass(frozen=True)
class Together:
    """Two proxies of one target, those that save most, used at once: what both are worth, and the agent to deploy."""

    proxies: tuple[str, str]
    saves: Saving
    decision: Decision


def compare_all(
    inputs: Mapping[str, Comparison], saves: Mapping[str, Saving], asked: Asked, seed: int = 0
) -> tuple[tuple[Difference, ...], Together]:
    """Every two proxies of a target, by what choosing by them gains and what they save; the two best savers at once."""
    names = sorted(saves, key=lambda name: -(saves[name].real_rollouts_worth or 0.0))[:2]
    one, other = (inputs[name] for name in names)
    both = saving_of(one, chosen(one, asked.decide_on)[0][0], other)
    together = Together((names[0], names[1]), both, decide(one, asked, both, seed))
    return (*compare_choices(inputs, asked, seed), *compare_savings(saves)), together


def mmrv_conventions(inputs: Comparison) -> dict[str, dict[str, float]]:
    """MMRV of each metric in every convention that papers use; none of more than 2000 agents.

    simpler: the target's gap where (s_i > s_j) differs from (t_i > t_j), SIMPLER's code; strictly_less: the same with
    "less"; sign_product: where (s_i − s_j)(t_i − t_j) < 0, so that ties cost nothing; proxy_gap: the proxy's gap where
    simpler has the target's.
    """
    if len(inputs.agents) > MOST_COMPARED:
        return {}
    found = {}
    for column, metric in enumerate(inputs.metrics):
        sides = [(1.0 if metric.direction == "max" else -1.0) * means[:, [column]] for means in inputs.means]
        ours, theirs = (np.abs(side - side.T) for side in sides)
        one, other = (orders(side)[..., 0] for side in sides)
        simpler = (one > 0) != (other > 0)
        costs = {"simpler": theirs * simpler, "strictly_less": theirs * ((one < 0) != (other < 0))}
        costs |= {"sign_product": theirs * (one * other < 0), "proxy_gap": ours * simpler}
        found[metric.name] = {name: float(cost.max(axis=1).mean()) for name, cost in costs.items()}
    return found
