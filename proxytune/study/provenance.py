"""By what code a study was made: earlier code that drives the very same episodes, and which search proposed what."""

from collections.abc import Mapping
from typing import Any

from proxytune.errors import StoreError
from proxytune.search.engines.registry import engine_code
from proxytune.storage.store import Store
from proxytune.study.study import Study
from proxytune.versions import version_changes, versions_of

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
