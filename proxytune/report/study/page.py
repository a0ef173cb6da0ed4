"""A study as a page: what was found, what to do next, and all that it stands on."""

import shlex
from collections.abc import Mapping

from proxytune.report.page.foot import foot_of
from proxytune.report.page.parts import Page, Picture, Table, Words
from proxytune.report.study.captions import pictures
from proxytune.report.study.finding import finding_of
from proxytune.report.study.information_table import INFORMATION_COLUMNS, information_rows
from proxytune.report.study.search_rows import search_rows
from proxytune.report.study.table import INFORMATION, SEARCH, THETA, USEFULNESS
from proxytune.report.study.theta_table import theta_columns, theta_notes, theta_rows
from proxytune.report.study.trials_table import trials_table
from proxytune.report.study.usefulness_table import USEFULNESS_COLUMNS, usefulness_notes, usefulness_rows
from proxytune.report.study.verdict import answer, next_step
from proxytune.study import StudyResult, StudySettings


def study_page(result: StudyResult, figures: Mapping[str, bytes], command: str = "") -> Page:
    """A study as a page.

    Args:
        result: What it has found.
        figures: PNG files by the name of the figure, those that there are.
        command: What was typed; the study's own command where nothing is given.
    """
    finding, settings = finding_of(result), result.study.settings
    foot = foot_of(command or study_command(settings), study_settings(settings))
    return Page(settings.name, answer(finding), next_step(finding), _parts(result, figures), foot)


def study_command(settings: StudySettings) -> str:
    """The command that runs a study."""
    return f"python -m proxytune study {shlex.quote(str(settings.home))}"


def study_settings(settings: StudySettings) -> list[tuple[str, str]]:
    """What study.toml says, as names and values."""
    return [
        ("domain family", settings.family),
        ("proxy", settings.proxy.name if settings.proxy else "the family's nominal model"),
        ("target", ", ".join(path.name for path in settings.targets)),
        ("metrics", ", ".join(str(metric) for metric in settings.metrics)),
        ("agents", ", ".join(settings.agents)),
        ("starts", str(settings.starts)),
        ("engine", settings.engine),
        ("seed", str(settings.seed)),
    ]


def _parts(result: StudyResult, figures: Mapping[str, bytes]) -> tuple[Picture | Table | Words, ...]:
    """What the terminal shows below the sentence, under the same heads, with the figures beside what they are of."""
    drawn, informed = pictures(result, figures), information_rows(result)
    theta = Table(THETA, theta_columns(result), tuple(theta_rows(result)), tuple(theta_notes(result)))
    usefulness = Table(USEFULNESS, USEFULNESS_COLUMNS, tuple(usefulness_rows(result)), tuple(usefulness_notes(result)))
    information = Table(INFORMATION, INFORMATION_COLUMNS, tuple(informed)) if informed else None
    parts = (
        theta,
        drawn.get("profiles"),
        usefulness,
        drawn.get("convergence"),
        information,
        drawn.get("importance"),
        drawn.get("evaluations"),
        Table(SEARCH, (), tuple(search_rows(result))),
        Words("What PRPV and the intervals are", (_meaning(result),)),
        trials_table(result.trials, result.study.settings.space.names),
    )
    return tuple(part for part in parts if part is not None)


def _meaning(result: StudyResult) -> str:
    agents = len(result.study.settings.agents)
    return (
        "PRPV, the proxy relative predictivity value, counts on how many ordered pairs of the "
        f"{agents} agents proxy and target disagree which is the better. The best θ is the visited one of lowest "
        "expected PRPV, given all trials and fresh episodes. The 95 % interval holds the values that agree with every "
        "agent's every metric on the target; “by PRPV alone” those whose PRPV is as low as the best, within noise."
    )
