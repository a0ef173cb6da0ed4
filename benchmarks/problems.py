"""Problems that search engines are compared on: what one is, and two stand-ins for a study whose optimum is known."""

import math
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from proxytune.arrays import Floats
from proxytune.scores import Metric, ScoreTable
from proxytune.search import Goal, Values, from_unit, to_unit
from proxytune.space import Interval, Space
from proxytune.usefulness import prpv_of_means

Array = NDArray[np.float64]

BOX = Space(
    (
        Interval("blur", 0.0, 0.1, "s"),
        Interval("camera_pitch", 3.0, 35.0, "deg"),
        Interval("delay", 0.0, 0.3, "s"),
        Interval("trim", -0.3, 0.3),
    )
)
CEILING = 60.0
"""What the score rises to far from the optimum, as PRPV does to chance."""
STEP = 4
"""Height of a step: several pairs of agents flip together."""
NOISE = 2
"""Scores are off by a whole number from −2 to 2, each alike."""


class Objective(Protocol):
    """A problem that engines are compared on. A seed stands for one instance of the problem and its noise."""

    @property
    def name(self) -> str:
        """What it is called."""
        ...

    @property
    def space(self) -> Space:
        """The search box."""
        ...

    @property
    def tolerance(self) -> float:
        """A regret not above this cannot be told from none: the noise floor."""
        ...

    @property
    def seconds(self) -> float | None:
        """Simulated seconds that an evaluation takes; None where nothing is simulated."""
        ...

    @property
    def identity(self) -> str:
        """What determines its figures; if that changes, finished runs lose their meaning."""
        ...

    def score(self, values: Values, seed: int) -> float | None:
        """The noisy score that an engine is told, the same whenever it is asked for; None where the trial fails."""
        ...

    def failure(self, values: Values, seed: int) -> str:
        """Why there is no score; empty where there is one."""
        ...

    def outcome(self, values: Values, seed: int) -> Values | None:
        """What that score is computed from; None where the trial fails, or a score has no such parts."""
        ...

    def goal(self, seed: int) -> Goal | None:
        """What the outcomes are to come to; None where a score has no such parts."""
        ...

    def regret(self, values: Values, seed: int, lowest: float = math.inf) -> float | None:
        """How much worse than the optimum a visited point is; if no less than `lowest`, anything no less will do."""
        ...

    def fresh_score(self, values: Values, seed: int) -> float | None:
        """The score of the answer, free of the noise that the engine has seen."""
        ...

    def fresh_regret(self, values: Values, seed: int) -> float | None:
        """How much worse than the optimum the answer is, free of the noise that the engine has seen."""
        ...

    def truth(self, seed: int) -> Values | None:
        """The θ that made the target; None where it is not known."""
        ...

    def error(self, values: Values, seed: int) -> float | None:
        """Mean distance of the parameters from the true ones, in widths of the box; None where truth is not known."""
        ...


@dataclass(frozen=True)
class Analytic:
    """PRPV's stand-in over the paper's box of four parameters.

    With u the distance of each parameter from the seed's own optimum in widths of the box, the score without noise is
    4·⌊60 (1 − exp(−r)) / 4⌋, where r² = (2.5 trim)² + (1.5 (delay + 0.5 blur))² + (1.2 pitch)² + (0.3 blur)². So it
    is an integer, has plateaus, rises steeply from the optimum and levels off far away, hardly sees blur, and trades
    blur for delay. A whole number from −2 to 2 is added, drawn anew at every θ.
    """

    name: str = "analytic"
    space: Space = BOX
    tolerance: float = float(STEP)
    seconds: float | None = None
    identity: str = "analytic 1"

    def truth(self, seed: int) -> Values:
        """The true θ: each parameter drawn from the middle 60 % of its interval."""
        unit = np.random.default_rng([seed, 1]).uniform(0.2, 0.8, len(self.space.intervals))
        return tuple(i.low + float(u) * (i.high - i.low) for i, u in zip(self.space.intervals, unit, strict=True))

    def score(self, values: Values, seed: int) -> float:
        """The noisy score, drawn from the seed and the point alone."""
        bits = np.frombuffer(np.array(values, dtype=float).tobytes(), dtype=np.uint32)
        noise = np.random.default_rng([seed, 2, *bits.tolist()]).integers(-NOISE, NOISE, endpoint=True)
        return max(0.0, self.regret(values, seed) + NOISE + float(noise))

    def failure(self, values: Values, seed: int) -> str:
        """A formula never fails."""
        return ""

    def outcome(self, values: Values, seed: int) -> None:
        """A formula has no parts."""

    def goal(self, seed: int) -> None:
        """A formula has no parts."""

    def regret(self, values: Values, seed: int, lowest: float = math.inf) -> float:
        """The score without noise; 0 at the optimum."""
        blur, pitch, delay, trim = to_unit(self.space, values) - to_unit(self.space, self.truth(seed))
        far = math.hypot(2.5 * trim, 1.5 * (delay + 0.5 * blur), 1.2 * pitch, 0.3 * blur)
        return float(STEP * math.floor(CEILING * (1.0 - math.exp(-far)) / STEP))

    def fresh_score(self, values: Values, seed: int) -> float:
        """The score without noise."""
        return self.regret(values, seed)

    def fresh_regret(self, values: Values, seed: int) -> float:
        """The score without noise."""
        return self.regret(values, seed)

    def error(self, values: Values, seed: int) -> float:
        """Mean distance of the parameters from the true ones, in widths of the box."""
        return float(np.abs(to_unit(self.space, values) - to_unit(self.space, self.truth(seed))).mean())


