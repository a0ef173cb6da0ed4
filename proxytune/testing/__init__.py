"""Promises of every extension, as functions to call in a test of your own; each needs no more than the thing itself.

    check_effect    an Effect class       check_engine    an Engine
    check_agent     an Agent              check_measure   a Measure
    check_family    a DomainFamily

Each returns nothing, or raises one ConformanceError that names what is broken and what was expected.
"""

from proxytune.errors import ConformanceError
from proxytune.testing.effect import check_effect
from proxytune.testing.extension import check_agent, check_engine, check_family, check_measure

__all__ = ["ConformanceError", "check_agent", "check_effect", "check_engine", "check_family", "check_measure"]
