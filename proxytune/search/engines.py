"""The engines by name."""

from collections.abc import Sequence
from dataclasses import dataclass
from importlib.util import find_spec

from proxytune.errors import InputError
from proxytune.search.design import design_point
from proxytune.search.gaussian_process import GaussianProcess
from proxytune.search.proposer import Proposer, Trial, Values, with_failures_as_worst
from proxytune.search.random_points import RandomPoints
from proxytune.search.scikit_optimize import ScikitOptimize
from proxytune.search.sobol import Sobol
from proxytune.search.tree_parzen import TreeParzen
from proxytune.settings import nearest
from proxytune.space import Space

DEFAULT_ENGINE = "gp"
STUDY_ENGINES = (DEFAULT_ENGINE, "random", "sobol", "tpe")
"""What a study may name."""
ENGINES = (*STUDY_ENGINES, "skopt")
"""What can be compared."""


@dataclass(frozen=True)
class AfterDesign:
    """A proposer that is asked only once the quasi-random design is through and something has a score.

    It is told of a failed trial as if that had the worst score seen.

    Attributes:
        inner: The proposer.
        initial: How many trials come from the design.
    """

    inner: Proposer
    initial: int

    def propose(self, space: Space, trials: Sequence[Trial], seed: int) -> Values:
        """The next point: of the design, or what the inner proposer says."""
        told = with_failures_as_worst(trials)
        if len(trials) < self.initial or not told:
            return design_point(space, len(trials), seed)
        return self.inner.propose(space, told, seed)


def installed(engine: str) -> bool:
    """Whether the library that an engine needs is there."""
    return engine != "tpe" or find_spec("optuna") is not None


def make_proposer(engine: str, initial: int) -> Proposer:
    """The proposer of this name, with so many trials from the quasi-random design first: all engines share it.

    Raises:
        InputError: If there is no such engine, or it needs a library that is not installed.
    """
    if engine not in ENGINES:
        raise InputError(f"unknown engine '{engine}'; {nearest(engine, ENGINES)}")
    if not installed(engine):
        raise InputError(
            "'tpe' needs Optuna, which is not installed; pip install 'proxytune[tpe]', or use another engine"
        )
    inner: dict[str, Proposer] = {
        "gp": GaussianProcess(),
        "random": RandomPoints(),
        "sobol": Sobol(),
        "tpe": TreeParzen(),
        "skopt": ScikitOptimize(),
    }
    return AfterDesign(inner[engine], initial)
