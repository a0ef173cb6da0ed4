"""First sentence of a study: what was found, how good the proxy is there, what to do next."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import ceil

from proxytune.diagnosis import MOTION_EFFECTS
from proxytune.report.wording import as_known, in_pairs, listed, pairs_span, percent, plain, probability, short, span
from proxytune.study import DEFAULT_FAMILY, StudyResult

MOST_NAMED = 5
"""At most this many parameters are named one by one."""


@dataclass(frozen=True)
class KnownParameter:
    """Knowledge of one parameter: its value in the best θ, its 95 % interval, and how much of its range that fills."""

    name: str
    unit: str
    best: float
    interval: tuple[float, float]
    share: float
    identified: bool


def study_sentence(result: StudyResult) -> str:
    """Say what a study found, how good the proxy is there, and what to do next."""
    return f"{say_answer(result)} Next: {say_next_step(result)}."


def say_answer(result: StudyResult) -> str:
    """Say what was found, and how good the proxy is there."""
    return f"{_say_theta(result)} {_say_usefulness(result)}"


def _say_theta(result: StudyResult) -> str:
    parameters, misfit = known_parameters(result), result.knowledge.misfit
    done, budget = len(result.trials), result.study.settings.budget
    so_far = f"{done} of {budget} trials so far. " if _trials_left(result) else ""
    chance = result.judged.chance
    if chance.explains and not chance.too_few:
        return f"{so_far}No θ found."
    if misfit.fits is False:
        told = "" if misfit.p_value is None else f" ({probability(misfit.p_value)})"
        return f"{so_far}The proxy lacks something: no θ explains the target's scores{told}."
    if not any(one.identified for one in parameters):
        return f"{so_far}θ is unknown: {_say_parameters(parameters)}."
    if result.perfect:
        return f"{so_far}θ found: {_say_parameters(parameters)}."
    share = percent(result.knowledge.posterior.share)
    return f"{so_far}θ narrowed down to {share} of the box: {_say_parameters(parameters)}."


def _trials_left(result: StudyResult) -> int:
    """Trials still to be run; 0 where the search has ended."""
    return 0 if result.stopped else result.study.settings.budget - len(result.trials)


def _say_parameters(parameters: Sequence[KnownParameter]) -> str:
    """The identified parameters with their intervals, then the others."""
    sure = [one for one in parameters if one.identified]
    unsure = [plain(one.name) for one in parameters if not one.identified]
    clauses = [", ".join(map(_say_value, sure[:MOST_NAMED]))] if sure else []
    if len(sure) > MOST_NAMED:
        clauses[0] += f" and {len(sure) - MOST_NAMED} more"
    if unsure:
        clauses.append(f"{listed(unsure)} {'is' if len(unsure) == 1 else 'are'} unidentified")
    return "; ".join(clauses)


def _say_value(parameter: KnownParameter) -> str:
    low, high = parameter.interval
    region = "" if low <= parameter.best <= high else "95 % region: "
    best = f"{as_known(parameter.best, parameter.interval)} {parameter.unit}".rstrip()
    return f"{plain(parameter.name)} {best} ({region}{span(parameter.interval)})"


def _say_usefulness(result: StudyResult) -> str:
    """PRPV, beside what a perfect proxy, one that ranks at random and the simulator as it is score."""
    judged, chance = result.judged.prpv.value, result.judged.chance
    value, low, high = result.expected.prpv.value if result.expected else (judged, judged, judged)
    told = in_pairs(value, low, high) if _is_fresh(result) else f"{short(value)} in the search's own episodes"
    score = f"PRPV (proxy relative predictivity value) is {told}"
    if chance.explains:
        at_random = f"{short(chance.mean)} ± {short(chance.deviation)}"
        if chance.too_few:
            may = f"which chance may be too ({probability(chance.p_value)})"
            return f"{score}, as low as any order of these agents has, {may}."
        return f"{score}, no better than chance ({at_random}, {probability(chance.p_value)})."
    if not _is_fresh(result):
        return f"{score}, which may be partly luck."
    nominal, level, excess = result.nominal, result.floor, result.excess
    before = f" The simulator as it is scores {in_pairs(*nominal.expected.prpv.value)}." if nominal else ""
    if excess is None or level.value is None or level.low is None or level.high is None:
        return f"{score}, better than chance; what a perfect proxy scores is not known.{before}"
    floor = f"a perfect proxy's {in_pairs(level.value, level.low, level.high)}"
    if excess.low > 0.0:
        # Rounded down, less than a pair would be none.
        by = pairs_span(*excess[1:]) if excess.low >= 1.0 else f"at most {ceil(excess.high)}"
        lower = f"a perfect proxy scores lower, by {by}"
        return f"{score}, {floor}: better than chance, but {lower}.{before}"
    most = ceil(excess.high)
    worse = f"; at most {most} {'pair' if most == 1 else 'pairs'} worse" if most > 0 else ""
    alike = f"{'it' if result.perfect else 'by PRPV alone it'} cannot be told from a perfect proxy{worse}"
    other = "" if result.perfect else ", but other scores of the agents differ from the target's"
    return f"{score}, {floor}: {alike}{other}.{before}"


def _is_fresh(result: StudyResult) -> bool:
    """Whether it is judged by episodes that the search has not seen."""
    return result.judged is not result.best.assessment


def say_next_step(result: StudyResult) -> str:
    """The one step that brings most, without a full stop."""
    settings, fits = result.study.settings, result.knowledge.misfit.fits
    if left := _trials_left(result):
        return f"run the study again for the {left} trials that are left"
    if (chance := result.judged.chance).deviation == 0.0:  # every order of the proxy's scores is as good
        others = ["other agents"]
        others += ["smaller tolerances"] if any(metric.tolerance for metric in settings.metrics) else []
        others += ["fewer metrics"] if len(settings.metrics) > 1 else []
        # Every order is right only where the target ranks none.
        where = "on the target" if chance.mean == 0.0 else "on the target, or in the proxy,"
        return f"give {', or '.join(others)}: {where} none of these agents ranks above another"
    if fits is False and settings.family != DEFAULT_FAMILY:
        return "look for what the simulator lacks, or widen the box; of a robot on wheels a log tells (`diagnose`)"
    if fits is False:
        effects = declared_of(settings.space.names)
        declared = f" --declared {','.join(effects)}" if effects else ""
        return f"log drives of the target (a model's: `record`) and run `python -m proxytune diagnose LOG{declared}`"
    if chance.too_few:
        return "add agents, for any order of these may be chance"
    if chance.explains:
        return f"{_more_trials(result)}, or add agents whose scores differ more"
    if not _is_fresh(result) and result.rescored:
        return "search by these metrics: give them to a new study, with learn_from = [this one]"
    if not _is_fresh(result):
        return f"{'' if settings.confirm else 'set confirm = 1 and '}run the study again, to drive the best θ afresh"
    if result.perfect:
        found = "use this θ; " if any(one.identified for one in known_parameters(result)) else ""
        return f"{found}to know {plain(_least_known(result).name)} better, {_say_what_to_add(result)}"
    # Where no trial has come into the region yet, starts are not what is missing.
    return f"{_say_what_to_add(result) if result.inside else _more_trials(result)}, to get closer"


def _least_known(result: StudyResult) -> KnownParameter:
    return max(known_parameters(result), key=lambda one: one.share)


def _say_what_to_add(result: StudyResult) -> str:
    """Say what to add to learn more of the least known parameter."""
    settings, least, most_starts = result.study.settings, _least_known(result), result.study.family.starts
    told = (one for one in result.information if one.name == least.name)
    informed = next((one for one in told if any(share > 0.0 for _, share in one.agents)), None)
    if not least.identified and (informed is None or informed.limit == "starts"):
        best = f" (so far {informed.agents[0][0]}'s do most)" if informed else ""
        log = ", or a log for `diagnose`" if settings.family == DEFAULT_FAMILY else ""
        return f"add an agent or a metric whose scores change with {plain(least.name)}{best}{log}"
    if informed is None or informed.limit != "starts":
        return _more_trials(result)
    if settings.learn_from:
        return f"{_more_trials(result)} (starts limit it too, but more of them would leave the earlier trials out)"
    if settings.starts == most_starts:
        driven = "its only start is driven" if most_starts == 1 else f"all {most_starts} starts are driven"
        return f"add agents or metrics: {driven}"
    more = min(2 * settings.starts, most_starts)
    return f"raise starts from {settings.starts} to {more} and measure the target from them too"


def _more_trials(result: StudyResult) -> str:
    done, asked = len(result.trials), result.study.settings.budget
    if result.stopped and done < asked:
        return "loosen the rule under [stop] that ended the search"
    return f"raise budget from {max(asked, done)} to {2 * max(asked, done) or 8}"


def known_parameters(result: StudyResult) -> tuple[KnownParameter, ...]:
    """Knowledge of each parameter, in the order of the box."""
    units, learnt = result.study.family.parameters, result.knowledge
    parameters = []
    for interval in result.study.settings.space.intervals:
        name, ends = interval.name, learnt.intervals[interval.name]
        share = (ends[1] - ends[0]) / (interval.high - interval.low)
        best = result.best.trial.theta[name]
        parameters.append(KnownParameter(name, units[name].unit, best, ends, share, name not in learnt.unidentified))
    return tuple(parameters)


def declared_of(names: Sequence[str]) -> tuple[str, ...]:
    """The effects on motion that these parameters belong to, each once."""
    effects = dict.fromkeys(name.partition(".")[0] for name in names)
    return tuple(effect for effect in effects if effect in MOTION_EFFECTS)
