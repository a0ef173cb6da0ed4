"""What others published of proxies of the same names, to stand beside what is measured here."""

from collections.abc import Mapping
from dataclasses import dataclass

from proxytune.settings import Section

KEYS = ("zero_shot", "samples", "reduction")


@dataclass(frozen=True)
class Published:
    """A row of somebody's table.

    Attributes:
        zero_shot: The score in the target before any of its samples.
        samples: The target samples that were needed to converge.
        reduction: The share of samples that was saved.
    """

    zero_shot: float
    samples: int
    reduction: float


def read_published(section: Section, known: Mapping[str, object], none: str) -> Mapping[str, Published]:
    """Read the rows, each named as a proxy of the study or as learning without one.

    Raises:
        SettingsError: With file, key and remedy.
    """
    section.only((none, *known))
    return {name: _row(section.section(name)) for name in section.values}


def _row(section: Section) -> Published:
    section.only(KEYS)
    return Published(
        zero_shot=section.number("zero_shot"),
        samples=section.whole("samples", low=0, high=10**12),
        reduction=section.number("reduction", low=-1e6, high=1.0),
    )
