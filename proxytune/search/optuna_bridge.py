"""The bridge to other optimisers: Optuna's tree-structured Parzen estimator as an engine, and trials as they keep them.

The engine `tpe` is there where Optuna is installed. A `History` is written as an Optuna storage (`write_optuna`) or as
scikit-optimize's OptimizeResult (`write_skopt`).
"""

import warnings
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import Any, Literal

from proxytune.errors import InputError, to_install
from proxytune.files import temporary_folder
from proxytune.search.engine import Engine, Library, Look
from proxytune.search.loop import Trial, Values
from proxytune.seeds import proposal_seed
from proxytune.space import Space, Theta


@dataclass(frozen=True)
class TreeParzen:
    """Proposes what Optuna's TPE sampler suggests, with its defaults but for the start: the design stands in for it.

    Optuna's study is built anew from the trials at every proposal, in memory, so nothing is remembered. Its sampler
    weighs later trials more, so the order of the trials counts. Pending trials are running ones to it, which it takes
    for bad ("constant liar").
    """

    def propose(self, space: Space, trials: Sequence[Trial], seed: int) -> Values:
        """The next point, a function of the seed and the trials in their order; those not pending need a score."""
        import optuna

        drawn = proposal_seed(seed, len(trials))
        with quiet(optuna.logging):
            sampler = optuna.samplers.TPESampler(n_startup_trials=1, seed=drawn, constant_liar=True)
            return suggested(optuna, sampler, space, trials)


def suggested(optuna: Any, sampler: Any, space: Space, trials: Sequence[Trial]) -> Values:
    """The suggestion of a sampler of Optuna after these trials; pending ones are running to it."""
    box = {i.name: optuna.distributions.FloatDistribution(i.low, i.high) for i in space.intervals}
    study = optuna.create_study(sampler=sampler, direction="minimize")
    for trial in trials:
        theta = space.theta(trial.values)
        state = optuna.trial.TrialState.RUNNING if trial.pending else optuna.trial.TrialState.COMPLETE
        study.add_trial(optuna.trial.create_trial(params=theta, distributions=box, value=trial.score, state=state))
    return space.values(study.ask(box).params)


@contextmanager
def quiet(logging: Any) -> Iterator[None]:
    """Without the lines that Optuna writes: of every study, of what is experimental, of what would be faster."""
    before = logging.get_verbosity()
    logging.set_verbosity(logging.ERROR)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            yield
    finally:
        logging.set_verbosity(before)


TREE_PARZEN = Engine(
    name="tpe",
    label="Optuna's TPE",
    summary="Optuna's tree-structured Parzen estimator with its defaults",
    make=TreeParzen,
    needs=Library(("optuna",), "Optuna", "tpe"),
    look=Look("#009E73", "dashed"),
)


Value = float | int | str | None


@dataclass(frozen=True)
class PastTrial:
    """A trial that has ended."""

    theta: Theta  # where it was
    state: Literal["finished", "cut", "failed"]  # whether it was measured to its end, cut off before, or failed
    value: float | None  # the objective there; None unless it was measured
    facts: Mapping[str, Value]  # what else is known of it, by name


@dataclass(frozen=True)
class History:
    """The trials of a search."""

    name: str  # what the search is called
    space: Space  # the box that was searched
    trials: tuple[PastTrial, ...]  # in their order
    maximise: bool  # whether more of the objective is better
    answer: int  # the place in `trials` of the one that the search holds for the best


UNDATED = datetime(2000, 1, 1)
"""The start and end of every trial that is written: when it was driven is not known."""


def write_optuna(history: History, path: Path) -> None:
    """Write an Optuna storage, an SQLite file with one study of one trial per trial.

    Of a trial that was cut off the state is PRUNED, of one that failed FAIL. What else is known of a trial is its user
    attributes, and the study's `best_trial` the number, as Optuna counts, of the search's own answer.

    Raises:
        InputError: If Optuna is not installed.
    """
    try:
        import optuna
    except ImportError:
        raise InputError(f"an Optuna storage needs Optuna, which is not installed; {to_install('tpe')}") from None
    with quiet(optuna.logging), temporary_folder() as folder:
        # An address has characters that mean something in it; the name of a user's file may have them too.
        draft = folder / "storage.sqlite3"
        storage = optuna.storages.RDBStorage(f"sqlite:///{draft}")
        direction: Literal["minimize", "maximize"] = "maximize" if history.maximise else "minimize"
        study = optuna.create_study(storage=storage, study_name=history.name, direction=direction)
        study.add_trials([_optuna_trial(optuna, history.space, trial) for trial in history.trials])
        study.set_user_attr("best_trial", history.answer)
        storage.remove_session()
        storage.engine.dispose()
        path.write_bytes(draft.read_bytes())


def _optuna_trial(optuna: Any, space: Space, trial: PastTrial) -> Any:
    states = optuna.trial.TrialState
    past = optuna.trial.create_trial(
        state={"finished": states.COMPLETE, "cut": states.PRUNED, "failed": states.FAIL}[trial.state],
        params={name: trial.theta[name] for name in space.names},
        distributions={one.name: optuna.distributions.FloatDistribution(one.low, one.high) for one in space.intervals},
        value=trial.value,
        user_attrs=dict(trial.facts),
    )
    # The time of writing would make every copy another
    past.datetime_start = past.datetime_complete = UNDATED
    return past


def optimize_result(history: History) -> Any:
    """scikit-optimize's OptimizeResult: x, fun, x_iters, func_vals, space.

    Values are made small, so an objective that is to be large has its sign turned. Trials that were cut off or failed
    have no value and are left out. `x` is the search's own answer and `fun` the value of its trial: the lowest of
    `func_vals` would be partly luck.
    """
    import numpy as np
    from scipy.optimize import OptimizeResult
    from skopt.space import Real, Space as Box

    sign = -1.0 if history.maximise else 1.0
    points = [[trial.theta[name] for name in history.space.names] for trial in history.trials]
    measured = [place for place, trial in enumerate(history.trials) if trial.value is not None]
    values = [sign * value for trial in history.trials if (value := trial.value) is not None]
    found = OptimizeResult()
    found.update(
        x=points[history.answer],
        fun=values[measured.index(history.answer)],
        x_iters=[points[place] for place in measured],
        func_vals=np.array(values),
        space=Box([Real(one.low, one.high, name=one.name) for one in history.space.intervals]),
        models=[],
        random_state=None,
        specs=None,
    )
    return found


def write_skopt(history: History, path: Path) -> None:
    """Write the OptimizeResult, to be read by `skopt.load`."""
    from skopt import dump

    dump(optimize_result(history), path)
