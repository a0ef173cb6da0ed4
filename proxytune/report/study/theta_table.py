"""What is known of θ, as rows and notes: intervals, what PRPV alone leaves, and which parameters trade off."""

from proxytune.report.numbers import Ends, digits, fixed, listed, percent, short, span
from proxytune.report.study.finding import known_parameters
from proxytune.report.style import plain
from proxytune.study import StudyResult

Row = tuple[str, ...]

BOX = "share of the box"


def theta_columns(result: StudyResult) -> Row:
    """The heads of the table of θ; the truth has a column only where it is known."""
    truth = () if result.truth is None else ("truth",)
    return ("parameter", "best", "95 % interval", *truth, "by PRPV alone", "box")


def theta_rows(result: StudyResult) -> list[Row]:
    """A row per parameter as the heads say, then the shares of the box that are left."""
    share, as_good = result.knowledge.as_good
    truth = () if result.truth is None else ("",)
    last = (BOX, "", percent(result.knowledge.posterior.share), *truth, percent(share), "")
    return [*(_row(result, place, as_good[name]) for place, name in enumerate(result.study.settings.space.names)), last]


def _row(result: StudyResult, place: int, as_good: Ends) -> Row:
    known, box = known_parameters(result)[place], result.study.settings.space.intervals[place]
    value = f"{short4(known.best)} {known.unit}".strip()
    interval = span(known.interval) if known.identified else "unidentified"
    truth = () if result.truth is None else (_truth(result.truth.get(known.name), known.interval),)
    limits = f"{short(box.low)} to {short(box.high)}"
    return (known.name, value, interval, *truth, span(as_good, digits(as_good)), limits)


def short4(value: float) -> str:
    """A value of the best θ, to be used again: four significant figures."""
    return f"{value:.4g}".replace("-", "−")


def _truth(value: float | None, interval: Ends) -> str:
    if value is None:
        return ""
    return short4(value) if interval[0] <= value <= interval[1] else f"{short4(value)} (outside)"


def theta_notes(result: StudyResult) -> list[str]:
    """What the table of θ does not hold, most needed first."""
    return [*_unidentified(result), *_inside(result), *_trades(result), *result.cautions]


def _unidentified(result: StudyResult) -> list[str]:
    names = [plain(name) for name in result.knowledge.unidentified]
    few = f"{len(result.trials)} trials exclude almost no value of {listed(names)}"
    return [f"{few}; unidentified: the interval fills more than 0.9 of the range"] if names else []


def _inside(result: StudyResult) -> list[str]:
    """Whether the best θ and the truth are in the 95 % region, where that is worth a line."""
    space, learnt = result.study.settings.space, result.knowledge
    notes = []
    if not result.inside:
        notes.append("the best θ by PRPV is outside the 95 % region, which uses every metric of every agent")
    if result.truth is not None and set(space.names) <= set(result.truth):
        holds = learnt.holds(space.values(result.truth))
        notes.append(f"the 95 % region {'contains' if holds else 'does not contain'} the truth")
    return notes


def _trades(result: StudyResult) -> list[str]:
    """The pairs that make up for each other, the strongest first."""
    ordered = sorted(result.knowledge.trades, key=lambda pair: -abs(pair[2]))
    return [
        f"{plain(one)} and {plain(other)} trade off: a change of one makes up for the other "
        f"(correlation {fixed(correlation, 1)})"
        for one, other, correlation in ordered
    ]
