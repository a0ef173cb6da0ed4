"""Why PLV is not known, and what to do about it: what the learner without a proxy does not show."""

from typing import NamedTuple

import numpy as np

from proxytune.learning.plv import SampleNeeds
from proxytune.learning.settings import NONE

RAISE = "raise teaching.target_samples"


class Unknown(NamedTuple):
    """Why PLV is not known.

    Attributes:
        reason: Half a sentence.
        remedy: The other half, an instruction.
    """

    reason: str
    remedy: str


def why_unknown(needs: SampleNeeds) -> Unknown | None:
    """Why nothing is known of PLV, or no more than a bound; None where it is known."""
    last, tolerance = f"{needs.last:g}", f"{needs.when.tolerance:g}"
    if needs.gain is None:
        reason = f"teaching.target_samples has no number from 1 to half of {last} that would show a rise towards it"
        return Unknown(reason, f"add numbers between 0 and {last} to teaching.target_samples")
    if not needs.settled:
        reason = (
            f"without a proxy the score still rises by more than {tolerance} over the last doubling to {last} samples"
        )
        return Unknown(reason, RAISE)
    if not np.isfinite(np.median(needs.needed[NONE])):
        reason = f"without a proxy the score does not come to {needs.when.threshold:g} within {last} samples"
        return Unknown(reason, f"lower teaching.level, or {RAISE}")
    return None