AGENTS, EPISODES = 12, 10
METRICS = (Metric("distance"), Metric("survival_time"))
SPREAD = 0.15
"""Standard deviation of an episode's score; the agents' own best scores lie between 0.4 and 1."""

WEIGHTS = np.array([0.3, 1.5, 2.0, 3.0])
"""How hard blur, camera pitch, delay and trim hit an agent, typically, per width of the box."""


@dataclass(frozen=True)
class Ranking:
    """PRPV of made-up agents over the paper's box, against a target that was measured once.

    Agent a's mean on a metric is its best score times exp(−|w_a (u − u_a)|), where u is the distance from the seed's
    own optimum in widths of the box, w_a how sensitive it is to each parameter and u_a, on average 0, what it likes.
    Ten episodes with normal noise are averaged in the proxy and on the target. Regret is PRPV of the means without
    noise, which is 0 at the optimum; the floor of 14 is about what the optimum itself scores on ten episodes.
    """

    name: str = "ranking"
    space: Space = BOX
    tolerance: float = 14.0
    seconds: float | None = None
    identity: str = "ranking 1"

    def truth(self, seed: int) -> Values:
        """The true θ: each parameter drawn from the middle 60 % of its interval."""
        unit = np.random.default_rng([seed, 1]).uniform(0.2, 0.8, len(self.space.intervals))
        return from_unit(self.space, unit)

    def means(self, values: Values, seed: int) -> Floats:
        """Mean scores without noise, shape (agents, metrics)."""
        generator = np.random.default_rng([seed, 2])
        best = generator.uniform(0.4, 1.0, (AGENTS, len(METRICS)))
        weights = WEIGHTS * generator.lognormal(0.0, 0.7, (AGENTS, len(METRICS), len(WEIGHTS)))
        liked = generator.normal(0.0, 0.15, (AGENTS, 1, len(WEIGHTS)))
        away = to_unit(self.space, values) - to_unit(self.space, self.truth(seed))
        decay: Floats = np.exp(-np.linalg.norm(weights * (away - liked), axis=-1))
        return best * decay

    def table(self, values: Values, seed: int) -> ScoreTable:
        """The episodes that a study would drive at a θ, drawn from seed and θ alone."""
        bits = np.frombuffer(np.array(values, dtype=float).tobytes(), dtype=np.uint32)
        return _episodes(self.means(values, seed), np.random.default_rng([seed, 3, *bits.tolist()]))

    def target(self, seed: int) -> ScoreTable:
        """The target's episodes, measured once."""
        return _episodes(self.means(self.truth(seed), seed), np.random.default_rng([seed, 4]))

    def score(self, values: Values, seed: int) -> float:
        """PRPV of the episodes."""
        return float(prpv_of_means(self.table(values, seed).means, self.target(seed).means, METRICS))

    def failure(self, values: Values, seed: int) -> str:
        """None of them fails."""
        return ""

    def outcome(self, values: Values, seed: int) -> Values:
        """Every agent's mean metrics."""
        return tuple(self.table(values, seed).means.ravel().tolist())

    def goal(self, seed: int) -> Goal:
        """The target's mean metrics, and PRPV of such."""
        table = self.target(seed)
        names = tuple((agent, metric) for agent in table.agents for metric in table.metrics)
        noise = np.full(len(names), 2.0 * SPREAD**2 / EPISODES)
        return Goal(names, table.means.ravel(), noise, lambda outcomes: _composed(outcomes, table.means))

    def regret(self, values: Values, seed: int, lowest: float = math.inf) -> float:
        """PRPV without noise on either side."""
        return float(prpv_of_means(self.means(values, seed), self.means(self.truth(seed), seed), METRICS))

    def fresh_score(self, values: Values, seed: int) -> float:
        """PRPV without noise."""
        return self.regret(values, seed)

    def fresh_regret(self, values: Values, seed: int) -> float:
        """The same: it has no noise."""
        return self.regret(values, seed)

    def error(self, values: Values, seed: int) -> float:
        """Mean distance of the parameters from the true ones, in widths of the box."""
        return float(np.abs(to_unit(self.space, values) - to_unit(self.space, self.truth(seed))).mean())


def _composed(outcomes: Floats, target: Floats) -> Floats:
    return prpv_of_means(outcomes.reshape(*outcomes.shape[:-1], *target.shape), target, METRICS)


def _episodes(means: Floats, generator: np.random.Generator) -> ScoreTable:
    values = means[:, None, :] + generator.normal(0.0, SPREAD, (AGENTS, EPISODES, len(METRICS)))
    agents, episodes = (tuple(f"{i:02}" for i in range(count)) for count in (AGENTS, EPISODES))
    return ScoreTable(agents, episodes, tuple(metric.name for metric in METRICS), values)
