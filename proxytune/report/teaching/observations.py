"""The paper's two observations in sentences, with the evidence for or against each."""

from collections.abc import Mapping, Sequence

from proxytune.report.numbers import fixed, listed
from proxytune.teaching import Agreement, Experiment, Observations

FIRST = "A zero-shot score does not measure PLV (the paper's first observation)"
SECOND = "A proxy that predicts badly can still teach (the paper's second observation)"


def observation_lines(found: Observations | None, experiment: Experiment) -> tuple[str, ...]:
    """Both observations, each with its evidence; none where PLV is unknown, and the first of several proxies only."""
    if found is None:
        return ()
    starts = {one.name: f"{one.zero_shot.value:.1f}" for one in experiment.teachers if one.zero_shot.value is not None}
    first = [f"{FIRST}: {_first(found.zero_shot, starts)}."] if found.zero_shot else []
    return (*first, f"{SECOND}: {_second(found)}.")


def _first(found: Agreement, starts: Mapping[str, str]) -> str:
    pairs = [
        f"{ahead} saves more than {behind} though it starts lower ({starts[ahead]} for {starts[behind]})"
        for ahead, behind in found.reversed
    ]
    shown = f"shown here, since {listed(pairs)}" if pairs else "no pair of these proxies shows it"
    return f"{shown}; {_tau(found, 'zero-shot score')}"


def _second(found: Observations) -> str:
    poor = list(found.poor_predictors)
    shown = (
        f"shown here, since {listed(poor)} {_saves(poor)} samples though a random ranking would predict as well"
        if poor
        else "none of these proxies shows it"
    )
    return shown if found.prpv is None else f"{shown}; {_tau(found.prpv, 'PRPV')}"


def _saves(names: Sequence[str]) -> str:
    return "saves" if len(names) == 1 else "save"


def _tau(found: Agreement, figure: str) -> str:
    """Kendall's τ with its interval, and what it says."""
    interval = f"{fixed(found.low, 2)} to {fixed(found.high, 2)}"
    if found.low > 0.0:
        says = "more pairs agree than not"
    elif found.high < 0.0:
        says = "fewer pairs agree than not"
    else:
        says = "whether more pairs agree than not is open"
    figures = f"Kendall's τ between {figure} and PLV is {fixed(found.tau, 2)} ({interval})"
    return f"{figures}: of {found.proxies} proxies, {says}"
