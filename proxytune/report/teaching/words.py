"""What an experiment in teaching has shown, in sentences that claim no more than the intervals allow."""

from collections.abc import Sequence

from proxytune.learning import Estimate, describe
from proxytune.report.numbers import listed
from proxytune.report.teaching.table import UNKNOWN, count
from proxytune.teaching import Experiment, PlvStudy, TeacherResult, best_teacher, saves_more, why_unknown

MORE_PROXIES = "raise teaching.budget, or widen [parameters], so that other proxies are tried"
SEARCH = '`study` with objective = "plv" looks for'


def teach_answer(experiment: Experiment) -> str:
    """Which proxies save target samples, which save none, and of which that is open."""
    unknown = why_unknown(experiment.needs)
    if unknown and not experiment.settled:
        return f"PLV (proxy learning value) is unknown: {unknown.reason}."
    saves, none, both = sorted_by_worth(experiment.teachers)
    sentences = [
        f"Target samples saved (PLV, proxy learning value, with 95 % interval): {_said(saves) or 'none is shown'}.",
        f"None saved: {_said(none)}." if none else "",
        f"Open, since the interval reaches to both sides of 0: {_said(both)}." if both else "",
    ]
    return " ".join(filter(None, sentences))


def sorted_by_worth(teachers: Sequence[TeacherResult]) -> tuple[list[TeacherResult], ...]:
    """The proxies whose whole interval of PLV lies above 0, those of which none of it does, and the others."""
    saves = [one for one in teachers if one.worth and one.worth.plv.above_zero]
    none = [one for one in teachers if one.worth and one.worth.plv.at_most_zero]
    return saves, none, [one for one in teachers if one not in (*saves, *none)]


def _said(lessons: Sequence[TeacherResult]) -> str:
    return "; ".join(f"{one.name}: {count(one.worth.plv, UNKNOWN)}" for one in lessons if one.worth)


def teach_next_step(experiment: Experiment) -> str:
    """The step that brings most."""
    if unknown := why_unknown(experiment.needs):
        return f"{unknown.remedy}: {unknown.reason}."
    saves, _, both = sorted_by_worth(experiment.teachers)
    if both:
        more = f"{_more_of_it(experiment)}, which narrows the intervals"
        return f"{more}: {listed([one.name for one in both])} cannot be judged yet."
    if saves:
        return f"train in a proxy that saves samples, then on target samples; {SEARCH} a better one."
    return f"train without these proxies; {SEARCH} one that saves samples."


def _more_of_it(experiment: Experiment) -> str:
    """What to raise: the examinations that are chosen or, of a whole grid, its repetitions."""
    taught = experiment.settings.teaching
    if taught is not None and taught.examinations is not None:
        return f"raise teaching.examinations from {taught.examinations} to {2 * taught.examinations}"
    seeds = experiment.without.repetitions
    return f"raise teaching.seeds from {seeds} to {2 * seeds}"


def plv_answer(study: PlvStudy) -> str:
    """The finalist of highest PLV, whether it is shown to save anything, and which others may be as good."""
    experiment, best = study.confirmed, best_teacher(study.confirmed)
    if best is None or best.worth is None:
        return f"Of {len(study.trials)} proxies tried, no finalist is known to save target samples."
    others = [one.name for one in experiment.teachers if one is not best]
    behind = [name for name in others if saves_more(experiment, best.name, name).above_zero]
    alike = [name for name in others if name not in behind]
    sentences = [
        f"After {len(study.trials)} proxies tried, {best.name} ({describe(best.proxy)}) has the highest PLV (proxy "
        f"learning value): {count(best.worth.plv, UNKNOWN)} target samples saved; {_judged(best.worth.plv)}.",
        f"It saves more than {listed(behind)}." if behind else "",
        f"That it saves more than {listed(alike)} is not shown." if alike else "",
    ]
    return " ".join(filter(None, sentences))


def _judged(plv: Estimate) -> str:
    """Whether a proxy is shown to save any target samples."""
    if plv.above_zero:
        return "it saves target samples"
    return "it saves none" if plv.at_most_zero else "that it saves any is not shown: the interval holds 0"


def plv_next_step(study: PlvStudy) -> str:
    """The step that brings most."""
    best = best_teacher(study.confirmed)
    if best is None or best.worth is None:
        unknown = why_unknown(study.confirmed.needs)
        return f"{unknown.remedy}: {unknown.reason}." if unknown else f"{MORE_PROXIES}."
    if best.worth.plv.at_most_zero:
        return f"train without a proxy, or {MORE_PROXIES}."
    if best.worth.plv.above_zero:
        return f"train in {best.name}: {describe(best.proxy)}, then on target samples."
    return f"{_more_of_it(study.confirmed)}, which narrows the intervals, or teaching.budget, which tries more proxies."
