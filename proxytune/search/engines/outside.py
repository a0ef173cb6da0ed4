"""A proposer that is not ours: what it does wrong is told in one line, before a trial is wasted on it."""

from collections.abc import Sequence
from dataclasses import dataclass

from proxytune.errors import ExtensionError, ProxytuneError
from proxytune.extensions import ask, describe, require
from proxytune.search.engines.engine import Engine
from proxytune.search.goal import Goal
from proxytune.search.proposer import Proposer, Trial, Values
from proxytune.space import Space


@dataclass(frozen=True)
class Outside:
    """A proposer whose points are checked.

    Attributes:
        name: Of its engine.
        inner: The proposer.
    """

    name: str
    inner: Proposer

    def propose(self, space: Space, trials: Sequence[Trial], seed: int) -> Values:
        """Its next point.

        Raises:
            ExtensionError: If it raises, or proposes what is no point of the box.
        """
        values = ask(f"engine '{self.name}'", lambda: tuple(map(float, self.inner.propose(space, trials, seed))))
        sides = space.intervals
        if len(values) != len(sides) or not all(i.low <= v <= i.high for i, v in zip(sides, values, strict=True)):
            box = ", ".join(f"{side.name} in [{side.low:g}, {side.high:g}]" for side in sides)
            raise ExtensionError(f"engine '{self.name}' proposed {values}; give one value for each of {box}")
        return values


def outside_proposer(engine: Engine, goal: Goal | None) -> Proposer:
    """The proposer of an engine that is not shipped.

    Raises:
        ExtensionError: If making it raises, or makes no proposer.
    """
    try:
        made = engine.make(goal) if engine.learns_from == "outputs" else engine.make()
    except ProxytuneError:
        raise
    except Exception as problem:
        line = f"engine '{engine.name}' cannot be made: {describe(problem)}; it is made of a Goal"
        raise ExtensionError(f"{line} if it learns from outputs, of nothing if from scores") from problem
    require(made, ("propose",), name=engine.name, kind="engine")
    return Outside(engine.name, made)
