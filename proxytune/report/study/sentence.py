"""First sentence of a study: what was found, how good the proxy is there, what to do next."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import ceil

from proxytune.diagnosis import MOTION_EFFECTS
from proxytune.report.wording import (
    Ends,
    digits,
    fixed,
    in_pairs,
    listed,
    pairs_span,
    percent,
    plain,
    probability,
    short,
    span,
)
from proxytune.search import Information
from proxytune.study import DEFAULT_FAMILY, StudyResult
from proxytune.usefulness import Chance, Estimate, NoiseFloor

MOST_NAMED = 5
"""At most this many parameters are named one by one."""


@dataclass(frozen=True)
class KnownParameter:
    """Knowledge of one parameter.

    Attributes:
        name: Its name.
        unit: Its unit, empty where it has none.
        best: Its value in the best θ.
        interval: The 95 % interval.
        share: How much of its range that fills.
        identified: Whether it is identified.
    """

    name: str
    unit: str
    best: float
    interval: Ends
    share: float
    identified: bool


@dataclass(frozen=True)
class Finding:
    """Figures that the sentence is made of.

    Attributes:
        parameters: In the order of the box.
        region: The 95 % region's share of the box.
        inside: Whether the best θ lies in it.
        prpv: PRPV of the best θ: expected of more episodes, or without fresh ones that of its own.
        fresh: Whether there are fresh ones.
        floor: What a perfect proxy would score.
        excess: By how much more is expected of this one than of that; None where it is not known.
        nominal: PRPV expected of the simulator as it is; None where it has no nominal values.
        chance: What a proxy that ranks at random would score.
        perfect: Whether no difference between proxy and target can be seen, which takes fresh episodes.
        misfit: p-value of the misfit test; None where there is none.
        fits: Whether some θ explains the target's scores; None where that cannot be tested.
        information: What informs the least known parameter; None where nothing does.
        left: Trials still to be run; 0 where the search has ended.
        budget: Trials that the study may take, or took where that was more.
        ruled: Whether a rule ended the search before its budget.
        starts: How many starts each agent drives from.
        most_starts: How many starts there are.
        confirm: How often the study drives its best θ again.
        learnt: Whether it learns from earlier studies, which have no more starts than they have.
        declared: The effects on motion that θ belongs to, which `diagnose` is to tune in any case; None where the
            simulator is another, of which nobody knows whether its robot drives.
    """

    parameters: tuple[KnownParameter, ...]
    region: float
    inside: bool
    prpv: Estimate
    fresh: bool
    floor: NoiseFloor
    excess: Estimate | None
    nominal: Estimate | None
    chance: Chance
    perfect: bool
    misfit: float | None
    fits: bool | None
    information: Information | None
    left: int
    budget: int
    ruled: bool
    starts: int
    most_starts: int
    confirm: int
    declared: tuple[str, ...] | None
    learnt: bool = False

    @property
    def least(self) -> KnownParameter:
        """The least known parameter."""
        return max(self.parameters, key=lambda one: one.share)


def study_sentence(result: StudyResult) -> str:
    """Say what a study found, how good the proxy is there, and what to do next."""
    return say_finding(finding_of(result))


def say_finding(finding: Finding) -> str:
    """Say what was found, how good the proxy is there, and what to do next."""
    return f"{say_answer(finding)} Next: {say_next_step(finding)}."


def say_answer(finding: Finding) -> str:
    """Say what was found, and how good the proxy is there."""
    return f"{_say_theta(finding)} {_say_usefulness(finding)}"


def _say_theta(finding: Finding) -> str:
    so_far = f"{finding.budget - finding.left} of {finding.budget} trials so far. " if finding.left else ""
    if finding.chance.explains:
        return f"{so_far}No θ found."
    if finding.fits is False:
        misfit = "" if finding.misfit is None else f" ({probability(finding.misfit)})"
        return f"{so_far}The proxy lacks something: no θ explains the target's scores{misfit}."
    if finding.perfect:
        return f"{so_far}θ found: {_say_parameters(finding.parameters)}."
    if not any(one.identified for one in finding.parameters):
        return f"{so_far}θ is unknown: {_say_parameters(finding.parameters)}."
    return f"{so_far}θ narrowed down to {percent(finding.region)} of the box: {_say_parameters(finding.parameters)}."


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
    places = digits(parameter.interval)
    inside = low <= parameter.best <= high
    ends = span(parameter.interval, places) if inside else f"95 % region: {span(parameter.interval, places)}"
    return f"{plain(parameter.name)} {fixed(parameter.best, places)}{parameter.unit and ' ' + parameter.unit} ({ends})"


def _say_usefulness(finding: Finding) -> str:
    """PRPV, beside what a perfect proxy, one that ranks at random and the simulator as it is score."""
    name = "PRPV (proxy relative predictivity value)"
    if not finding.fresh:
        score = f"{name} is {short(finding.prpv.value)} in the search's own episodes"
    else:
        score = f"{name} is {in_pairs(*finding.prpv)}"
    if finding.chance.explains:
        at_random = f"{short(finding.chance.mean)} ± {short(finding.chance.deviation)}"
        return f"{score}, no better than chance ({at_random}, {probability(finding.chance.p_value)})."
    if not finding.fresh:
        return f"{score}, which may be partly luck."
    nominal = finding.nominal
    before = f" The simulator as it is scores {in_pairs(*nominal)}." if nominal else ""
    level, excess = finding.floor, finding.excess
    if excess is None or level.value is None or level.low is None or level.high is None:
        return f"{score}, better than chance; what a perfect proxy scores is not known.{before}"
    floor = f"a perfect proxy's {in_pairs(level.value, level.low, level.high)}"
    if excess.low > 0.0:
        lower = f"a perfect proxy scores lower, by {pairs_span(*excess[1:])}"
        return f"{score}, {floor}: better than chance, but {lower}.{before}"
    most = ceil(excess.high)
    worse = f"; at most {most} {'pair' if most == 1 else 'pairs'} worse" if most > 0 else ""
    told = f"it cannot be told from a perfect proxy{worse}"
    other = "" if finding.perfect else ", but other scores of the agents differ from the target's"
    return f"{score}, {floor}: {told}{other}.{before}"


def say_next_step(finding: Finding) -> str:
    """The one step that brings most, without a full stop."""
    if finding.left:
        return f"run the study again for the {finding.left} trials that are left"
    if finding.fits is False and finding.declared is None:
        return "look for what the simulator lacks, or widen the box; of a robot on wheels a log tells (`diagnose`)"
    if finding.fits is False:
        declared = f" --declared {','.join(finding.declared)}" if finding.declared else ""
        return f"log drives of the target (a model's: `record`) and run `python -m proxytune diagnose LOG{declared}`"
    if finding.chance.explains:
        return f"{_more_trials(finding)}, or add agents whose scores differ more"
    if not finding.fresh:
        return f"{'' if finding.confirm else 'set confirm = 1 and '}run the study again, to drive the best θ afresh"
    if finding.perfect:
        return f"use this θ; to know {plain(finding.least.name)} better, {_say_what_to_add(finding)}"
    # Where no trial has come into the region yet, starts are not what is missing.
    return f"{_say_what_to_add(finding) if finding.inside else _more_trials(finding)}, to get closer"


def _say_what_to_add(finding: Finding) -> str:
    """Say what to add to learn more of the least known parameter."""
    if not finding.least.identified:
        informed = finding.information and finding.information.agents
        best = f" (so far {informed[0][0]}'s do most)" if informed else ""
        changes = f"whose scores change with {plain(finding.least.name)}"
        log = ", or a log for `diagnose`" if finding.declared is not None else ""
        return f"add an agent or a metric {changes}{best}{log}"
    # More starts than earlier studies were driven from would leave their trials out.
    if finding.learnt or finding.information is None or finding.information.limit != "starts":
        return _more_trials(finding)
    if finding.starts == finding.most_starts:
        return f"add agents or metrics: all {finding.starts} starts are driven"
    more = min(2 * finding.starts, finding.most_starts)
    return f"raise starts from {finding.starts} to {more} and measure the target from them too"


def _more_trials(finding: Finding) -> str:
    more = f"raise budget from {finding.budget} to {2 * finding.budget or 8}"
    return "loosen the rule under [stop] that ended the search" if finding.ruled else more


def finding_of(result: StudyResult) -> Finding:
    """Gather what the sentence of a study is made of."""
    settings, learnt, judged = result.study.settings, result.knowledge, result.judged
    parameters = known_parameters(result)
    least, own = max(parameters, key=lambda one: one.share).name, float(judged.prpv.value)
    prpv = result.expected.prpv.value if result.expected else Estimate(own, own, own)
    return Finding(
        parameters=parameters,
        region=learnt.posterior.share,
        inside=result.inside,
        prpv=prpv,
        fresh=judged is not result.best.assessment,
        floor=result.floor,
        excess=result.excess,
        nominal=result.nominal.expected.prpv.value if result.nominal else None,
        chance=judged.chance,
        perfect=bool(result.perfect),
        misfit=learnt.misfit.p_value,
        fits=learnt.misfit.fits,
        information=next(
            (one for one in learnt.information if one.name == least and any(share > 0.0 for _, share in one.agents)),
            None,
        ),
        left=0 if result.stopped else settings.budget - len(result.trials),
        budget=max(settings.budget, len(result.trials)),
        ruled=bool(result.stopped) and len(result.trials) < settings.budget,
        starts=settings.starts,
        most_starts=result.study.family.starts,
        confirm=settings.confirm,
        learnt=bool(settings.learn_from),
        declared=declared_of(settings.space.names) if settings.family == DEFAULT_FAMILY else None,
    )


def known_parameters(result: StudyResult) -> tuple[KnownParameter, ...]:
    """Knowledge of each parameter, in the order of the box."""
    units, learnt = result.study.family.parameters, result.knowledge
    parameters = []
    for interval in result.study.settings.space.intervals:
        name, ends = interval.name, learnt.intervals[interval.name]
        share = (ends[1] - ends[0]) / (interval.high - interval.low)
        best = result.best.trial.theta[name]
        identified = name not in learnt.unidentified
        parameters.append(KnownParameter(name, units[name].unit, best, ends, share, identified))
    return tuple(parameters)


def declared_of(names: Sequence[str]) -> tuple[str, ...]:
    """The effects on motion that these parameters belong to, each once."""
    effects = dict.fromkeys(name.partition(".")[0] for name in names)
    return tuple(effect for effect in effects if effect in MOTION_EFFECTS)
