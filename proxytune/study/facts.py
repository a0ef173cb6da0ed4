"""The facts of a study: what its trials depend on, kept in study.db and compared by whoever goes on or looks.

A fact is named as study.toml names it, and there are three kinds. What trials depend on (`study_facts`) are settings,
the search box, agents, the target's table and the domain family: where one differs from what is stored, trials have
lost their meaning, and `changes` says which. Some of these (CODE) say by what code, not from what settings. What is
noted beside (NOTED) is no part of the comparison: no trial depends on it.

- Going on (`check_facts`): everything must be as it was. Only the search may be another one: its earlier trials stay
  what they are, so that this is told and kept (`note_search`).
- Looking (`stored_run`, `open_read_only`): the code may have changed since. The study is taken as it was: with the
  identity that is stored, and where it names code of its own, with the family as that had described itself
  (`describe`), so that none of it runs.
"""

import json
import math
from collections.abc import Mapping
from dataclasses import replace
from types import MappingProxyType, SimpleNamespace
from typing import Any, NoReturn, cast

from proxytune.domain import DomainFamily
from proxytune.errors import SettingsError, StoreError
from proxytune.extensions import folders
from proxytune.identity import digest, version_changes, versions_of
from proxytune.search import ENGINE_NAMES, Engine, engine_code, engine_of
from proxytune.space import Parameter
from proxytune.storage import Store
from proxytune.study.apart import APART
from proxytune.study.family import GIVEN
from proxytune.study.opening import Study, objective_of, open_settings, read_target, with_scores
from proxytune.study.preflight import NOT_REPEATABLE
from proxytune.study.settings import LEARNING, StudySettings
from proxytune.study.study_run import StudyRun

CODE = ("identity", "versions")
"""Facts that say by what code, not from what settings."""
SEARCH = "search"
"""Lists which code proposed trials: from which trial on, its digest and the versions of the packages it uses."""
DESCRIBED = "described"
"""Tells what figures and tables need of a study's own code."""
COPIED = {"learn_from": "learnt", "low_fidelity": "learnt_low_fidelity"}
"""Hold the trials that these keys of study.toml name, as they were when the study began."""
NOMINAL = "nominal"
"""The nominal θ of the parameters that are searched, where the family knows it."""
NOTED = (LEARNING, SEARCH, DESCRIBED, NOT_REPEATABLE, APART, NOMINAL, *COPIED.values())
"""Facts that trials do not depend on; LEARNING has those of a search for learning value."""
UNSAID = {"batch": 1, "engine": "gp"}
"""Values that go without saying: a study.db that names none of these was run with them."""
SEARCH_PACKAGES = ("numpy", "scipy", "scikit-learn", "scikit-optimize")


def study_facts(study: Study) -> dict[str, Any]:
    """All that a finished trial depends on, by its name in study.toml: if one changes, trials lose their meaning.

    Budget, rules to stop, jobs and what to do on failure are not among them. The proxy's model is: the family's
    identity covers it, and the versions of what simulates, which are here to be told. An engine that learns from every
    output depends on the whole of the target's table, and on the pre-flight's noise.
    """
    settings, learns = study.settings, study.engine.learns_from == "outputs"
    said = {key: getattr(settings, key) for key, value in UNSAID.items() if getattr(settings, key) != value}
    versions = getattr(study.family, "versions", None)
    table = study.target if learns else study.target.select(settings.metric_names)
    inner = table.select(sorted(table.metrics)).arrange(agents=sorted(table.agents), episodes=sorted(table.episodes))
    return {
        "family": settings.family,
        "target": digest(json.dumps([inner.agents, inner.episodes, inner.metrics, inner.values.tolist()])),
        "objective": settings.objective,
        "metrics": sorted(str(metric) for metric in settings.metrics),
        "agents": sorted(settings.agents),
        "starts": settings.starts,
        "initial": settings.initial,
        "seed": settings.seed,
        **said,
        **({"preflight": settings.preflight} if learns else {}),
        **({"versions": dict(versions)} if versions else {}),
        **{key: list(names) for key, names in settings.sources.items()},
        "cut_off": settings.cut_off,
        **{f"agents.{name}": settings.aliases[name] for name in settings.agents if name in settings.aliases},
        **{f"parameters.{i.name}": [i.low, i.high] for i in settings.space.intervals},
        **{f"domain.{key}": json.dumps(value, default=str) for key, value in settings.domain.values.items()},
        "identity": study.identity,
    }


