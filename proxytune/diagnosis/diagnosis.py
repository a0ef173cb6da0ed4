"""From a log to a verdict: what the declared model leaves over, which effect explains it, and what that is worth."""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass

import numpy as np

from proxytune.diagnosis.candidates import MOTION_EFFECTS
from proxytune.diagnosis.confirmation import bullet_strays, has_body
from proxytune.diagnosis.drives import Drives, Floats
from proxytune.diagnosis.fitting import Fit, intervals, seen
from proxytune.diagnosis.innovations import Noise
from proxytune.diagnosis.learning import Learning, learn
from proxytune.diagnosis.manoeuvres import Manoeuvre, next_manoeuvre
from proxytune.diagnosis.plausible import check_clocks, check_motion, check_units
from proxytune.diagnosis.search import Adopted, Found, Told, search
from proxytune.diagnosis.split import Parts, split
from proxytune.diagnosis.visibility import unseen
from proxytune.diagnosis.windows import Rmse, Windows, cut, floor, ratio, rmse, strays
from proxytune.driving.robot import Robot
from proxytune.effects import CATALOGUE, DECLARED, PARAMETERS, effect_of, theta_names
from proxytune.errors import LogError
from proxytune.logs import Log
from proxytune.settings import nearest
from proxytune.space import Theta

HORIZONS_S = (1.0, 2.0, 5.0)
"""Horizons at which the error is told."""

FEWEST_BLOCKS = 3
"""No error is told over windows from fewer blocks: it would have no interval."""

CONFIRMED_S = 2.0
"""The horizon at which it is confirmed on the bullet plant."""


@dataclass(frozen=True)
class Estimate:
    """A parameter's fitted value with its 95 % interval."""

    value: float
    interval: tuple[float, float]
    unit: str


@dataclass(frozen=True)
class HorizonError:
    """The error of open-loop prediction over windows of one horizon, on drives that were not fitted.

    Attributes:
        horizon_s: Length of the windows [s].
        windows: How many there are.
        before: Position [m] with declared effects only.
        after: Position [m] with the effects that were found.
        ratio: After by before.
        noise_floor: What a model that is right would have [m].
        heading_before: Heading [rad].
        heading_after: Heading [rad].
        heading_floor: Heading [rad].
    """

    horizon_s: float
    windows: int
    before: Rmse
    after: Rmse
    ratio: Rmse
    noise_floor: float
    heading_before: Rmse
    heading_after: Rmse
    heading_floor: float

    @property
    def removable_left(self) -> float | None:
        """The share of the squared error above the floor that is left, None where nothing was above it."""
        above = self.before.value**2 - self.noise_floor**2
        left = self.after.value**2 - self.noise_floor**2
        return max(0.0, left) / above if above > 0.05 * self.before.value**2 else None


@dataclass(frozen=True)
class Diagnosis:
    """What a log says of a model.

    Attributes:
        log: The log's name.
        robot: The robot.
        verdict: "nothing missing", "explained", "partly explained" or "unexplained".
        declared: Declared parameters, fitted without any other effect, by name in θ.
        theta: All parameters of the extended model, by name in θ.
        effects: The effects that were added.
        residual_depends_on: Signals that explain what no named effect does, those of the learnt remainder first.
        errors: On the planar plant, by horizon, shortest first.
        confirmed: The error over 2 s on the bullet plant, None where the robot has no body for it.
        could_not_be_seen: Effects that these drives could not have shown.
        manoeuvre: What to drive to tell rivals apart, or None.
        parts: The drives that were fitted and tested.
        found: What the search came to.
        learning: What was learnt beside the named effects, and what that is worth.
    """

    log: str
    robot: Robot
    verdict: str
    declared: Mapping[str, Estimate]
    theta: Mapping[str, Estimate]
    effects: tuple[Adopted, ...]
    residual_depends_on: tuple[str, ...]
    errors: tuple[HorizonError, ...]
    confirmed: HorizonError | None
    could_not_be_seen: tuple[str, ...]
    manoeuvre: Manoeuvre | None
    parts: Parts
    found: Found
    learning: Learning

    @property
    def noise(self) -> Noise:
        """Drive and pose noise of the extended model."""
        return self.found.model.noise


