"""An analytic stand-in for a study: fast, like PRPV in what makes it hard, and with an optimum that is known."""

import math
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from proxytune.search import Goal, Values, to_unit
from proxytune.space import Interval, Space

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
    """What engines are compared on. A seed stands for one instance of the problem and its noise."""

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
