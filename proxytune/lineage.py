"""The names of our code under which episodes are kept; code that plays the same episodes to the last bit has one name.

So have engines that propose the same θ, and shipped learners that learn the same: an entry each, of what
`proxytune.search.engine_code` and `proxytune.learning.learner_identity` digest.

Any change in what the rooms of a family mean makes every episode of that family another one, unless it is stated here
that it does not. tests/test_lineage.py fails after such a change, and says the new digest. Then,

- if every episode is proven to be what it was (something was moved or renamed, an effect was added), append the digest
  to the family's entry of lineage.toml: the episodes keep their name, and studies that were made before go on;
- if any episode differs, let the new digest alone be the family's entry: what was kept is other episodes.

This module lies outside those rooms, so that what is said here is no part of what the digest is of.
"""

import functools
from pathlib import Path

from proxytune.files import package_table
from proxytune.identity import meaning_of

PACKAGE = Path(__file__).resolve().parent
ROOMS = {"driving": ("effects", "driving"), "environments": ("effects", "environments")}
"""Where the code lies that plays the episodes of a family: every module of these rooms counts."""
_ENTRIES = package_table("lineage.toml")
_SHARED = _ENTRIES.pop("shared")
SAME_CODE = {
    entry: tuple(one for code in codes for one in _SHARED.get(code, (code,))) for entry, codes in _ENTRIES.items()
}
"""For each family, engine and learner, what code means that does the same, the oldest first, which names them all."""


@functools.lru_cache
def code_meaning(family: str) -> str:
    """A digest of what the code of a family's rooms means, comments and docstrings left out."""
    return meaning_of((path for room in ROOMS[family] for path in (PACKAGE / room).rglob("*.py")), PACKAGE)


def code_name(family: str) -> str:
    """The name of the code of a family's rooms: that of the oldest which plays the same episodes as today's."""
    return named(family, code_meaning(family))


def named(entry: str, code: str) -> str:
    """The name of code: that of the oldest in an entry of SAME_CODE, if this is one of them, else its own."""
    same = SAME_CODE.get(entry, ())
    return same[0] if code in same else code
