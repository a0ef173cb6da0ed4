"""Engines: what each says of itself (`Engine`), the design that all share, and the two that learn nothing.

Nothing else in the package knows one engine from another. The first trials are a quasi-random design, a scrambled Sobol
sequence that fills the box evenly (`design_point`); after it comes the engine's own proposer (`AfterDesign`). What a
proposer that is not ours does wrong is told in one line, before a trial is wasted on it (`CheckedProposer`). The engine
`random` draws points evenly and independently, which every search has to beat; `sobol` goes on with the design.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.stats import qmc

from proxytune.errors import ExtensionError, ProxytuneError
from proxytune.extensions import ask, describe, require
from proxytune.search.loop import Goal, Proposer, Trial, Values, with_failures_as_worst
from proxytune.seeds import proposal_seed
from proxytune.space import Space


class Library(NamedTuple):
    """A library that an engine needs: the modules it is of, how people call it, and the extra that installs it."""

    modules: tuple[str, ...]
    name: str
    extra: str


class Look(NamedTuple):
    """The line by which an engine is drawn where several are compared."""

    colour: str  # a colour as Matplotlib has it
    line: Literal["solid", "dashed", "dotted", "dashdot"] = "solid"  # a line as Matplotlib has it


@dataclass(frozen=True)
class Engine:
    """A search engine with all that is to be known of it.

    Attributes:
        name: What people type to have it.
        label: What it is called in a list.
        summary: One line on how it proposes.
        make: Makes the proposer: of a Goal if the engine learns from outputs, of nothing if it learns from scores.
        learns_from: Every agent's every metric ("outputs"), or the score that is composed of them alone ("scores").
        in_studies: Whether a study may name it; else it is for `compare` only.
        needs: A library that has to be installed besides; None if none is.
        look: How it would like to be drawn; None leaves that to the figure.
    """

    name: str
    label: str
    summary: str
    make: Callable[..., Proposer]
    learns_from: Literal["outputs", "scores"] = "scores"
    in_studies: bool = True
    needs: Library | None = None
    look: Look | None = None


def unit_points(dimensions: int, count: int, seed: int) -> NDArray[np.float64]:
    """The first points (count, dimensions) of the scrambled Sobol sequence with this seed, within [0, 1).

    A longer answer begins with every shorter one.
    """
    exponent = max(0, math.ceil(math.log2(count)))
    sequence = qmc.Sobol(dimensions, scramble=True, rng=np.random.default_rng(seed))
    points: NDArray[np.float64] = sequence.random_base2(exponent)
    return points[:count]


def design_point(space: Space, index: int, seed: int) -> Values:
    """The point number `index` (from 0) of the design: given by index and seed alone."""
    unit = unit_points(len(space.intervals), index + 1, seed)[index]
    return from_unit(space, unit)


def from_unit(space: Space, unit: NDArray[np.float64]) -> Values:
    """A point of the unit cube as values in the box, never beyond its bounds."""
    pairs = zip(space.intervals, unit, strict=True)
    return tuple(min(max(i.low + float(u) * (i.high - i.low), i.low), i.high) for i, u in pairs)


def to_unit(space: Space, values: Values) -> NDArray[np.float64]:
    """Values in the box as a point of the unit cube."""
    pairs = zip(space.intervals, values, strict=True)
    return np.array([(value - i.low) / (i.high - i.low) for i, value in pairs])


@dataclass(frozen=True)
class AfterDesign:
    """A proposer that is asked only once the quasi-random design is through and something has a score.

    It is told of a failed trial as if that had the worst score seen. Where it proposes a pending point once more, the
    design goes on in its place: what is tried together differs.
    """

    inner: Proposer
    initial: int

    def propose(self, space: Space, trials: Sequence[Trial], seed: int) -> Values:
        """The next point: of the design, or what the inner proposer says."""
        told, count = with_failures_as_worst(trials), sum(not trial.low_fidelity for trial in trials)
        if count < self.initial or not told:
            return design_point(space, count, seed)
        values = self.inner.propose(space, told, seed)
        again = any(trial.pending and trial.values == values for trial in trials)
        return design_point(space, count, seed) if again else values


@dataclass(frozen=True)
class CheckedProposer:
    """A proposer whose points are checked, under its engine's name."""

    name: str
    inner: Proposer

    def propose(self, space: Space, trials: Sequence[Trial], seed: int) -> Values:
        """Its next point, refused if it is no point of the box."""
        values = ask(f"engine '{self.name}'", lambda: tuple(map(float, self.inner.propose(space, trials, seed))))
        sides = space.intervals
        if len(values) != len(sides) or not all(i.low <= v <= i.high for i, v in zip(sides, values, strict=True)):
            box = ", ".join(f"{side.name} in [{side.low:g}, {side.high:g}]" for side in sides)
            raise ExtensionError(f"engine '{self.name}' proposed {values}; give one value for each of {box}")
        return values


def outside_proposer(engine: Engine, goal: Goal | None) -> Proposer:
    """The proposer of an engine that is not shipped, refused if making it raises or makes none."""
    try:
        made = engine.make(goal) if engine.learns_from == "outputs" else engine.make()
    except ProxytuneError:
        raise
    except Exception as problem:
        line = f"engine '{engine.name}' cannot be made: {describe(problem)}; it is made of a Goal"
        raise ExtensionError(f"{line} if it learns from outputs, of nothing if from scores") from problem
    require(made, ("propose",), name=engine.name, kind="engine")
    return CheckedProposer(engine.name, made)


@dataclass(frozen=True)
class RandomPoints:
    """Proposes points drawn evenly over the box, whatever the scores."""

    def propose(self, space: Space, trials: Sequence[Trial], seed: int) -> Values:
        """The next point, a function of the number of trials and the seed alone."""
        generator = np.random.default_rng(proposal_seed(seed, len(trials)))
        return from_unit(space, generator.random(len(space.intervals)))


RANDOM = Engine(
    name="random",
    label="random points",
    summary="points drawn evenly over the box; learns nothing",
    make=RandomPoints,
    look=Look("0.55", "dotted"),
)


@dataclass(frozen=True)
class Sobol:
    """Proposes the next point of the scrambled Sobol sequence, whatever the scores."""

    def propose(self, space: Space, trials: Sequence[Trial], seed: int) -> Values:
        """The next point, a function of the number of trials and the seed alone."""
        return design_point(space, len(trials), seed)


SOBOL = Engine(
    name="sobol",
    label="Sobol sequence",
    summary="the quasi-random design gone on with; learns nothing",
    make=Sobol,
    look=Look("0.55", "dashdot"),
)
