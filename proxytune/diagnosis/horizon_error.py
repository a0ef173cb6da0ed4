"""The error of open-loop prediction at one horizon, before and after, against the bracket of the noise floor."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from proxytune.diagnosis.horizon.floor import PoseNoise, noise_floor
from proxytune.diagnosis.horizon.repeats import compare_repeats
from proxytune.diagnosis.horizon.windows import Ratio, Rmse, Windows, blocks_of, cut, pose_errors, ratio, rmse
from proxytune.diagnosis.measured.drives import Drives, Floats
from proxytune.diagnosis.naming.findings import Findings
from proxytune.diagnosis.rules import RULES
from proxytune.diagnosis.verdict import Bracket, bracket
from proxytune.space import Theta


@dataclass(frozen=True)
class HorizonError:
    """The error of open-loop prediction over windows of one horizon, on drives that were not fitted.

    Attributes:
        horizon_s: Length of the windows [s].
        windows: How many there are.
        before: Position [m] with declared effects only.
        after: Position [m] with the effects that were found.
        ratio: After by before.
        floor: Between which errors a model that is right would be [m].
        heading_before: Heading [rad].
        heading_after: Heading [rad].
        heading_floor: What the noise of measured headings alone makes [rad].
    """

    horizon_s: float
    windows: int
    before: Rmse
    after: Rmse
    ratio: Ratio
    floor: Bracket
    heading_before: Rmse
    heading_after: Rmse
    heading_floor: float

    @property
    def removable_left(self) -> float | None:
        """The share of the squared error above the lower floor that is left, None where nothing was above it."""
        above = self.before.value**2 - self.floor.lower**2
        left = self.after.value**2 - self.floor.lower**2
        return max(0.0, left) / above if above > 0.05 * self.before.value**2 else None


class KeptAside(NamedTuple):
    """The drives kept aside, on which errors are measured.

    Attributes:
        drives: Drives that nothing was fitted to.
        whole: All drives of their log, in which some may be repeats of others.
        noise: The noise of their poses.
    """

    drives: Drives
    whole: Drives
    noise: PoseNoise


PoseErrors = Callable[[Drives, Theta, Windows], Floats]
"""How far a model's poses are from measured ones (M, 2): [m], [rad]."""


def horizon_error(
    found: Findings, tested: KeptAside, horizon_s: float, learnt: Theta, how: PoseErrors = pose_errors
) -> HorizonError | None:
    """The error at a horizon, None where too few blocks have a window of it.

    Args:
        found: The models.
        tested: What they are tested on.
        horizon_s: Length of the windows [s].
        learnt: What the extended model was taught besides its named effects; empty where nothing was.
        how: How a plant's poses are compared with measured ones.
    """
    drives = tested.drives
    windows = cut(drives, horizon_s)
    if len(np.unique(drives.block[windows.begin])) < RULES.fewest_blocks:
        return None
    blocks = blocks_of(drives, windows)
    before = how(drives, found.declared.theta, windows) ** 2
    same = found.model.theta == found.declared.theta
    after = before if same else how(drives, found.model.theta, windows) ** 2
    lower, turn = noise_floor(drives, windows, tested.noise)
    besides = [one.beside.theta for one in found.immaterial]
    if learnt:
        besides.append({**found.model.theta, **learnt})
    others = [pose_errors(drives, theta, windows) ** 2 for theta in besides]
    reached = min(float(np.sqrt(squares[:, 0].mean())) for squares in (before, after, *others))
    return HorizonError(
        horizon_s=horizon_s,
        windows=len(windows.begin),
        before=rmse(before[:, 0], blocks),
        after=rmse(after[:, 0], blocks),
        ratio=ratio(after[:, 0], before[:, 0], blocks),
        floor=bracket(lower, reached, compare_repeats(tested.whole, found.model.theta, horizon_s)),
        heading_before=rmse(before[:, 1], blocks),
        heading_after=rmse(after[:, 1], blocks),
        heading_floor=turn,
    )
