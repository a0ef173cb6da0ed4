"""What to do next on the target: how many rollouts of which agents, and a test that may be looked at after each.

Rollouts to come are planned on the draws of a decision, each taken for the truth in turn (preposterior analysis, Raiffa
and Schlaifer 1961): how many more would leave the winner by all rollouts with a regret above the bound in less than
5 % of draws? They go to the agents in proportion to what tells them from the best (optimal computing budget
allocation, Chen et al. 2000).

The test is a bet. After t starts of agents a and b, the repeats of one being one score, with p̂ foretold from those
before, p₀ the mean of both and d = (p̂_a − p̂_b) / (2 p₀ (1 − p₀)), the wealth against "a is no better than b" is

    W_t = W_{t−1} · (1 + (y_a − p₀) d) (1 − (y_b − p₀) d)                      where p̂_a > p̂_b, else W_{t−1}

whose mean does not grow if a is no better, whatever p̂ is (Turner, Ly and Grünwald, 2024). So by Ville's inequality
it ever reaches (K − 1)/α for all rivals of an agent that is not the best with a probability of at most α. Half of the
stake foretells from the proxy's rates, half does without: a wrong proxy costs time and no error.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from proxytune.arrays import Floats
from proxytune.errors import ScoresError
from proxytune.scores import ScoreTable
from proxytune.usefulness.comparison import Comparison, by_start
from proxytune.usefulness.decision import Decision
from proxytune.usefulness.resampling import CONFIDENCE
from proxytune.usefulness.saving import SORTED, is_sorted

LEVEL = 1.0 - CONFIDENCE
PRIOR = 0.5
"""Successes and failures that a bet without a proxy begins with."""
PROXY_PRIOR = 8.0
"""Rollouts that the proxy's rate counts for in a bet."""
MOST_ROLLOUTS = 100_000
SCALE_SHARE = 0.05
MOST_BETS = 20_000_000
PATHS, MOST_ROUNDS = 50, 1000


@dataclass(frozen=True)
class Plan:
    """Rollouts still to be made on the target."""

    rollouts: Mapping[str, int]  # more rollouts of each agent that needs some
    bound: float  # the regret, in the metric's unit, that is then exceeded with less than 5 %
    regret_bound: float | None  # what is exceeded with 5 % now
    # how many more it would take in all if the proxy counted for nothing; None if it does already
    without_proxy: int | None = None
    reason: str = ""  # why there is no plan; "" if there is one

    @property
    def total(self) -> int:
        """All of them."""
        return sum(self.rollouts.values())


def plan(decision: Decision, *, bound: float | None, made: Floats, scale: float) -> Plan:
    """Say how many more rollouts each agent needs for a regret below a bound with 95 %.

    Without a bound it is 5 % of the scale, which is 1 for rates, else the scores' spread. Rollouts were made already.
    """
    bound = SCALE_SHARE * scale if bound is None else bound
    if decision.draws is None:
        return Plan({}, bound, None, reason="nothing is known of the target's noise")
    if float(decision.draws.std(axis=0).max()) == 0.0:
        return Plan({}, bound, None, reason="the target's rollouts do not differ")
    if made.min() <= 0.0:
        return Plan({}, bound, None, reason="the number of rollouts behind the target's means is not known")
    draws, worth = decision.draws, np.array(decision.counts)
    worth = worth if (worth > 0.0).all() else made
    regret = draws.max(axis=1) - draws[:, draws.mean(axis=0).argmax()]
    now = float(np.quantile(regret, CONFIDENCE))
    if now <= bound:
        return Plan({}, bound, now)
    more = _more(draws, worth, bound)
    # A rollout that comes with its pair in the proxy counts as much as those that were made.
    real = np.ceil(more * made / worth).astype(int)
    without = int(np.ceil(more + worth - made).clip(0).sum()) if (worth > made + 0.5).any() else None
    chosen = {agent: int(n) for agent, n in zip(decision.expected_regret, real, strict=True) if n > 0}
    alike = f"beyond {MOST_ROLLOUTS} rollouts of an agent: agents are too much alike"
    reason = alike if more.max() >= MOST_ROLLOUTS else ""
    return Plan(chosen, bound, now, without, reason)


