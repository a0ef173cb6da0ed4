"""The result of a diagnosis: everything that a log says of a model.

The verdict: the error that is left, against what noise alone would leave.
The error of open-loop prediction at one horizon, before and after, against the bracket of the noise floor.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from proxytune.diagnosis.motion.clocks import Clocks, Parts
from proxytune.diagnosis.motion.discrepancy_match import Learning
from proxytune.diagnosis.motion.drives import Drives, Floats
from proxytune.diagnosis.motion.effect_size import Unlike, Worth
from proxytune.diagnosis.motion.evidence import AdoptedEffect, Findings
from proxytune.diagnosis.motion.innovations import Noise, at_edge
from proxytune.diagnosis.motion.manoeuvres import Manoeuvre
from proxytune.diagnosis.motion.multistep_fit import Polish, PoseNoise, noise_floor
from proxytune.diagnosis.motion.prediction import (
    Ratio,
    Repeated,
    Rmse,
    Windows,
    blocks_of,
    compare_repeats,
    cut,
    pose_errors,
    ratio,
    rmse,
)
from proxytune.diagnosis.rules import RULES
from proxytune.driving import Robot
from proxytune.space import Theta


class Bracket(NamedTuple):
    """The two errors between which that of a right model lies.

    Attributes:
        lower: What the noise of measured poses alone makes [m].
        upper: What a right model might have by chance where this was the lowest error that any model reached, less what
            drives repeat of it [m].
        reached: The lowest error that any model reached [m].
        again: What drives from the same commands say; None where too few were driven.
    """

    lower: float
    upper: float
    reached: float
    again: Repeated | None


def bracket(lower: float, reached: float, again: Repeated | None) -> Bracket:
    """Bracket the error of a right model; the lower end is an estimate too, and never above what a model reached.

    Args:
        lower: What the noise of poses makes [m].
        reached: The lowest error of any model [m].
        again: What drives from the same commands say.
    """
    lower = min(lower, reached)
    upper = reached if again is None else _upper_from_repeats(reached, again)
    return Bracket(lower, max(lower, RULES.lowest_by_chance * upper), reached, again)


def _upper_from_repeats(reached: float, again: Repeated) -> float:
    """The most of an error that can be noise [m]: all of it in windows that were driven once."""
    most = min(reached, again.apart * again.share.interval[1] / again.share.value)
    return float(np.sqrt((1.0 - again.part) * reached**2 + again.part * most**2))


def verdict(after: float, floor: Bracket, *, named: bool, unnamed: bool) -> str:
    """Give one of five answers; none says that all is explained where the error is beyond the floor.

    Args:
        after: The error that is left [m].
        floor: The floor's bracket at the same horizon.
        named: Whether effects were added.
        unnamed: Whether a signal explains more of the rest than any named effect.
    """
    if is_at_floor(after, floor, unnamed=unnamed):
        return "explained" if named else "nothing missing"
    if unnamed or _repeats_more(floor):
        return "partly explained" if named else "unexplained"
    return "cannot be told"


def is_at_floor(after: float, floor: Bracket, *, unnamed: bool) -> bool:
    """Whether an error is no more than noise: of poses, or of what drives do not repeat, or nothing lowers it."""
    if after <= RULES.floor_factor * floor.lower:
        return True
    if unnamed or floor.reached < RULES.lowers * after:
        return False
    if floor.again is not None:
        return floor.again.share.value >= 1.0 / RULES.floor_factor and after <= RULES.repeats_alike * floor.again.apart
    return floor.upper < RULES.lowest_by_chance * RULES.narrow_bracket * floor.lower


def _repeats_more(floor: Bracket) -> bool:
    """Whether drives repeat more than the model predicts."""
    return floor.again is not None and floor.again.share.interval[1] < 1.0 / RULES.floor_factor


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


MAIN_S = 2.0
"""The horizon of the one error that stands for all."""


@dataclass(frozen=True)
class Estimate:
    """A parameter's fitted value with its 95 % interval."""

    value: float
    interval: tuple[float, float]
    unit: str


@dataclass(frozen=True)
class Diagnosis:
    """What a log says of a model.

    Attributes:
        log: The log's name.
        robot: The robot.
        verdict: "nothing missing", "explained", "partly explained", "unexplained" or "cannot be told".
        declared: Declared parameters, fitted without any other effect, by name in θ.
        theta: All parameters of the extended model, by name in θ.
        effects: The effects that were added, all of which matter for prediction.
        immaterial: Effects that have evidence, and are not shown to matter for prediction: no part of the model.
        worth: The error without each of both by the error with it, on drives that were not fitted, by name and horizon.
        polish: How the extended model's parameters were fitted to windows, None where single steps tell as well.
        residual_depends_on: Signals that explain what no named effect does, those of the learnt remainder first.
        errors: On the planar plant, by horizon, shortest first.
        confirmed: The error over 2 s on the bullet plant, None where the robot has no body for it.
        could_not_be_seen: Effects that these drives could not have shown.
        manoeuvre: What to drive to tell rivals apart, or noise from what is missing; None where nothing is asked.
        parts: The drives that were fitted and tested.
        found: What the search came to.
        clocks: Those of the log, and of the log to test on where that is another.
        unlike: Two groups that the drives fall in as if of two robots, by number, or None.
        drive_names: Names of the log's drives.
        learning: What was learnt beside the named effects, and what that is worth.
    """

    log: str
    robot: Robot
    verdict: str
    declared: Mapping[str, Estimate]
    theta: Mapping[str, Estimate]
    effects: tuple[AdoptedEffect, ...]
    immaterial: tuple[AdoptedEffect, ...]
    worth: Mapping[str, Worth]
    polish: Polish | None
    residual_depends_on: tuple[str, ...]
    errors: tuple[HorizonError, ...]
    confirmed: HorizonError | None
    could_not_be_seen: tuple[str, ...]
    manoeuvre: Manoeuvre | None
    parts: Parts
    found: Findings
    clocks: tuple[Clocks, ...]
    unlike: Unlike | None
    drive_names: tuple[str, ...]
    learning: Learning

    @property
    def dropped_values(self) -> dict[str, Estimate]:
        """Values that effects had which do not matter, by name in θ; they are not in the model."""
        return {
            name: Estimate(beside.theta[name], (beside.theta[name],) * 2, self.robot.catalogue.parameters[name].unit)
            for effect, beside, _ in self.found.immaterial
            for name in effect.names
        }

    def at_edge(self, effect: AdoptedEffect) -> tuple[str, ...]:
        """Parameters of an effect, by name in θ, that were fitted to an end of their range which is not neutral.

        The effect then stands for something else.
        """
        fitted = {name for coordinate in effect.free for name in coordinate} or set(effect.names)
        known = [name for name in effect.names if name in fitted and name in self.theta]
        return tuple(name for name in known if at_edge(name, self.theta[name].value, self.robot))

    @property
    def noise(self) -> Noise:
        """Drive and pose noise of the extended model."""
        return self.found.model.noise


def main_error(errors: Sequence[HorizonError]) -> HorizonError:
    """The error at the main horizon, which stands for all."""
    return min(errors, key=lambda error: abs(error.horizon_s - MAIN_S))
