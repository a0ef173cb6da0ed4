"""By what code a study was made: earlier code that drives the very same episodes, and which search proposed what.

Looking at a study without running any of its own code: study.db has what its code had said of itself.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any, NoReturn, cast

from proxytune.domain import DomainFamily
from proxytune.errors import StoreError
from proxytune.identity import version_changes, versions_of
from proxytune.search import ENGINE_NAMES, Engine, engine_code, engine_of
from proxytune.space import Parameter
from proxytune.storage import Store
from proxytune.study.opening import Study, objective_of, open_settings, read_target, with_scores
from proxytune.study.settings import StudySettings

SEARCH = "search"
"""The fact that lists which code proposed trials: from which trial on, its digest and the packages it uses."""
PACKAGES = ("numpy", "scipy", "scikit-learn", "scikit-optimize")
CODE = ("identity", "versions", SEARCH)
"""Facts that say by what code, not from what settings."""


def adopt(study: Study, store: Store) -> None:
    """Make what the store has under earlier identities of the family belong to it: these episodes are the very same.

    A study from before versions were kept is taken to have been made with those of today.
    """
    earlier = getattr(study.family, "earlier_identities", ())
    if earlier:
        store.rename_identity(earlier, study.identity)
    known, versions = store.facts(), getattr(study.family, "versions", None)
    if versions and "versions" not in known and known.get("identity") == study.identity:
        store.save_fact("versions", dict(versions))


def differ(before: Mapping[str, Any], after: Mapping[str, Any]) -> bool:
    """Whether two studies' facts differ in anything but the code by which they were made."""
    return any(before.get(key) != after.get(key) for key in {**before, **after} if key not in CODE)


def note_search(study: Study, store: Store) -> str:
    """Keep which code proposes trials from the next one on.

    Returns:
        One line if it is other code than before, or other packages; empty if not, or if no trial is left to propose.
    """
    engine, first = study.engine, len(store.trials(study.objective.name)) + 1
    if first > study.settings.budget:
        return ""
    library = engine.needs
    needs = library.modules if library else ()
    now = {"first_trial": first, "code": engine_code(engine), "versions": versions_of((*PACKAGES, *needs))}
    known = [one for one in _searches(store) if one["first_trial"] < first]
    changed = _changes(known[-1], now) if known else []
    if changed or not known:
        store.save_fact(SEARCH, [*known, now])
    if not changed:
        return ""
    return f"trials from {first} on are proposed by another search than those before: {', '.join(changed)}"


def _searches(store: Store) -> list[dict[str, Any]]:
    """Which code has proposed trials so far.

    Raises:
        StoreError: If that is not as we write it.
    """
    known = store.facts().get(SEARCH, [])
    try:
        whole = all(int(one["first_trial"]) and one["code"] and dict(one["versions"]) for one in known)
    except (TypeError, ValueError, KeyError):
        whole = False
    if not whole or not isinstance(known, list):
        raise StoreError(f"{store.path}: '{SEARCH}' is not as proxytune writes it; restore a copy, or move it away")
    return known


def _changes(before: Mapping[str, Any], after: Mapping[str, Any]) -> list[str]:
    code = ["the code of the engine"] if before["code"] != after["code"] else []
    return [*code, *version_changes(before["versions"], after["versions"])]


DESCRIBED = "described"
"""The fact that tells what figures and tables need of a study's code."""


@dataclass(frozen=True)
class DescribedFamily:
    """What a domain family had said of itself when its study was run; it can drive nothing."""

    identity: str
    metrics: Mapping[str, str]
    parameters: Mapping[str, Parameter]
    starts: int


def describe(study: Study, store: Store) -> None:
    """Keep what is needed to look at a study without its own code, if it names any."""
    if not names_own_code(study.settings):
        return
    family = study.family
    described = {
        "metrics": {name: str(unit) for name, unit in family.metrics.items()},
        "units": {name: str(parameter.unit) for name, parameter in family.parameters.items()},
        "starts": int(family.starts),
        "learns_from": study.engine.learns_from,
        "truth": dict(study.truth) if study.truth is not None else None,
    }
    if store.facts().get(DESCRIBED) != described:
        store.save_fact(DESCRIBED, described)


def open_to_look(settings: StudySettings, store: Store) -> Study:
    """A study to look at; of one that names code of its own, as that had described itself.

    An objective of one's own is computed anew for figures, so that its code is needed.

    Raises:
        InputError: If anything in it cannot be used.
        StoreError: If the description is none.
    """
    described = store.facts().get(DESCRIBED)
    if described is None or ":" in settings.objective or not names_own_code(settings):
        return open_settings(settings)
    try:
        family, engine, truth = _described(settings, store, described)
    except (TypeError, ValueError, KeyError, AttributeError) as problem:
        raise StoreError(f"{store.path}: '{DESCRIBED}' is not as proxytune writes it ({problem!r:.80})") from None
    known, left_out = with_scores(settings)
    target, unused = read_target(known, cast(DomainFamily, family))
    objective = objective_of(settings)
    cautions = (*left_out, *unused)
    return Study(known, cast(DomainFamily, family), target, family.identity, truth, cautions, objective, engine)


def names_own_code(settings: StudySettings) -> bool:
    """Whether study.toml itself names code that is not proxytune's."""
    names = (settings.family, settings.engine, settings.objective, *settings.loaded_agents)
    return any(":" in name and not name.startswith("proxytune.") for name in names)


def _described(
    settings: StudySettings, store: Store, described: Mapping[str, Any]
) -> tuple[DescribedFamily, Engine, Mapping[str, float] | None]:
    parameters = {
        name: Parameter(name=name, unit=str(unit), low=-math.inf, high=math.inf, neutral=0.0)
        for name, unit in described["units"].items()
    }
    metrics = {str(name): str(unit) for name, unit in described["metrics"].items()}
    identity = str(store.facts().get("identity", ""))
    family = DescribedFamily(identity, metrics, MappingProxyType(parameters), int(described["starts"]))
    truth = described["truth"]
    return family, _engine(settings.engine, described["learns_from"]), dict(truth) if truth is not None else None


def _engine(name: str, learns_from: Any) -> Engine:
    """The shipped engine, or the place of one that is not."""
    return engine_of(name) if name in ENGINE_NAMES else Engine(name, name, "", _proposes_nothing, learns_from)


def _proposes_nothing(*_: Any) -> NoReturn:
    raise StoreError("a study that is only looked at proposes nothing")