def _more(draws: Floats, worth: Floats, bound: float) -> Floats:
    """More rollouts of each agent, shape (agents,)."""
    means, spread = draws.mean(axis=0), draws.std(axis=0) * np.sqrt(worth)
    best = int(means.argmax())
    share = spread**2 / np.maximum(means[best] - means, bound) ** 2
    others = np.arange(len(means)) != best
    share[best] = spread[best] * np.sqrt((share[others] ** 2 / np.maximum(spread[others], 1e-12) ** 2).sum())
    share /= share.max()
    noise = spread * np.random.default_rng(0).standard_normal(draws.shape)
    top, rows = draws.max(axis=1), np.arange(len(draws))

    def exceeds(size: float) -> bool:
        """True if the winner of so many rollouts, were the means each draw in turn, regrets more too often."""
        more = np.maximum(size * share - worth, 0.0)
        later = (worth * means + more * draws + np.sqrt(more) * noise) / (worth + more)
        return bool(np.mean(top - draws[rows, later.argmax(axis=1)] > bound) > LEVEL)

    low, high = 1.0, 2.0
    while high < MOST_ROLLOUTS and exceeds(high):
        low, high = high, 2.0 * high
    while high - low > max(0.5, 0.005 * high):
        middle = (low + high) / 2.0
        low, high = (middle, high) if exceeds(middle) else (low, middle)
    return np.asarray(np.ceil(np.maximum(high * share - worth, 0.0)), dtype=np.float64)


@dataclass(frozen=True)
class Sequential:
    """The test that may be looked at after every start; JSON has the names of its attributes."""

    winner: str | None  # the agent that is shown to be the target's best; None while none is
    decided_at: int | None  # the round at which the winner was shown; None while none is
    rounds: int  # starts of every agent that were looked at, in the order of the table; without repeats, rollouts
    # the least wealth of each agent against its rivals; the agent is shown to be best at `threshold`
    evidence: Mapping[str, float]
    threshold: float  # (K − 1)/α
    # median of rounds to a decision, were the rates what they are, by bets with the proxy and without; None where
    # more than half take beyond 1000
    expected_rounds: Mapping[str, int | None]
    independent: float  # the least share of an agent's rollouts that counts: 1 unless starts are repeated


def sequential_test(inputs: Comparison, column: int = 0, *, seed: int = 0) -> Sequential:
    """Test, start by start in the target table's order, which agent is the best; repeats of one count as their mean.

    Raises:
        ScoresError: If scores are not within 0 and 1, an agent has one rollout, or outcomes are sorted.
    """
    metric, agents = inputs.metrics[column], inputs.agents
    values = _scores(inputs.target, column, metric.direction)
    rounds = min(map(len, values))
    if len(agents) ** 2 * rounds > MOST_BETS:
        raise ScoresError(f"--sequential: {len(agents)} agents are too many to be bet on; test those that may be best")
    made = inputs.target.values[..., column][inputs.target.driven]
    if made.min() < 0.0 or made.max() > 1.0:
        remedy = "give successes, or scores as shares of the best"
        raise ScoresError(f"--sequential: {metric.name} goes beyond 0 and 1; {remedy}")
    if rounds < 2:
        raise ScoresError("--sequential: takes a row per rollout on the target; there is one row an agent")
    if is_sorted(inputs.target, column):
        raise ScoresError(f"--sequential: {SORTED}; give rollouts in the order in which they were made")
    foretold = np.array([row.mean() for row in _scores(inputs.proxy, column, metric.direction)])
    outcomes = np.stack([row[:rounds] for row in values])[None]
    bet = foretold if foretold.min() >= 0.0 and foretold.max() <= 1.0 else None
    wealth = wealth_of(outcomes, bet)[0]
    threshold = (len(agents) - 1) / LEVEL
    least = wealth.min(axis=-1)  # (rounds, agents)
    crossed = np.argwhere(np.maximum.accumulate(wealth, axis=0).min(axis=-1) >= threshold)
    winner, at = (agents[crossed[0][1]], int(crossed[0][0]) + 1) if len(crossed) else (None, None)
    evidence = dict(zip(agents, map(float, least[-1]), strict=True))
    rates = np.array([(row.sum() + PRIOR) / (len(row) + 2 * PRIOR) for row in values])
    rng = np.random.default_rng(seed)
    bets = {"with proxy": bet, "without proxy": None}
    expected = {name: expected_rounds(rates, each, rng) for name, each in bets.items()}
    independent = min(len(row) / int(count) for row, count in zip(values, inputs.target.counts, strict=True))
    return Sequential(winner, at, rounds, evidence, threshold, expected, independent)


