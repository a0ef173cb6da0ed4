"""How a study's search went, a fact a row."""

from proxytune.study import StudyResult

Row = tuple[str, str]


def search_rows(result: StudyResult) -> list[Row]:
    """Trials and why they ended, the pre-flight, trials stopped early, what PRPV depends on, what failed."""
    rows = [trials_row(result), *preflight_rows(result), *cut_rows(result), importance_row(result)]
    return [*rows, *failure_rows(result)]


def trials_row(result: StudyResult) -> Row:
    """How many trials there are, which is the best, and why the search ended, where it did."""
    count, budget = len(result.trials), result.study.settings.budget
    spent = f"{count} (budget {budget})" if count > budget else f"{count} of {budget}"
    ended = f"; ended: {result.stopped}" if result.stopped else ""
    return ("trials", f"{spent}; best: trial {result.best.trial.number}{ended}")


def cut_rows(result: StudyResult) -> list[Row]:
    """How many trials were stopped early and what that saved; nothing where none was."""
    if not result.cut:
        return []
    episodes, seconds = result.spared
    count = f"{len(result.cut)} trial{'' if len(result.cut) == 1 else 's'}"
    return [("stopped early", f"{count} that could not be the best; saved {episodes} episodes ({seconds:.3g} s)")]


def preflight_rows(result: StudyResult) -> list[Row]:
    """Which parameters change no metric beyond noise, or that all do; nothing where there was no pre-flight."""
    if result.preflight is None:
        return []
    warnings = [("pre-flight", line.removeprefix("pre-flight: ")) for line in result.preflight.warnings]
    return warnings or [("pre-flight", "every parameter changes some metric beyond noise")]


def importance_row(result: StudyResult) -> Row:
    """The total Sobol index of each parameter: its share in PRPV's variance over the box, with its 95 % interval."""
    ordered = sorted(result.importances, key=lambda one: -one.share)
    shares = [f"{one.name} {one.share:.2f} ({one.interval[0]:.2f} to {one.interval[1]:.2f})" for one in ordered]
    return ("Sobol index", f"total, of PRPV over the box: {', '.join(shares)}")


def failure_rows(result: StudyResult) -> list[Row]:
    """How many episodes and trials failed, and the first of them; nothing where none did."""
    if not result.failed_episodes:
        return []
    failed = sum(trial.state == "failed" for trial in result.trials)
    trials = f", and with them {failed} of {len(result.trials)} trials" if failed else ""
    head = f"{result.failed_episodes} of {result.episodes} episodes{trials}; the first:"
    return [("failed", head), *(("", line) for line in result.failures)]