def stored_facts(store: Store) -> dict[str, Any]:
    """What the trials in a store depended on."""
    stored = {key: value for key, value in store.facts().items() if key not in NOTED}
    if not isinstance(stored.get("versions", {}), dict):
        raise _unreadable(store, "versions")
    return stored


def changes(before: Mapping[str, Any], after: Mapping[str, Any]) -> list[str]:
    """The facts that differ, each as one phrase for the user."""
    keys = [key for key in {**after, **before} if before.get(key) != after.get(key)]
    # Other agents or metrics make it another part of the target's table, and what the family is told makes it another.
    # Another engine may learn from another part of it, and from the pre-flight.
    implied = {"target"} if {"agents", "metrics", "engine", "starts"} & set(keys) else set()
    implied |= {"preflight"} if "engine" in keys else set()
    told = any(key == "family" or key.startswith(("domain.", "agents.")) for key in keys)
    named = [_change(key, before, after) for key in keys if key not in {*implied, *CODE}]
    both = "versions" in before and "versions" in after and not told
    versions = version_changes(before["versions"], after["versions"]) if both else []
    other = ["the domain family (its code, its robot or the proxy's model)"]
    return [*named, *versions, *(other if "identity" in keys and not (told or versions) else ())]


def _change(key: str, before: Mapping[str, Any], after: Mapping[str, Any]) -> str:
    if key == "target":
        return "target (its contents)"
    was = UNSAID.get(key) if before.get(key) is None else before[key]
    shown = [("nothing" if value is None else json.dumps(value)) for value in (was, after.get(key))]
    return f"{key} (was {shown[0]})" if max(map(len, shown)) < 60 else key


def check_facts(run: StudyRun) -> None:
    """See to it that what is in the store was made by this very study; a store without finished trials begins anew.

    Raises:
        SettingsError: If there are finished trials and what they depend on has changed.
    """
    study, store = run.study, run.store
    before, now = stored_facts(store), study_facts(study)
    if before != now:
        if set(store.searches()) - {LEARNING}:
            raise _changed(study, store, before, now)
        noted = {key: value for key, value in store.facts().items() if key in NOTED and key not in COPIED.values()}
        store.begin({**now, **noted}, study.objective.name)
    describe(study, store)


def stored_run(study: Study, store: Store) -> StudyRun:
    """The study as its trials were run, to be looked at: with the domain family of then where its code has changed.

    Raises:
        SettingsError: If anything but code that the finished trials depend on has changed.
    """
    before = stored_facts(store)
    then = replace(study, identity=before.get("identity", study.identity))
    now = study_facts(then)
    as_now = {**before, **{key: now[key] for key in CODE if key in now}}
    if before and any(as_now.get(key) != now.get(key) for key in {**as_now, **now} if key not in CODE):
        raise _changed(then, store, as_now, now)
    return StudyRun(then, store)


def open_read_only(settings: StudySettings, store: Store) -> StudyRun:
    """A study to be looked at as its trials were run; code of its own that it names does not run.

    An objective of one's own is computed anew for figures, so that its code is needed; where none is run, the study is
    refused.

    Raises:
        InputError: If anything in it cannot be used, or what the finished trials depend on has changed.
        StoreError: If what is stored is not as we write it.
    """
    described = store.facts().get(DESCRIBED)
    if described is None or ":" in settings.objective:
        return stored_run(open_settings(settings), store)
    try:
        family, engine, truth = _described(settings, store, described)
    except (TypeError, ValueError, KeyError, AttributeError) as problem:
        raise _unreadable(store, DESCRIBED, f" ({problem!r:.80})", "") from None
    known, left_out = with_scores(settings)
    target, unused = read_target(known, family)
    cautions, objective = (*left_out, *unused), objective_of(settings)
    study = Study(known, family, target, family.identity, truth, cautions, objective, engine)
    return stored_run(study, store)


