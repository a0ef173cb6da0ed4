"""A study's result for people: on the terminal."""

from collections.abc import Mapping
from typing import Any

from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from proxytune.study.result import StudyResult

BEST_COLUMNS = ("parameter", "best", "not worse", "searched")


def best_theta(result: StudyResult) -> list[tuple[str, str, str, str]]:
    """Parameter, value with unit, the values not worse beyond noise, and the box searched, as texts."""
    known = result.study.family.parameters
    rows = []
    for interval, profile in zip(result.study.settings.space.intervals, result.profiles, strict=True):
        value = f"{result.best.trial.theta[interval.name]:.4g} {known[interval.name].unit}".strip()
        low, high = profile.interval
        not_worse = "unidentified" if profile.unidentified else f"{low:.3g} to {high:.3g}"
        rows.append((interval.name, value, not_worse, f"[{interval.low:g}, {interval.high:g}]"))
    return rows


def identity_lines(result: StudyResult) -> list[str]:
    """What the pre-flight found, which parameters PRPV does not see, what was cut off, and how the study ended."""
    names = ", ".join(result.unidentified)
    unseen = [f"unidentified: {names}; any value in the box is as good, beyond noise"] if names else []
    ended = [f"stopped: {result.stopped}"] if result.stopped else []
    return [*preflight_lines(result), *unseen, *cut_lines(result), *ended]


def cut_lines(result: StudyResult) -> list[str]:
    """How many trials were cut off and what that spared; nothing where none was."""
    if not result.cut:
        return []
    episodes, seconds = result.spared
    saved = f"{episodes} episodes saved, about {seconds:.3g} s of simulation"
    return [f"cut off: {len(result.cut)} trials that could not be among the best; {saved}"]


def preflight_lines(result: StudyResult) -> list[str]:
    """Which parameters do nothing beyond noise, or that all do; nothing where there was no pre-flight."""
    if result.preflight is None:
        return []
    return [*result.preflight.warnings] or ["pre-flight: every parameter changes the metrics beyond noise"]


def importance_line(result: StudyResult) -> str:
    """How much of PRPV's variance over the box each parameter takes part in, most first, with its interval."""
    ordered = sorted(result.importances, key=lambda found: -found.share)
    shares = [f"{found.name} {found.share:.0%} ({_ends(found.interval)})" for found in ordered]
    return f"share in PRPV's variance over the box, alone or with others: {', '.join(shares)}"


def _ends(interval: tuple[float, float]) -> str:
    return f"{100 * interval[0]:.0f} to {100 * interval[1]:.0f}"


def usefulness_lines(result: StudyResult) -> list[str]:
    """PRPV with its interval, PPV, noise floor and chance, one line each, then what to take with care."""
    found = result.best.assessment
    inner, floor = found.prpv_interval, found.noise_floor
    interval = "" if inner.low is None else f", interval {inner.low:.1f} to {inner.high:.1f}"
    worst = found.prpv.range[1]
    lines = [f"PRPV {found.prpv.value} of at most {worst}{interval}; lower is better", *fresh_lines(result)]
    if found.ppv.value is not None:
        lines.append(f"PPV {found.ppv.value:.3g}; lower is better")
    if floor.value is not None:
        lines.append(f"noise floor {floor.value:.1f} ({floor.low:.1f} to {floor.high:.1f}): the target against itself")
    lines.append(f"chance {found.chance.mean:.1f} ± {found.chance.deviation:.1f}: a proxy that knows nothing")
    return [*lines, *found.notes, *failure_lines(result)]


def fresh_lines(result: StudyResult) -> list[str]:
    """PRPV of the best θ on fresh episodes, and how much of the search's own was luck; nothing without them."""
    if result.confirmation is None:
        return []
    answer, rivals = result.confirmation.answer, len(result.confirmation.candidates) - 1
    if answer.assessment is None or answer.optimism is None:
        return ["fresh episodes: no PRPV, since an agent failed in all of them"]
    inner = answer.assessment.prpv_interval
    interval = "" if inner.low is None else f", interval {inner.low:.1f} to {inner.high:.1f}"
    luck = f"{answer.optimism:.3g} of it was luck" if answer.optimism > 0 else "it was not luck"
    compared = f"; confirmed against {rivals} θ nearly as good" if rivals else ""
    return [f"on fresh episodes PRPV {answer.assessment.prpv.value}{interval}: {luck}{compared}"]


def failure_lines(result: StudyResult) -> list[str]:
    """How many episodes and trials failed, and the first of them; nothing where none did."""
    if not result.failed_episodes:
        return []
    failed_trials = sum(trial.state == "failed" for trial in result.trials)
    trials = f", and with them {failed_trials} of {len(result.trials)} trials" if failed_trials else ""
    head = f"{result.failed_episodes} of {result.episodes} episodes failed{trials}; the first:"
    return [head, *(f"  {line}" for line in result.failures)]


def study_table(result: StudyResult, spent: str, files: Mapping[str, Any]) -> RenderableType:
    """The result of a study as `study` shows it."""
    settings = result.study.settings
    table = Table(box=None, pad_edge=False)
    for column in BEST_COLUMNS:
        table.add_column(column)
    for row in best_theta(result):
        table.add_row(*row)
    head = (
        f"{settings.name}: {len(result.trials)} of {settings.budget} trials; best is trial {result.best.trial.number}"
    )
    lines = [
        *identity_lines(result),
        *usefulness_lines(result),
        importance_line(result),
        spent,
        *(f"{what}: {path}" for what, path in files.items()),
    ]
    return Group(Text(head), table, *(Text(line) for line in lines))
