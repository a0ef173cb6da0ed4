"""What a study found, as the plain figures that its first sentence is made of."""

from collections.abc import Sequence
from dataclasses import dataclass

from proxytune.diagnosis import MOTION_EFFECTS
from proxytune.report.numbers import Ends
from proxytune.search import Information
from proxytune.study import StudyResult
from proxytune.usefulness import Chance, NoiseFloor


@dataclass(frozen=True)
class KnownParameter:
    """What is known of one parameter.

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
    """What the sentence is made of.

    Attributes:
        parameters: In the order of the box.
        region: The 95 % region's share of the box.
        inside: Whether the best θ lies in it.
        prpv: PRPV of the best θ.
        fresh: Whether that is of fresh episodes.
        floor: What a perfect proxy would score.
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
        declared: The effects on motion that θ belongs to, which `diagnose` is to tune in any case.
    """

    parameters: tuple[KnownParameter, ...]
    region: float
    inside: bool
    prpv: int
    fresh: bool
    floor: NoiseFloor
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
    declared: tuple[str, ...]

    @property
    def least(self) -> KnownParameter:
        """The least known parameter."""
        return max(self.parameters, key=lambda one: one.share)


def finding_of(result: StudyResult) -> Finding:
    """What the sentence of a study is made of."""
    settings, learnt, judged = result.study.settings, result.knowledge, result.judged
    parameters = known_parameters(result)
    least = max(parameters, key=lambda one: one.share).name
    return Finding(
        parameters=parameters,
        region=learnt.posterior.share,
        inside=result.inside,
        prpv=judged.prpv.value,
        fresh=judged is not result.best.assessment,
        floor=result.floor,
        chance=judged.chance,
        perfect=bool(result.perfect),
        misfit=learnt.misfit.p_value,
        fits=learnt.misfit.fits,
        information=next((one for one in learnt.information if one.name == least and _informs(one)), None),
        left=0 if result.stopped else settings.budget - len(result.trials),
        budget=max(settings.budget, len(result.trials)),
        ruled=bool(result.stopped) and len(result.trials) < settings.budget,
        starts=settings.starts,
        most_starts=result.study.family.starts,
        confirm=settings.confirm,
        declared=declared_of(settings.space.names),
    )


def _informs(information: Information) -> bool:
    return any(share > 0.0 for _, share in information.agents)


def known_parameters(result: StudyResult) -> tuple[KnownParameter, ...]:
    """What is known of each parameter, in the order of the box."""
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
