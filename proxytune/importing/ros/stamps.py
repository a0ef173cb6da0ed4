"""Whose times count: those in the messages' headers, or those of the bag."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from proxytune.errors import LogError
from proxytune.importing.source import Floats
from proxytune.settings import nearest

Whole = NDArray[np.int64]

UNSET_NS = 10**8 * 10**9
"""Stamps before 1973 are no date: a driver left them at zero, or counted from its own start."""

APART_S = 0.05
"""Clocks whose stamps differ by more in the median are worth a note."""

DRIFT_S = 0.02
"""Clocks that run apart by more are worth a note."""


@dataclass(frozen=True)
class Stamps:
    """When the messages of a topic were made and received.

    Attributes:
        header: Stamps in their headers (N,) [ns], or None for a type without a header.
        receive: When the bag received them (N,) [ns].
    """

    header: Whole | None
    receive: Whole


def seconds(stamps_ns: Whole) -> Floats:
    """Stamps in seconds, exact to half a microsecond: whole seconds and the rest are converted apart."""
    return stamps_ns // 10**9 + (stamps_ns % 10**9) * 1e-9


def choose_times(stamps: Stamps, wanted: str, where: str) -> tuple[Floats, tuple[str, ...]]:
    """Times of a topic's messages (N,) [s], and what there is to say of them.

    Args:
        stamps: Both times of each message.
        wanted: "header" or "receive".
        where: The topic, as a complaint names it.

    Raises:
        LogError: If `wanted` is neither, or some headers have a stamp and others have none.
    """
    if wanted not in ("header", "receive"):
        raise LogError(f"{where}: unknown stamps '{wanted}'; {nearest(wanted, ('header', 'receive'))}")
    received = seconds(stamps.receive)
    if wanted == "receive":
        return received, (f"Times of {where} are when the bag received each message, as asked.",)
    if stamps.header is None:
        return received, (f"{where} has no header: its times are when the bag received each message.",)
    unset = stamps.header < UNSET_NS
    if unset.all() and (stamps.receive >= UNSET_NS).all():
        reason = f"Headers of {where} hold no date"
        return received, (f"{reason}: its times are when the bag received each message.",)
    if unset.any() and not unset.all():
        number = int(np.argmax(unset)) + 1
        raise LogError(f"{where}: the header of message {number} has no time stamp; take --stamps receive")
    header = seconds(stamps.header)
    return header, _clock_notes(header, received, where)


def _clock_notes(header: Floats, received: Floats, where: str) -> tuple[str, ...]:
    """How far the headers' clock and the bag's are apart."""
    late = received - header
    apart, drift = float(np.median(late)), _drift(late)
    notes = []
    if apart > APART_S:
        reason = "messages took that long, or the clocks differ"
        notes.append(f"Messages of {where} were received {apart:.3f} s after their stamps, in the median: {reason}.")
    if apart < -APART_S:
        notes.append(
            f"Messages of {where} were received {-apart:.3f} s before their stamps, in the median: the clocks differ; "
            "--stamps receive takes the bag's times."
        )
    if abs(drift) > DRIFT_S:
        notes.append(
            f"The clock of the headers of {where} drifts by {1e3 * drift:+.0f} ms against the bag's over the drive."
        )
    return tuple(notes)


def _drift(late: Floats) -> float:
    """By how much the lateness changes from the first tenth of the messages to the last [s], in the median."""
    tenth = max(1, len(late) // 10)
    return float(np.median(late[:tenth]) - np.median(late[-tenth:]))
