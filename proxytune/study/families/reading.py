"""The table [families] of a study.toml: each of them is the same study of another simulator."""

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from proxytune.settings import Section
from proxytune.storage.own_files import FAMILIES

KEYS = ("family", "proxy", "domain", "parameters")
OF_ONE_FAMILY = ("domain", "proxy", "truth")
"""Keys of a study that say nothing to another domain family than its own."""
FEWEST = 2
NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9_-]{0,63}")


def study_around(folder: Path, file_name: str) -> Path | None:
    """The study.toml of which this folder is a family's; None if it is none."""
    home = folder if folder.name and folder.parent.name else folder.absolute()
    around = home.parent.parent / file_name
    own = (home / file_name).exists()
    return around if home.parent.name == FAMILIES and not own and around.is_file() else None


def family_tables(read: Section, family: str, name: str) -> dict[str, Section]:
    """The study.toml of each family, by its name: the study's own keys, those of its table over them.

    Args:
        read: The study.toml.
        family: The study's own domain family: of [domain], `proxy` and `truth` another one knows nothing.
        name: What the study is called.

    Raises:
        SettingsError: With file, key and remedy.
    """
    if FAMILIES not in read.values:
        return {}
    tables = read.section(FAMILIES)
    for one in tables.values:
        _check_name(tables, one)
    if len(tables.values) < FEWEST:
        told = f"comparing takes at least two families, got {len(tables.values)}"
        raise read.error(FAMILIES, f"{told}; add one, as in [families.planar]")
    lower = [one.lower() for one in tables.values]
    if len(set(lower)) < len(lower):
        raise read.error(FAMILIES, "two names differ in nothing but capitals, as folders' names cannot everywhere")
    return {one: _overlaid(read, tables.section(one), family, f"{name}_{one}") for one in tables.values}


def _check_name(tables: Section, name: str) -> None:
    if not NAME.fullmatch(name):
        raise tables.error(name, "is the name of a folder too; use up to 64 letters, digits, - and _, no other sign")


def _overlaid(read: Section, table: Section, family: str, name: str) -> Section:
    table.only(KEYS)
    alike = table.text("family", family) == family
    kept = {key: value for key, value in read.values.items() if alike or key not in OF_ONE_FAMILY}
    own = {key: table.values[key] for key in ("family", "proxy", "parameters") if key in table.values}
    domain: Mapping[str, Any] = {**kept.get("domain", {}), **table.section("domain").values}
    values = {**kept, **own, "domain": domain, "name": name}
    return Section(read.path, f"{table.name.removesuffix('.')}: ", {k: v for k, v in values.items() if k != FAMILIES})