def diagnose(
    log: Log,
    robot: Robot,
    declared: Iterable[str],
    *,
    test: Log | None = None,
    seed: int = 1,
    told: Told = lambda _: None,
) -> Diagnosis:
    """Tune what is declared, find what is missing, and test both on drives kept aside.

    Args:
        log: Measured drives.
        robot: The robot that drove.
        declared: Effects whose parameters are tuned in any case.
        test: Another log to test on; without it a part of the drives is kept.
        seed: Of the null distributions.
        told: Hears of progress.

    Raises:
        LogError: If the log cannot bear the question: too short, no motion, two clocks.
        SettingsError: If a declared effect is unknown or does not act on motion.
    """
    names = declared_parameters(declared)
    start = {name: robot.theta.get(name, PARAMETERS[name].neutral_value(robot.figures)) for name in names}
    parts = split(log, robot, test)
    check_motion(log.name, parts.fitted)
    check_units(log.name, parts.fitted, start)
    check_clocks(log.name, parts.fitted, start)
    found = search(parts.fitted, start, names, seed, told)
    told("learning what no named effect explains")
    learning = learn(found, parts.tested, HORIZONS_S)
    told("testing on drives kept aside")
    errors = tuple(error for h in HORIZONS_S if (error := _error(found, parts.tested, h, seed)) is not None)
    if not errors:
        raise LogError(f"{log.name}: no second of unbroken poses to test on; record longer drives")
    return Diagnosis(
        log=log.name,
        robot=robot,
        verdict=_verdict(found, learning),
        declared=estimates(found.declared, ()),
        theta=estimates(found.model, found.adopted),
        effects=found.adopted,
        residual_depends_on=learning.depends_on(curve.group.name for curve in found.remainder),
        errors=errors,
        confirmed=_confirmed(found, parts.tested, seed, told),
        could_not_be_seen=unseen(found.model, set(map(effect_of, names)) | {effect.effect for effect in found.adopted}),
        manoeuvre=next_manoeuvre(found),
        parts=parts,
        found=found,
        learning=learning,
    )


def declared_effects(robot: Robot) -> tuple[str, ...]:
    """The effects that are declared where nobody says: those of θ that act on motion and that the robot has."""
    return tuple(name for name in DECLARED if name in MOTION_EFFECTS and name in robot.theta)


def declared_parameters(effects: Iterable[str]) -> tuple[str, ...]:
    """The names in θ of declared effects' parameters.

    Raises:
        LogError: If an effect is unknown or does not act on motion.
    """
    names: list[str] = []
    for effect in effects:
        if effect not in MOTION_EFFECTS:
            raise LogError(f"--declared {effect}: no effect on motion has this name; {nearest(effect, MOTION_EFFECTS)}")
        names += [name for name in theta_names(CATALOGUE[effect]) if not name.endswith(".imbalance")]
    return tuple(dict.fromkeys(names))


def estimates(fitted: Fit, adopted: Iterable[Adopted]) -> dict[str, Estimate]:
    """Every value of a fitted model with its interval; fixed ones have none to speak of."""
    known = intervals(fitted)
    for effect in adopted:
        if effect.interval is not None:
            known[effect.names[0]] = effect.interval
    return {
        name: Estimate(value, known.get(name, (value, value)), PARAMETERS[name].unit)
        for name, value in fitted.theta.items()
    }


def _verdict(found: Found, learning: Learning) -> str:
    if found.remainder or learning.remainder.used:
        return "partly explained" if found.adopted else "unexplained"
    return "explained" if found.adopted else "nothing missing"


def _confirmed(found: Found, drives: Drives, seed: int, told: Told) -> HorizonError | None:
    if not has_body(drives):
        return None
    told("confirming on the bullet plant")
    return _error(found, drives, CONFIRMED_S, seed, bullet_strays)


Strays = Callable[[Drives, Theta, Windows], Floats]
"""How far a model's poses are from measured ones (M, 2): [m], [rad]."""


def _error(found: Found, drives: Drives, horizon_s: float, seed: int, how: Strays = strays) -> HorizonError | None:
    windows = cut(drives, horizon_s)
    if len(np.unique(drives.block[windows.begin])) < FEWEST_BLOCKS:
        return None
    blocks = drives.block[windows.begin][windows.window]
    before, after = (how(drives, fitted.theta, windows) ** 2 for fitted in (found.declared, found.model))
    place, turn = floor(seen(drives, found.model.theta, (), found.model.noise), windows, seed)
    return HorizonError(
        horizon_s=horizon_s,
        windows=len(windows.begin),
        before=rmse(before[:, 0], blocks),
        after=rmse(after[:, 0], blocks),
        ratio=ratio(after[:, 0], before[:, 0], blocks),
        noise_floor=place,
        heading_before=rmse(before[:, 1], blocks),
        heading_after=rmse(after[:, 1], blocks),
        heading_floor=turn,
    )


def residual_over_time(drives: Drives, theta: Mapping[str, float], horizon_s: float) -> tuple[Floats, Floats]:
    """Distance between predicted and measured pose, and where it was measured.

    Returns:
        Per compared pose (M, 2): episode time [s], distance [m]; and the measured places (M, 2): x, y [m].
    """
    windows = cut(drives, horizon_s)
    distance = strays(drives, dict(theta), windows)[:, 0]
    times = drives.last[windows.increment] / drives.tick_hz
    return np.stack((times, distance), axis=1), drives.poses[windows.increment, 1, :2]
