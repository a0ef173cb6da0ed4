"""Scoring a study's agents in one fixed domain: how a twin's target.csv is made."""

from collections import Counter
from collections.abc import Mapping
from pathlib import Path

from proxytune.domain import DomainFamily, Episode
from proxytune.errors import EpisodeError
from proxytune.running.episodes import Watch, running
from proxytune.running.progress import Watcher
from proxytune.scores import ScoreTable
from proxytune.seeds import fresh_seed
from proxytune.study.evaluation import failure_of, in_common, longest_first, needed_metrics, plan
from proxytune.study.family import load_family
from proxytune.study.settings import StudySettings


def measure(settings: StudySettings, model: Path, seed: int, watcher: Watcher, repeats: int = 1) -> ScoreTable:
    """Score the study's agents over its starts in the domain that a model describes.

    Every metric of the family is kept that all episodes have. Rows are in the order of the study's agents and starts,
    whatever the number of jobs: the same model, settings and seed give the same table. Of several repeats, each has
    placement noise of its own, and episodes are labelled START/REPEAT; the first repeat is what a single one would be.

    Raises:
        InputError: If the settings, the model or the family cannot be used.
        EpisodeError: If any episode fails: a target has no holes.
    """
    family = load_family(settings, model)
    labels = _labelled(settings, seed, repeats)
    watcher.begin(f"measuring {model.name}", 0)
    metrics = _drive(family, settings, list(labels), watcher)
    scored = {(episode.agent, label): metrics[episode] for episode, label in labels.items()}
    return ScoreTable.from_episodes(in_common(scored))


def _drive(
    family: DomainFamily, settings: StudySettings, episodes: list[Episode], watcher: Watcher
) -> dict[Episode, Mapping[str, float]]:
    """The metrics of every episode; an agent's last one is told."""
    needed, left = needed_metrics(settings, family), Counter(episode.agent for episode in episodes)
    metrics: dict[Episode, Mapping[str, float]] = {}
    watch = Watch(settings.episode_timeout_s, waits=watcher.waiting)
    with running(family, longest_first(episodes, {}), settings.jobs, needed=needed, watch=watch) as outcomes:
        for outcome in outcomes:
            if outcome.metrics is None:
                raise EpisodeError(failure_of(outcome))
            agent = outcome.episode.agent
            metrics[outcome.episode] = outcome.metrics
            watcher.episode()
            left[agent] -= 1
            if not left[agent]:
                watcher.finished(f"agent {agent} measured")
    return metrics


def _labelled(settings: StudySettings, seed: int, repeats: int) -> dict[Episode, str]:
    """Every episode with its label: by agent, then start, then repeat."""
    runs = [plan(settings, {}, fresh_seed(seed, repeat)) for repeat in range(repeats)]
    return {
        episode: f"{episode.start}/{repeat}" if repeats > 1 else str(episode.start)
        for alike in zip(*runs, strict=True)
        for repeat, episode in enumerate(alike)
    }
