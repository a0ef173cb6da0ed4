"""Scoring a study's agents in one fixed domain: how a twin's target.csv is made."""

from pathlib import Path

from proxytune.errors import EpisodeError
from proxytune.scores import ScoreTable
from proxytune.study.episodes import running
from proxytune.study.evaluate import longest_first, plan, table, told
from proxytune.study.family import load_family
from proxytune.study.progress import Watcher
from proxytune.study.settings import StudySettings

SEED_OFFSET = 1000
"""A target is measured under seeds that the study does not use, so that their noise has nothing in common."""


def measure(settings: StudySettings, model: Path, seed: int, watcher: Watcher) -> ScoreTable:
    """Score the study's agents over its starts in the domain that a model describes.

    Every metric of the family is kept. Rows are in the order of the study's agents and starts, whatever the number of
    jobs: the same model, settings and seed give the same table.

    Raises:
        InputError: If the settings, the model or the family cannot be used.
        EpisodeError: If any episode fails: a target has no holes.
    """
    family = load_family(settings, model)
    planned = plan(settings, {}, seed)
    watcher.begin(f"measuring {model.name}", 0)
    found = {}
    with running(family, longest_first(planned, {}), settings.jobs) as outcomes:
        for outcome in outcomes:
            if outcome.failure:
                raise EpisodeError(told(outcome))
            found[outcome.episode] = outcome
            watcher.episode()
    return table([found[episode] for episode in planned])
