"""What the figures of a diagnosis call its two models."""

from proxytune.diagnosis import Diagnosis
from proxytune.report.style import plain

BEFORE = "declared model"
LONGEST = 45
"""Characters of added effects that are named one by one."""


def after(diagnosis: Diagnosis) -> str:
    """What a legend calls the extended model."""
    added = ", ".join(plain(effect.effect) for effect in diagnosis.effects)
    return f"with {added}" if len(added) < LONGEST else f"with {len(diagnosis.effects)} effects added"
