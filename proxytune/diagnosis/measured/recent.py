"""The latest results of a function, kept by all that determines them."""

from collections.abc import Callable, Hashable
from typing import Generic, TypeVar

Result = TypeVar("Result")

MOST = 6
"""So many results are kept: those of long drives are large, and what is asked for again is asked for soon."""


class Recent(Generic[Result]):
    """The latest few results: what is asked for again is not worked out again."""

    def __init__(self) -> None:
        self._known: dict[Hashable, Result] = {}

    def get(self, key: Hashable, make: Callable[[], Result]) -> Result:
        """The result of a key, made if it is not kept; the one asked for longest ago is forgotten."""
        result = self._known.pop(key) if key in self._known else make()
        self._known[key] = result
        if len(self._known) > MOST:
            del self._known[next(iter(self._known))]
        return result