def _changed(study: Study, store: Store, before: Mapping[str, Any], now: Mapping[str, Any]) -> SettingsError:
    settings = study.settings
    where = f"{settings.path}: {settings.family_name and f'families.{settings.family_name}: '}"
    database = store.path if settings.family_name else store.path.name
    remedy = f"put it back, or move {database} away to start again"
    return SettingsError(f"{where}changed since the first trial: {', '.join(changes(before, now))}; {remedy}")


def _unreadable(
    store: Store, fact: str, why: str = "", remedy: str = "; restore a copy, or move it away"
) -> StoreError:
    return StoreError(f"{store.path}: '{fact}' is not as proxytune writes it{why}{remedy}")


def note_search(study: Study, store: Store) -> str:
    """Keep which code proposes from the next trial on; tell if it is other code, or packages, than before."""
    engine, first = study.engine, len(store.trials(study.objective.name)) + 1
    if first > study.settings.budget:
        return ""
    versions = versions_of((*SEARCH_PACKAGES, *(engine.needs.modules if engine.needs else ())))
    now = {"first_trial": first, "code": engine_code(engine), "versions": versions}
    known = [one for one in _searches(store) if one["first_trial"] < first]
    changed: list[str] = []
    if known:
        changed += ["the code of the engine"] if known[-1]["code"] != now["code"] else []
        changed += version_changes(known[-1]["versions"], versions)
    if changed or not known:
        store.save_fact(SEARCH, [*known, now])
    if not changed:
        return ""
    return f"trials from {first} on are proposed by another search than those before: {', '.join(changed)}"


def _searches(store: Store) -> list[dict[str, Any]]:
    known = store.facts().get(SEARCH, [])
    try:
        whole = all(int(one["first_trial"]) and one["code"] and dict(one["versions"]) for one in known)
    except (TypeError, ValueError, KeyError):
        whole = False
    if not whole or not isinstance(known, list):
        raise _unreadable(store, SEARCH)
    return known


def describe(study: Study, store: Store) -> None:
    """Keep what is needed to look at a study without its own code, if it has run any."""
    if str(study.settings.folder.resolve()) not in folders() and study.settings.family != GIVEN:
        return
    family, own = study.family, study.settings.space.names
    described = {
        "metrics": {name: str(unit) for name, unit in family.metrics.items()},
        "units": {name: str(family.parameters[name].unit) for name in dict.fromkeys((*family.parameters, *own))},
        "starts": int(family.starts),
        "learns_from": study.engine.learns_from,
        "truth": dict(study.truth) if study.truth is not None else None,
    }
    if store.facts().get(DESCRIBED) != described:
        store.save_fact(DESCRIBED, described)


def _described(
    settings: StudySettings, store: Store, described: Mapping[str, Any]
) -> tuple[DomainFamily, Engine, Mapping[str, float] | None]:
    """The domain family as it had described itself when its study was run, the engine, and the true θ."""

    def refuse(*_: Any) -> NoReturn:
        raise StoreError("a study that is only looked at proposes nothing")

    parameters = {
        name: Parameter(name=name, unit=str(unit), low=-math.inf, high=math.inf, neutral=0.0)
        for name, unit in described["units"].items()
    }
    metrics = {str(name): str(unit) for name, unit in described["metrics"].items()}
    identity, starts = str(store.facts().get("identity", "")), int(described["starts"])
    # It can drive nothing.
    family = SimpleNamespace(identity=identity, metrics=metrics, parameters=MappingProxyType(parameters), starts=starts)
    name, learns_from, truth = settings.engine, described["learns_from"], described["truth"]
    engine = engine_of(name) if name in ENGINE_NAMES else Engine(name, name, "", refuse, learns_from)
    return cast(DomainFamily, family), engine, dict(truth) if truth is not None else None
