"""How well each proxy of a learning experiment predicts: PRPV beside PLV, since the one does not tell the other."""

from collections.abc import Mapping

from proxytune.learning.lessons import Distribution
from proxytune.study.study_run import StudyRun


def predictivity(run: StudyRun, proxies: Mapping[str, Distribution]) -> dict[str, float | None]:
    """PRPV of every proxy, by name; None where it is no single domain instance, or an agent failed there.

    Raises:
        EpisodeError: If an episode fails and the study is to stop then.
    """
    return {
        name: run.evaluate(proxy.centre, f"agents in {name}").prpv if proxy.fixed else None
        for name, proxy in proxies.items()
    }
