"""A study with another budget or other jobs than its study.toml says: its trials do not depend on either."""

from dataclasses import replace

from proxytune.errors import InputError
from proxytune.study.settings import LEARNING
from proxytune.study.study import Study

MOST_TRIALS, MOST_JOBS = 100_000, 1024


def with_spending(study: Study, *, budget: int | None = None, jobs: int | None = None) -> Study:
    """The study with this budget [trials] and this many processes; None leaves what study.toml says.

    Raises:
        InputError: If one is out of bounds, or the study's trials are not the ones that a budget counts.
    """
    for name, value, most in (("budget", budget, MOST_TRIALS), ("jobs", jobs, MOST_JOBS)):
        if value is not None and not 1 <= value <= most:
            raise InputError(f"{name} must be between 1 and {most}, got {value}")
    settings = study.settings
    if budget is not None and settings.objective == LEARNING:
        raise settings.error(
            "budget", f"a search for '{LEARNING}' has its own; set teaching.budget in this file instead"
        )
    spending = replace(settings, budget=budget or settings.budget, jobs=jobs or settings.jobs)
    return replace(study, settings=spending)
