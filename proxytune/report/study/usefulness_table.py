"""How useful the proxy is at the best θ: a row per measure, and what to keep in mind."""

from proxytune.report.numbers import Ends, fixed, probability, short
from proxytune.study import PRPV, Confirmation, StudyResult
from proxytune.usefulness import PAIRED, PERFECT, Assessment, NoiseFloor

Row = tuple[str, str, str, str]

IN_SEARCH, MISFIT = "  in search", "misfit (p)"
USEFULNESS_COLUMNS: Row = ("measure", "value", "interval", "meaning")
OF_THE_PROXY = "what a perfect proxy scores (this one re-run)"
PPV_MEANING = "proxy predictivity value: error of the scores"


def usefulness_rows(result: StudyResult) -> list[Row]:
    """PRPV on fresh episodes and in the search, the noise floor, chance, PPV, and whether the model fits."""
    own = result.best.assessment
    floor = floor_rows(result.floor, "" if result.judged is own else OF_THE_PROXY)
    ppv = [] if own.ppv.value is None else [("PPV", f"{own.ppv.value:.3g}", "", PPV_MEANING)]
    return [*objective_rows(result), *prpv_rows(result), *floor, chance_row(result), *ppv, misfit_row(result)]


def objective_rows(result: StudyResult) -> list[Row]:
    """The study's objective at the best θ, in the search and on fresh episodes; nothing where it is PRPV."""
    objective, value = result.study.objective, result.value_of(result.best.trial)
    if objective == PRPV or value is None:
        return []
    rows = [(objective.label, f"{value:.4g}", "", "the objective, in the search's own episodes")]
    scores = result.confirmation.answer.scores if result.confirmation else ()
    fresh = [objective.sign * score for score in scores if score is not None]
    return [*rows, ("  fresh", f"{sum(fresh) / len(fresh):.4g}", "", "on fresh episodes")] if fresh else rows


def prpv_rows(result: StudyResult) -> list[Row]:
    """PRPV of the best θ, first on fresh episodes where there are any, then on those that the search chose it by."""
    own, confirmation = result.best.assessment, result.confirmation
    pairs = f"wrongly ordered pairs, 0 to {own.prpv.range[1]}"
    if confirmation is None:
        return [("PRPV", *_prpv(own), f"{pairs}; the search's own episodes")]
    fresh = confirmation.answer.assessment
    if fresh is None:
        failed = "none on fresh episodes: an agent failed in all of them"
        return [("PRPV", "–", "", failed), (IN_SEARCH, *_prpv(own), pairs)]
    return [
        ("PRPV", *_prpv(fresh), f"{pairs}; fresh episodes"),
        (IN_SEARCH, *_prpv(own), f"{_optimism(confirmation)}{_rivals(confirmation)}"),
    ]


def _prpv(assessment: Assessment) -> tuple[str, str]:
    inner, value = assessment.prpv_interval, str(assessment.prpv.value)
    return (value, "") if inner.low is None or inner.high is None else (value, _interval((inner.low, inner.high)))


def _rivals(confirmation: Confirmation) -> str:
    """How many other θ were driven again too."""
    count = len(confirmation.candidates) - 1
    return f"; {count} runner{'' if count == 1 else 's'}-up re-run as well" if count else ""


def _optimism(confirmation: Confirmation) -> str:
    optimism = confirmation.answer.optimism or 0.0
    return f"{optimism:.3g} lower by luck" if optimism > 0.0 else "no optimism"


def floor_rows(floor: NoiseFloor, meaning: str = "") -> list[Row]:
    """The noise floor by its kind; nothing without one."""
    if floor.value is None or floor.low is None or floor.high is None:
        return []
    return [(f"  {floor.title}", short(floor.value), _interval((floor.low, floor.high)), meaning or floor.meaning)]


def chance_row(result: StudyResult) -> Row:
    """What a proxy that ranks at random would score, and how often it would score as low."""
    chance = result.judged.chance
    as_low = f"a random ranking; as low: {probability(chance.p_value)}"
    return ("  chance", fixed(chance.mean, 1), f"± {fixed(chance.deviation, 1)}", as_low)


def misfit_row(result: StudyResult) -> Row:
    """Whether any θ explains the target."""
    misfit = result.knowledge.misfit
    if misfit.p_value is None:
        return (MISFIT, "–", "", "too few complete trials to test whether any θ explains the target's scores")
    meaning = "some θ may explain the target's scores" if misfit.fits else "no θ explains the target's scores"
    return (MISFIT, f"{misfit.p_value:.2g}", "", meaning)


def usefulness_notes(result: StudyResult) -> list[str]:
    """What to keep in mind: not what the sentence says already, nor advice on the options of `score`."""
    return [note for note in result.judged.notes if note not in (PAIRED, PERFECT)]


def _interval(ends: Ends) -> str:
    return f"{short(ends[0])} to {short(ends[1])}"
