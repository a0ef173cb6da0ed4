"""How a study's search went, in lines for people."""

from proxytune.study.result import StudyResult


def search_lines(result: StudyResult) -> list[str]:
    """How the search went: its trials, the pre-flight, what was cut off, how it ended, what mattered, what failed."""
    settings = result.study.settings
    trials = f"{settings.name}: {len(result.trials)} of {settings.budget} trials"
    head = f"{trials}; best is trial {result.best.trial.number}"
    ended = [f"stopped: {result.stopped}"] if result.stopped else []
    went = [*preflight_lines(result), *cut_lines(result), *ended, importance_line(result)]
    return [head, *went, *failure_lines(result)]


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


def failure_lines(result: StudyResult) -> list[str]:
    """How many episodes and trials failed, and the first of them; nothing where none did."""
    if not result.failed_episodes:
        return []
    failed_trials = sum(trial.state == "failed" for trial in result.trials)
    trials = f", and with them {failed_trials} of {len(result.trials)} trials" if failed_trials else ""
    head = f"{result.failed_episodes} of {result.episodes} episodes failed{trials}; the first:"
    return [head, *(f"  {line}" for line in result.failures)]
