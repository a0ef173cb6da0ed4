"""How well each proxy of a learning experiment predicts: PRPV beside PLV, since the one does not tell the other."""

from collections.abc import Mapping
from dataclasses import dataclass, field

from proxytune.domain import Episode
from proxytune.learning.lessons import Distribution
from proxytune.learning.posterior import DRAWS
from proxytune.scores import Array
from proxytune.study.evaluation import plan, score
from proxytune.study.study_run import StudyRun
from proxytune.usefulness.chance import Chance, chance
from proxytune.usefulness.comparison import compare
from proxytune.usefulness.prpv import prpv_of_means
from proxytune.usefulness.resampling import bootstrap_means, in_blocks, interval, why_not_repeated


@dataclass(frozen=True)
class Predictivity:
    """How well a proxy predicts.

    Attributes:
        prpv: PRPV of its episodes as they are.
        chance: PRPV of a proxy that ranks the agents at random.
        resampled: PRPV of resampled episodes, the same resample for all proxies (DRAWS,); None where episodes are not
            repeated.
    """

    prpv: float
    chance: Chance
    resampled: Array | None = field(repr=False, compare=False)

    @property
    def interval(self) -> tuple[float, float] | None:
        """The 95 % interval of PRPV, which holds the value."""
        if self.resampled is None:
            return None
        low, high = interval(self.resampled)
        return min(low, self.prpv), max(high, self.prpv)


def predictivity(run: StudyRun, proxies: Mapping[str, Distribution]) -> dict[str, Predictivity | None]:
    """PRPV of every proxy, by name; None where an agent failed there from every start.

    A proxy that draws θ anew for every lesson draws it anew for every start, the same for all agents.

    Raises:
        EpisodeError: If an episode fails and the study is to stop then.
    """
    return {name: _predictivity(run, name, proxy) for name, proxy in proxies.items()}


def _predictivity(run: StudyRun, name: str, proxy: Distribution) -> Predictivity | None:
    study, planned = run.study, _planned(run, proxy)
    found = run.outcomes(planned, f"agents in {name}")
    evaluation = score(study, proxy.centre, [found[episode] for episode in planned])
    if evaluation.proxy is None or evaluation.prpv is None:
        return None
    inputs = compare(proxy=evaluation.proxy, target=study.target, metrics=study.settings.metrics)
    by_chance = chance(proxy=evaluation.proxy, target=study.target, metrics=study.settings.metrics)
    if why_not_repeated(inputs):
        return Predictivity(evaluation.prpv, by_chance, None)
    means = bootstrap_means(inputs, resamples=DRAWS, seed=0)
    resampled = in_blocks(lambda here, there: prpv_of_means(here, there, inputs.metrics), *means)
    return Predictivity(evaluation.prpv, by_chance, resampled)


def _planned(run: StudyRun, proxy: Distribution) -> list[Episode]:
    """Every agent from every start, θ drawn for each start where it is not fixed."""
    settings = run.settings
    drawn = [plan(settings, proxy.draw(start), settings.seed) for start in range(settings.starts)]
    return [episode for start, planned in enumerate(drawn) for episode in planned if episode.start == start]
