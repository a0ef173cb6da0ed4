"""What is known of θ, as rows and lines: intervals, what is as good, what trades, and who tells what."""

from collections.abc import Sequence

from proxytune.report.numbers import Ends, digits, fixed, listed, percent, short, span
from proxytune.report.study.finding import known_parameters
from proxytune.report.style import plain
from proxytune.search.knowledge.information import Information
from proxytune.study.result import StudyResult

Row = tuple[str, ...]

TOLD_BY = ("parameter", "agents that tell most", "metrics that tell most", "more by")
NAMED = 3
"""So many agents and metrics are named."""
BOX = "share of the box"


def theta_columns(result: StudyResult) -> Row:
    """The heads of the table of θ; the truth has a column only where it is known."""
    truth = () if result.truth is None else ("truth",)
    return ("parameter", "best", "95 % interval", *truth, "as good by PRPV", "searched")


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
    searched = f"{short(box.low)} to {short(box.high)}"
    return (known.name, value, interval, *truth, span(as_good, digits(as_good)), searched)


def short4(value: float) -> str:
    """A value of the best θ, to be used again: four significant figures."""
    return f"{value:.4g}".replace("-", "−")


def _truth(value: float | None, interval: Ends) -> str:
    if value is None:
        return ""
    return short4(value) if interval[0] <= value <= interval[1] else f"{short4(value)} (outside)"


def theta_lines(result: StudyResult) -> list[str]:
    """What the table of θ does not hold, most needed first."""
    return [*_unidentified(result), *_inside(result), *_trades(result), *_cautions(result)]


def _unidentified(result: StudyResult) -> list[str]:
    names = [plain(name) for name in result.knowledge.unidentified]
    return [f"unidentified: {listed(names)}; the target's scores agree with nearly any value"] if names else []


def _inside(result: StudyResult) -> list[str]:
    """Whether the best θ and the truth are in the 95 % region, where that is worth a line."""
    space, learnt = result.study.settings.space, result.knowledge
    lines = []
    if not result.inside:
        lines.append("the best θ by PRPV is outside the 95 % region, which is by every metric of every agent")
    if result.truth is not None and set(space.names) <= set(result.truth):
        holds = learnt.holds(space.values(result.truth))
        lines.append(f"the 95 % region {'holds' if holds else 'does not hold'} the truth")
    return lines


def _trades(result: StudyResult) -> list[str]:
    """The pairs that make up for each other, the strongest first."""
    ordered = sorted(result.knowledge.trades, key=lambda pair: -abs(pair[2]))
    return [
        f"{plain(one)} and {plain(other)} make up for each other, correlation {fixed(found, 1)}"
        for one, other, found in ordered
    ]


def _cautions(result: StudyResult) -> list[str]:
    return [f"caution: {line}" for line in result.cautions]


def told_rows(result: StudyResult) -> list[Row]:
    """Per parameter of which anything is told, the agents and metrics that tell most, and what would tell more."""
    return [_told(found) for found in result.knowledge.information if _most(found.agents)]


def _told(found: Information) -> Row:
    return (found.name, _most(found.agents), _most(found.metrics), f"more {found.limit}")


def _most(shares: Sequence[tuple[str, float]]) -> str:
    return ", ".join(f"{name} {100.0 * share:.0f} %" for name, share in shares[:NAMED] if share >= 0.005)
