"""The first thing that a study says: what was found, how sure that is, and what to do next."""

from proxytune.report.numbers import digits, fixed, listed, percent, probability, short, span
from proxytune.report.study.finding import Finding, Known
from proxytune.report.style import plain

MOST_NAMED = 5
"""A sentence holds so many parameters at most."""


def sentence(found: Finding) -> str:
    """What was found, how sure that is, and what to do next."""
    return f"{_found(found)} {_worth(found)} Next: {_next(found)}."


def _found(found: Finding) -> str:
    so_far = f"{found.budget - found.left} of {found.budget} trials so far. " if found.left else ""
    if found.chance.explains:
        return f"{so_far}θ was not found."
    if found.fits is False:
        return f"{so_far}The proxy lacks something: no θ explains the target's scores ({_misfit(found)})."
    if found.perfect:
        return f"{so_far}θ was found: {theta(found)}."
    if not any(known.identified for known in found.parameters):
        return f"{so_far}θ is not known: {theta(found)}."
    return f"{so_far}θ is narrowed down to {percent(found.region)} of the box: {theta(found)}."


def theta(found: Finding) -> str:
    """The parameters that are identified, with their intervals, then the others and the least known."""
    sure = [known for known in found.parameters if known.identified]
    unsure = [plain(known.name) for known in found.parameters if not known.identified]
    clauses = [", ".join(map(_value, sure[:MOST_NAMED]))] if sure else []
    if len(sure) > MOST_NAMED:
        clauses[0] += f" and {len(sure) - MOST_NAMED} more"
    if unsure:
        clauses.append(f"{listed(unsure)} {'is' if len(unsure) == 1 else 'are'} unidentified")
    elif len(sure) > 1:
        clauses.append(f"{plain(found.least.name)} is the least known ({found.least.share:.1g} of its range)")
    return "; ".join(clauses)


def _value(known: Known) -> str:
    low, high = known.interval
    places = digits(known.interval)
    inside = low <= known.best <= high
    said = span(known.interval, places) if inside else f"the scores say {span(known.interval, places)}"
    return f"{plain(known.name)} {fixed(known.best, places)}{known.unit and ' ' + known.unit} ({said})"


def _misfit(found: Finding) -> str:
    return "" if found.misfit is None else probability(found.misfit)


def _worth(found: Finding) -> str:
    """PRPV, beside what a perfect proxy and one that knows nothing would score."""
    where = "on fresh episodes" if found.fresh else "in the search's own episodes"
    score = f"PRPV {found.prpv} {where}"
    if found.chance.explains:
        at_random = f"{short(found.chance.mean)} ± {short(found.chance.deviation)}"
        return f"{score} is no better than chance ({at_random}, {probability(found.chance.p_value)})."
    if not found.fresh:
        return f"{score}, part of which may be luck."
    level = found.floor
    if level.kind != "same starts" or level.value is None or level.low is None or level.high is None:
        return f"{score}, better than chance; what a perfect proxy would score is not known."
    perfect = f"where a perfect proxy scores {short(level.value)} ({short(level.low)} to {short(level.high)})"
    if found.perfect:
        return f"{score}, {perfect}: this proxy cannot be told from a perfect one."
    if found.prpv <= level.high and not found.inside:
        return f"{score}, {perfect}: as good by PRPV, but other scores of its agents are not the target's."
    return f"{score}, {perfect}: better than chance, not yet as good as can be."


def _next(found: Finding) -> str:
    """The one step that brings most."""
    if found.left:
        return f"run the study again for the {found.left} trials that are left"
    if found.fits is False:
        declared = f" --declared {','.join(found.declared)}" if found.declared else ""
        return f"log drives of the target (a model's: `record`) and run `python -m proxytune diagnose LOG{declared}`"
    if found.chance.explains:
        return f"{_more_trials(found)}, or add agents that differ more in their scores"
    if not found.fresh:
        return f"{'' if found.confirm else 'set confirm = 1 and '}run the study again, to drive the best θ afresh"
    if found.perfect:
        return f"use the proxy at this θ; to know {plain(found.least.name)} better, {more_of(found)}"
    # Where no trial has come into the region yet, starts are not what is missing.
    return f"{more_of(found) if found.inside else _more_trials(found)}, to come closer to it"


def more_of(found: Finding) -> str:
    """What to add to learn more of the least known parameter."""
    if not found.least.identified:
        return f"add an agent or a metric that tells of it{_teller(found)}, or a log for `diagnose`"
    if found.informed and found.informed.limit == "starts":
        return _more_starts(found)
    return _more_trials(found)


def _more_trials(found: Finding) -> str:
    more = f"raise budget from {found.budget} to {2 * found.budget}"
    return "loosen the rule under [stop] that ended the search" if found.ruled else more


def _more_starts(found: Finding) -> str:
    if found.starts == found.most_starts:
        return f"add agents or metrics: all {found.starts} starts are driven"
    more = min(2 * found.starts, found.most_starts)
    return f"raise starts from {found.starts} to {more} and measure the target from these too"


def _teller(found: Finding) -> str:
    """Which agent tells most of the least known parameter now."""
    if found.informed is None or not found.informed.agents:
        return ""
    return f" (most tells {found.informed.agents[0][0]} now)"
