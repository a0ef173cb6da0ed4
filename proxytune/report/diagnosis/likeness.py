"""What a diagnosis says about drives that seem to be of two robots."""

from collections.abc import Sequence
from typing import Any

from proxytune.diagnosis import RobotClusters


def unlike_document(unlike: RobotClusters | None, names: Sequence[str]) -> dict[str, Any] | None:
    """The wheel that differs, and its gain in each of two groups of drives; None where all drives are alike."""
    if unlike is None:
        return None
    groups = [
        {"gain": gain, "drives": [names[number] for number in group]}
        for gain, group in zip(unlike.gains, unlike.groups, strict=True)
    ]
    return {"wheel": unlike.wheel, "groups": groups}


def unlike_notes(unlike: RobotClusters | None, names: Sequence[str]) -> list[str]:
    """One sentence that names the groups and says what to do."""
    if unlike is None:
        return []
    parts = [
        f"{gain:.2f} in {', '.join(names[number] for number in group)}"
        for gain, group in zip(unlike.gains, unlike.groups, strict=True)
    ]
    return [
        f"drives disagree: the {unlike.wheel} wheel's gain is {' but '.join(parts)}, as if of two robots, or of "
        "one on two floors; no result here holds for both: diagnose each group alone, or find what changed"
    ]
