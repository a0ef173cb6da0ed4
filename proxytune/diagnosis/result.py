"""The result of a diagnosis: everything that a log says of a model."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from proxytune.diagnosis.horizon.polish import Polish
from proxytune.diagnosis.horizon_error import HorizonError
from proxytune.diagnosis.manoeuvres import Manoeuvre
from proxytune.diagnosis.measured.clocks import Clocks
from proxytune.diagnosis.measured.split import Parts
from proxytune.diagnosis.model.coordinates import at_edge
from proxytune.diagnosis.model.innovations import Noise
from proxytune.diagnosis.naming.findings import AdoptedEffect, Findings
from proxytune.diagnosis.naming.likeness import Unlike
from proxytune.diagnosis.naming.materiality import Worth
from proxytune.diagnosis.remainder.learning import Learning
from proxytune.driving.robot import Robot

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
