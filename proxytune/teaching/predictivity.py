"""How well each proxy of a learning experiment predicts: PRPV beside PLV, since the one does not tell the other."""

from collections.abc import Mapping

from proxytune.learning.lessons import Distribution
from proxytune.running.progress import Watcher
from proxytune.storage.store import Store
from proxytune.study.evaluation import evaluation, simulate
from proxytune.study.study import Study


def predictivity(
    study: Study, store: Store, proxies: Mapping[str, Distribution], watcher: Watcher
) -> dict[str, float | None]:
    """PRPV of every proxy, by name; None where it is no single domain instance, or an agent failed there.

    Raises:
        EpisodeError: If an episode fails and the study is to stop then.
    """
    found: dict[str, float | None] = {}
    for name, proxy in proxies.items():
        if proxy.fixed:
            simulate(study, store, proxy.centre, watcher, f"agents in {name}")
        scored = evaluation(study, store, proxy.centre) if proxy.fixed else None
        found[name] = scored.prpv if scored else None
    return found
