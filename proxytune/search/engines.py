"""The engines by name."""

from collections.abc import Sequence
from dataclasses import dataclass
from importlib.util import find_spec

from proxytune.errors import InputError
from proxytune.search.composite import Composite
from proxytune.search.design import design_point
from proxytune.search.gaussian_process import GaussianProcess
from proxytune.search.goal import Goal
from proxytune.search.outcomes import Outcomes
from proxytune.search.proposer import Proposer, Trial, Values, with_failures_as_worst
from proxytune.search.random_points import RandomPoints
from proxytune.search.scikit_optimize import ScikitOptimize
from proxytune.search.sobol import Sobol
from proxytune.search.tree_parzen import TreeParzen
from proxytune.settings import nearest
from proxytune.space import Space

DEFAULT_ENGINE = "outcomes"
SCORE_ENGINE = "gp"
"""The default where a score has no parts."""
WITH_OUTPUTS = (DEFAULT_ENGINE, "composite")
"""What learns from the outputs that a score is computed from."""
STUDY_ENGINES = (*WITH_OUTPUTS, SCORE_ENGINE, "random", "sobol", "tpe")
"""What a study may name."""
ENGINES = (*STUDY_ENGINES, "skopt")
"""What can be compared."""


@dataclass(frozen=True)
class AfterDesign:
    """A proposer that is asked only once the quasi-random design is through and something has a score.

    It is told of a failed trial as if that had the worst score seen. Where it proposes a pending point once more, the
    design goes on in its place: what is tried together differs.

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
        values = self.inner.propose(space, told, seed)
        again = any(trial.pending and trial.values == values for trial in trials)
        return design_point(space, len(trials), seed) if again else values


def why_not(engine: str, *, composed: bool) -> str:
    """Why an engine cannot be used, in one phrase; empty if it can.

    Args:
        engine: Its name.
        composed: Whether the score is computed from outcomes that are known.
    """
    if engine not in ENGINES:
        return f"unknown engine '{engine}'; {nearest(engine, ENGINES)}"
    if engine == "tpe" and find_spec("optuna") is None:
        return "'tpe' needs Optuna, which is not installed; pip install 'proxytune[tpe]', or use another engine"
    if engine in WITH_OUTPUTS and not composed:
        return f"'{engine}' models what a score is computed from, and this one has no such parts; use '{SCORE_ENGINE}'"
    return ""


def make_proposer(engine: str, initial: int, goal: Goal | None = None) -> Proposer:
    """The proposer of this name, with so many trials from the quasi-random design first: all engines share it.

    Args:
        engine: Its name.
        initial: How many trials come from the design.
        goal: What the outputs of a trial are to come to; None where a score has no such parts.

    Raises:
        InputError: If there is no such engine, or it cannot be used.
    """
    reason = why_not(engine, composed=goal is not None)
    if reason:
        raise InputError(reason)
    if goal is not None and engine in WITH_OUTPUTS:
        return AfterDesign(Outcomes(goal) if engine == DEFAULT_ENGINE else Composite(goal), initial)
    inner: dict[str, Proposer] = {
        "gp": GaussianProcess(),
        "random": RandomPoints(),
        "sobol": Sobol(),
        "tpe": TreeParzen(),
        "skopt": ScikitOptimize(),
    }
    return AfterDesign(inner[engine], initial)
