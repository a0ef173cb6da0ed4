"""A study ready to run: its settings, its domain family, and the target's scores."""

import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from proxytune.domain import DomainFamily
from proxytune.effects import Catalogue, read_model
from proxytune.errors import InputError
from proxytune.scores import ScoreTable
from proxytune.search.engines import gaussian_process
from proxytune.search.engines.engine import Engine
from proxytune.search.engines.registry import STUDY_ENGINES, engine_of, why_not_engine
from proxytune.settings import nearest
from proxytune.space import Theta
from proxytune.study.family import load_family
from proxytune.study.objective import PRPV, Objective, objective_of
from proxytune.study.own_code import code_of
from proxytune.study.settings import LEARNING, StudySettings, read_study_settings
from proxytune.study.target import read_target, with_scores
from proxytune.study.weights import unnoticed
from proxytune.versions import version_changes

UNSAID = {"batch": 1, "engine": "gp"}
"""What a study.db that names none of these was run with."""


@dataclass(frozen=True)
class Study:
    """What a trial is a function of, apart from θ.

    Attributes:
        settings: What study.toml says.
        family: The proxy's domain family.
        target: The target's scores of the study's agents, in the study's order: the metrics by which they are compared,
            then every other one that the family has too.
        identity: What determines the result of an episode in the proxy, apart from the episode.
        truth: The θ that made the target, where study.toml names a model of it; nothing depends on it.
        cautions: What of study.toml or of the target's table is left out, in one line each.
        objective: The measure that its trials make small or large.
        engine: What proposes its trials after the design.
        code: A digest of what the user's own code means; failures of other code are not remembered.
    """

    settings: StudySettings
    family: DomainFamily
    target: ScoreTable
    identity: str
    truth: Theta | None = None
    cautions: tuple[str, ...] = ()
    objective: Objective = PRPV
    engine: Engine = gaussian_process.ENGINE
    code: str = ""


def open_study(path: Path) -> Study:
    """Read a study.toml, load the family it names and the target's scores.

    Raises:
        InputError: If anything in it cannot be used, with file, key and remedy.
    """
    return open_settings(read_study_settings(path))


def open_settings(settings: StudySettings) -> Study:
    """Load the family that a study.toml names and the target's scores.

    Raises:
        InputError: As open_study, and if they are of several families.
    """
    settings.check_single()
    family = load_family(settings, settings.proxy)
    known, left_out = with_scores(settings)
    target, unused = read_target(known, family)
    cautions, objective = (*left_out, *unused, *unnoticed(settings.folder)), objective_of(settings)
    truth, engine, code = _truth(settings, family), _engine(settings), code_of(settings)
    return Study(known, family, target, family.identity, truth, cautions, objective, engine, code)


def _engine(settings: StudySettings) -> Engine:
    """The engine that a study names, which is installed and may be named.

    Raises:
        SettingsError: If it is not.
    """
    try:
        engine = engine_of(settings.engine, settings.folder)
    except InputError as problem:
        raise settings.error("engine", str(problem)) from None
    if not engine.in_studies:
        raise settings.error("engine", f"'{engine.name}' is for `compare` only; {nearest(engine.name, STUDY_ENGINES)}")
    reason = why_not_engine(engine, composed=settings.objective != LEARNING)
    if reason:
        raise settings.error("engine", reason)
    return engine


def _truth(settings: StudySettings, family: DomainFamily) -> Theta | None:
    if settings.truth is None:
        return None
    if not settings.truth.is_file():
        raise settings.error("truth", f"no such file: {settings.truth}; check the path, or remove it")
    # A family with parameters that are no effects reads them itself
    own = getattr(family, "truth", None)
    known = own(settings.truth) if own else read_model(settings.truth, Catalogue(settings.folder.resolve())).theta
    return {name: known[name] for name in settings.space.names if name in known}


def facts(study: Study) -> dict[str, Any]:
    """All that a finished trial depends on, by its name in study.toml: if one changes, trials lose their meaning.

    Budget, rules to stop, jobs and what to do on failure are not among them. The proxy's model is: the family's
    identity covers it, and the versions of what simulates, which are here to be told. The engine `gp` goes without
    saying, as it did when there was no other, and so do batches of one trial. An engine that learns from every output
    depends on the whole of the target's table, and on the pre-flight's noise.
    """
    settings = study.settings
    named: dict[str, Any] = {"batch": settings.batch, "engine": settings.engine}
    said = {key: value for key, value in named.items() if value != UNSAID[key]}
    compared = [metric.name for metric in settings.metrics]
    learns = study.engine.learns_from == "outputs"
    if learns:
        said["preflight"] = settings.preflight
    versions = getattr(study.family, "versions", None)
    if versions:
        said["versions"] = dict(versions)
    return {
        "family": settings.family,
        "target": _table_digest(study.target if learns else study.target.select(compared)),
        "objective": settings.objective,
        "metrics": sorted(str(metric) for metric in settings.metrics),
        "agents": sorted(settings.agents),
        "starts": settings.starts,
        "initial": settings.initial,
        "seed": settings.seed,
        **said,
        "cut_off": settings.cut_off,
        **{f"agents.{name}": settings.aliases[name] for name in settings.agents if name in settings.aliases},
        **{f"parameters.{i.name}": [i.low, i.high] for i in settings.space.intervals},
        **{f"domain.{key}": json.dumps(value, default=str) for key, value in settings.domain.values.items()},
        "identity": study.identity,
    }


def changes(before: Mapping[str, Any], after: Mapping[str, Any]) -> list[str]:
    """Which facts differ, each as one phrase for the user."""
    keys = [key for key in {**after, **before} if before.get(key) != after.get(key)]
    # Other agents or metrics make it another part of the target's table, and what the family is told makes it another.
    # Another engine may learn from another part of it, and from the pre-flight.
    implied = {"target"} if {"agents", "metrics", "engine", "starts"} & set(keys) else set()
    implied |= {"preflight"} if "engine" in keys else set()
    told = any(key == "family" or key.startswith(("domain.", "agents.")) for key in keys)
    named = [key for key in keys if key not in implied | {"identity", "versions"}]
    both = "versions" in before and "versions" in after and not told
    versions = version_changes(before["versions"], after["versions"]) if both else []
    other = ["the domain family (its code, its robot or the proxy's model)"]
    unnamed = "identity" in keys and not (told or versions)
    return [*(_change(key, before.get(key), after.get(key)) for key in named), *versions, *(other if unnamed else ())]


def _change(key: str, before: Any, after: Any) -> str:
    if key == "target":
        return "target (its contents)"
    before = UNSAID.get(key) if before is None else before
    shown = [("nothing" if value is None else json.dumps(value)) for value in (before, after)]
    return f"{key} (was {shown[0]})" if max(map(len, shown)) < 60 else key


def _table_digest(table: ScoreTable) -> str:
    """A digest that the order of agents, episodes and metrics does not change."""
    inner = table.select(sorted(table.metrics)).arrange(agents=sorted(table.agents), episodes=sorted(table.episodes))
    text = json.dumps([inner.agents, inner.episodes, inner.metrics, inner.values.tolist()])
    return hashlib.sha256(text.encode()).hexdigest()[:16]
