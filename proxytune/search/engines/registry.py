"""The engines by name."""

from collections.abc import Callable
from importlib.util import find_spec

from proxytune.errors import InputError
from proxytune.search.digest import code_of
from proxytune.search.engines import after_design
from proxytune.search.engines.after_design import AfterDesign
from proxytune.search.engines.botorch_nei import BotorchNEI
from proxytune.search.engines.composite import Composite
from proxytune.search.engines.gaussian_process import GaussianProcess
from proxytune.search.engines.optuna_gp import OptunaGP
from proxytune.search.engines.outcomes import Outcomes
from proxytune.search.engines.random_points import RandomPoints
from proxytune.search.engines.scikit_optimize import ScikitOptimize
from proxytune.search.engines.sobol import Sobol
from proxytune.search.engines.tree_parzen import TreeParzen
from proxytune.search.goal import Goal
from proxytune.search.proposer import Proposer
from proxytune.settings import nearest

DEFAULT_ENGINE = "outcomes"
SCORE_ENGINE = "gp"
"""The default where a score has no parts."""
WITH_OUTPUTS = (DEFAULT_ENGINE, "composite")
"""What learns from the outputs that a score is computed from."""
STUDY_ENGINES = (*WITH_OUTPUTS, SCORE_ENGINE, "random", "sobol", "tpe")
"""What a study may name."""
ENGINES = (*STUDY_ENGINES, "skopt", "gpsampler", "qlognei")
"""What can be compared."""
OF_OUTPUTS: dict[str, Callable[[Goal], Proposer]] = {DEFAULT_ENGINE: Outcomes, "composite": Composite}
OF_SCORES: dict[str, Callable[[], Proposer]] = {
    SCORE_ENGINE: GaussianProcess,
    "random": RandomPoints,
    "sobol": Sobol,
    "tpe": TreeParzen,
    "skopt": ScikitOptimize,
    "gpsampler": OptunaGP,
    "qlognei": BotorchNEI,
}
NEEDS = {
    "tpe": (("optuna",), "Optuna", "tpe"),
    "gpsampler": (("optuna", "torch"), "Optuna and PyTorch", "peers"),
    "qlognei": (("botorch",), "BoTorch", "peers"),
}
"""Modules that an engine needs, what they are called, and the extra that installs them."""


def why_not(engine: str, *, composed: bool) -> str:
    """Why an engine cannot be used, in one phrase; empty if it can.

    Args:
        engine: Its name.
        composed: Whether the score is computed from outcomes that are known.
    """
    if engine not in ENGINES:
        return f"unknown engine '{engine}'; {nearest(engine, ENGINES)}"
    modules, called, extra = NEEDS.get(engine, ((), "", ""))
    if any(find_spec(module) is None for module in modules):
        verb = "are" if len(modules) > 1 else "is"
        remedy = f"pip install 'proxytune[{extra}]', or use another engine"
        return f"'{engine}' needs {called}, which {verb} not installed; {remedy}"
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
        return AfterDesign(OF_OUTPUTS[engine](goal), initial)
    return AfterDesign(OF_SCORES[engine](), initial)


def engine_code(engine: str) -> str:
    """A digest of the code that an engine's proposals depend on."""
    return code_of(after_design.__name__, {**OF_OUTPUTS, **OF_SCORES}[engine].__module__)
