"""The first thing that a study says: what was found, how good the proxy is there, and what to do next."""

from proxytune.report.numbers import digits, fixed, listed, percent, probability, short, span
from proxytune.report.study.finding import Finding, KnownParameter
from proxytune.report.style import plain

MOST_NAMED = 5
"""At most this many parameters are named one by one."""


def sentence(finding: Finding) -> str:
    """What was found, how good the proxy is there, and what to do next."""
    return f"{answer(finding)} Next: {next_step(finding)}"


def answer(finding: Finding) -> str:
    """What was found, and how good the proxy is there."""
    return f"{_say_theta(finding)} {_say_usefulness(finding)}"


def next_step(finding: Finding) -> str:
    """What to do next."""
    return f"{_say_next_step(finding)}."


def _say_theta(finding: Finding) -> str:
    so_far = f"{finding.budget - finding.left} of {finding.budget} trials so far. " if finding.left else ""
    if finding.chance.explains:
        return f"{so_far}No θ found."
    if finding.fits is False:
        return f"{so_far}The proxy lacks something: no θ explains the target's scores{_say_misfit(finding)}."
    if finding.perfect:
        return f"{so_far}θ found: {say_parameters(finding)}."
    if not any(one.identified for one in finding.parameters):
        return f"{so_far}θ is unknown: {say_parameters(finding)}."
    return f"{so_far}θ narrowed down to {percent(finding.region)} of the box: {say_parameters(finding)}."


def say_parameters(finding: Finding) -> str:
    """The identified parameters with their intervals, then the others."""
    sure = [one for one in finding.parameters if one.identified]
    unsure = [plain(one.name) for one in finding.parameters if not one.identified]
    clauses = [", ".join(map(_say_value, sure[:MOST_NAMED]))] if sure else []
    if len(sure) > MOST_NAMED:
        clauses[0] += f" and {len(sure) - MOST_NAMED} more"
    if unsure:
        clauses.append(f"{listed(unsure)} {'is' if len(unsure) == 1 else 'are'} unidentified")
    return "; ".join(clauses)


def _say_value(parameter: KnownParameter) -> str:
    low, high = parameter.interval
    places = digits(parameter.interval)
    inside = low <= parameter.best <= high
    ends = span(parameter.interval, places) if inside else f"95 % region: {span(parameter.interval, places)}"
    return f"{plain(parameter.name)} {fixed(parameter.best, places)}{parameter.unit and ' ' + parameter.unit} ({ends})"


def _say_misfit(finding: Finding) -> str:
    return "" if finding.misfit is None else f" ({probability(finding.misfit)})"


def _say_usefulness(finding: Finding) -> str:
    """PRPV, beside what a perfect proxy and one that ranks at random would score."""
    where = "on fresh episodes" if finding.fresh else "in the search's own episodes"
    score = f"PRPV (proxy relative predictivity value) is {finding.prpv} {where}"
    if finding.chance.explains:
        at_random = f"{short(finding.chance.mean)} ± {short(finding.chance.deviation)}"
        return f"{score}, no better than chance ({at_random}, {probability(finding.chance.p_value)})."
    if not finding.fresh:
        return f"{score}, which may be partly luck."
    level = finding.floor
    if level.kind != "same starts" or level.value is None or level.low is None or level.high is None:
        return f"{score}, better than chance; the noise floor is not known."
    floor = f"noise floor {short(level.value)} ({short(level.low)} to {short(level.high)})"
    if finding.perfect:
        return f"{score}, {floor}: no difference from the target can be seen."
    if finding.prpv <= level.high:
        return f"{score}, {floor}: PRPV can get no better, but other scores of the agents differ from the target's."
    return f"{score}, {floor}: better than chance, but a perfect proxy scores lower."


def _say_next_step(finding: Finding) -> str:
    """The one step that brings most."""
    if finding.left:
        return f"run the study again for the {finding.left} trials that are left"
    if finding.fits is False:
        declared = f" --declared {','.join(finding.declared)}" if finding.declared else ""
        return f"log drives of the target (a model's: `record`) and run `python -m proxytune diagnose LOG{declared}`"
    if finding.chance.explains:
        return f"{_more_trials(finding)}, or add agents whose scores differ more"
    if not finding.fresh:
        return f"{'' if finding.confirm else 'set confirm = 1 and '}run the study again, to drive the best θ afresh"
    if finding.perfect:
        return f"use this θ; to know {plain(finding.least.name)} better, {what_to_add(finding)}"
    # Where no trial has come into the region yet, starts are not what is missing.
    return f"{what_to_add(finding) if finding.inside else _more_trials(finding)}, to get closer"


def what_to_add(finding: Finding) -> str:
    """What to add to learn more of the least known parameter."""
    if not finding.least.identified:
        changes = f"whose scores change with {plain(finding.least.name)}"
        return f"add an agent or a metric {changes}{_best_informed_by(finding)}, or a log for `diagnose`"
    if finding.information and finding.information.limit == "starts":
        return _more_starts(finding)
    return _more_trials(finding)


def _more_trials(finding: Finding) -> str:
    more = f"raise budget from {finding.budget} to {2 * finding.budget}"
    return "loosen the rule under [stop] that ended the search" if finding.ruled else more


def _more_starts(finding: Finding) -> str:
    if finding.starts == finding.most_starts:
        return f"add agents or metrics: all {finding.starts} starts are driven"
    more = min(2 * finding.starts, finding.most_starts)
    return f"raise starts from {finding.starts} to {more} and measure the target from them too"


def _best_informed_by(finding: Finding) -> str:
    """The agent that informs the least known parameter most so far."""
    if finding.information is None or not finding.information.agents:
        return ""
    return f" (so far {finding.information.agents[0][0]}'s do most)"
