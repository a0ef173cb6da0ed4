"""What a diagnosis says about the clocks of a log: as JSON, and in sentences with what to do."""

from collections.abc import Mapping, Sequence
from typing import Any

from proxytune.diagnosis import Clocks, Offset


def clocks_document(clocks: Sequence[Clocks]) -> dict[str, Any]:
    """The clocks of the log, and under `test` those of the log to test on where that is another."""
    own, *test = clocks
    own_document = {
        "offset_s": own.offset.value,
        "interval": list(own.offset.interval),
        "latency_s": own.latency.value,
        "latency_interval": list(own.latency.interval),
        "assumed_delay_s": own.assumed_delay_s,
        "declared_offset_s": own.declared_s,
        "drives": {name: {"offset_s": one.value, "interval": list(one.interval)} for name, one in own.drives.items()},
        "jumps": [{"drive": jump.drive, "time_s": jump.time_s, "by_s": jump.by_s} for jump in own.jumps],
    }
    return own_document | ({"test": clocks_document(test)} if test else {})


def clocks_notes(log: str, clocks: Sequence[Clocks], theta: Mapping[str, Any]) -> list[str]:
    """What is wrong with the clocks and what to do; where a delay was fitted, that an offset looks the same."""
    notes = [note for own in clocks for note in (*_whole(own), *_drives(own), *_jumps(own))]
    notes = [f"clocks of {log}: {note}" for note in notes]
    declared = next((own.declared_s for own in clocks), None)
    if declared is not None:
        notes.append(
            f"poses of {log} are stamped {declared:.3g} s later than commands, as it declares; that was taken out"
        )
    elif "delay" in theta:
        notes.append(
            "delay and an offset between the clocks of commands and poses are one number: the delay is the "
            "robot's only if one clock stamped both"
        )
    return notes


def _whole(clocks: Clocks) -> list[str]:
    if not clocks.offset.value:
        return []
    latency, offset, assumed = clocks.latency, clocks.offset, clocks.assumed_delay_s
    lag = (
        f"motion comes {-latency.value:.2f} s before its command, which no robot does"
        if latency.value < 0.0
        else f"motion comes {latency.value:.2f} s after its command"
    )
    early = "early" if offset.value < 0.0 else "late"
    return [
        f"{lag}; poses are stamped {abs(offset.value):.2f} s too {early} ({_interval(offset)}) if the robot's delay "
        f"is {assumed:.2f} s; this was corrected. Stamp both with one clock, or move the poses yourself"
    ]


def _drives(clocks: Clocks) -> list[str]:
    return [
        f"in drive {name} poses are stamped {abs(one.value):.2f} s {'earlier' if one.value < 0.0 else 'later'} "
        f"({_interval(one)}) than in the others; this was corrected. Check how its clocks were set"
        for name, one in clocks.drives.items()
    ]


def _jumps(clocks: Clocks) -> list[str]:
    return [
        f"in drive {jump.drive} the clock jumps at about {jump.time_s:.0f} s: poses are stamped {abs(jump.by_s):.2f} s "
        f"{'earlier' if jump.by_s < 0.0 else 'later'} from then on; only the longest stretch without a jump was used. "
        "Keep clocks from being set during a drive"
        for jump in clocks.jumps
    ]


def _interval(offset: Offset) -> str:
    return f"{abs(offset.interval[0]):.2f} to {abs(offset.interval[1]):.2f}"
