"""What the figures of a study are of, and what to see in them."""

from collections.abc import Mapping

from proxytune.report.page.parts import Picture
from proxytune.study import StudyResult

TITLES = {
    "profiles": "What is left of each parameter's range",
    "convergence": "How the answer improved over the trials",
    "importance": "Which parameters change PRPV most",
    "evaluations": "Where the trials were, and what they leave of the box",
}


def pictures(result: StudyResult, figures: Mapping[str, bytes]) -> dict[str, Picture]:
    """Each figure that there is, by its name, with its caption."""
    captions = {
        "profiles": _profiles(result),
        "convergence": _convergence(result),
        "importance": "A dot is the share in the variance of PRPV over the box that a parameter takes part in; the "
        "stroke is what it does alone. Lines are 95 % intervals: where they overlap, the order is not known. Where a "
        "dot stands near the lower end of its line, the true share may well be larger, but hardly smaller.",
        "evaluations": f"Darker points have lower PRPV{_open(result)}. The shadow is the 95 % region: where it is "
        f"long and slanting, two parameters make up for each other. The ring is the answer.{_truth(result)}",
    }
    return {name: Picture(TITLES[name], image, captions[name]) for name, image in figures.items()}


def _profiles(result: StudyResult) -> str:
    excluded = "Grey values are excluded (95 %), the others remain; the higher the curve, the more probable the value."
    nothing = " Where almost nothing is grey, the parameter is unidentified: these trials exclude almost no value."
    unidentified = nothing if result.knowledge.unidentified else ""
    return f"{excluded}{unidentified} The vertical line is the answer.{_truth(result)}"


def _convergence(result: StudyResult) -> str:
    line = "The line is the answer so far, the θ of lowest expected score, which need not be the luckiest point."
    again = result.confirmation is not None and result.confirmation.answer.assessment is not None
    fresh = " The diamond is the answer in episodes that the search has not seen: only that is free of luck."
    floor = " What lies within the green band is within noise." if result.floor.value is not None else ""
    return f"{line}{fresh if again else ''}{floor}"


def _open(result: StudyResult) -> str:
    cut = any(trial.bound is not None for trial in result.trials)
    return "; open ones were stopped early, and theirs is an estimate" if cut else ""


def _truth(result: StudyResult) -> str:
    return "" if result.truth is None else " The triangle is the θ that made the target."