def _scores(table: ScoreTable, column: int, direction: str) -> list[Floats]:
    """Each agent's scores, start by start in the table's order, more being better; of one start alone its repeats."""
    starts = by_start(table)
    table = starts if len(starts.episodes) > 1 else table
    rows = [row[driven] for row, driven in zip(table.values[..., column], table.driven, strict=True)]
    return rows if direction == "max" else [1.0 - row for row in rows]


def wealth_of(outcomes: Floats, foretold: Floats | None = None) -> Floats:
    """Wealth against "the agent is no better than its rival", after each round, of outcomes from 0 to 1.

    These are (experiments, agents, rounds), the proxy's rates (agents,), None to bet without; the answer is
    (experiments, rounds, agents, rivals), infinite against itself.
    """
    bets = [_log_wealth(outcomes, np.full(outcomes.shape[1], 0.5), 2.0 * PRIOR)]
    bets += [] if foretold is None else [_log_wealth(outcomes, foretold, PROXY_PRIOR)]
    wealth = np.mean(np.exp(np.minimum(bets, 600.0)), axis=0)
    rows = np.arange(outcomes.shape[1])
    wealth[..., rows, rows] = np.inf
    return np.asarray(wealth, dtype=np.float64)


def _log_wealth(outcomes: Floats, rate: Floats, weight: float) -> Floats:
    before = np.cumsum(outcomes, axis=-1) - outcomes
    rounds = np.arange(outcomes.shape[-1])
    guess = (before + weight * rate[:, None] + 0.01) / (rounds + weight + 0.02)
    guess, y = np.swapaxes(guess, 1, 2), np.swapaxes(outcomes, 1, 2)  # (experiments, rounds, agents)
    a, b = guess[..., :, None], guess[..., None, :]
    null = (a + b) / 2.0
    lead = np.maximum(a - b, 0.0) / 2.0 / (null * (1.0 - null))
    steps = np.log1p((y[..., :, None] - null) * lead) + np.log1p(-(y[..., None, :] - null) * lead)
    return np.asarray(np.cumsum(steps, axis=1), dtype=np.float64)


def expected_rounds(rates: Floats, foretold: Floats | None, rng: np.random.Generator) -> int | None:
    """The median of rounds until the best is shown, were the rates these; None beyond 1000."""
    rivals = np.argsort(-rates)[:4]  # the nearest decide
    foretold = None if foretold is None else foretold[rivals]
    outcomes = (rng.random((PATHS, len(rivals), MOST_ROUNDS)) < rates[rivals][:, None]).astype(np.float64)
    least = wealth_of(outcomes, foretold)[:, :, 0].min(axis=-1) >= (len(rates) - 1) / LEVEL
    middle = int(np.median(np.where(least.any(axis=1), least.argmax(axis=1) + 1, MOST_ROUNDS + 1)))
    return middle if middle <= MOST_ROUNDS else None
