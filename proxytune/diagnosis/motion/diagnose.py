"""The diagnosis of a robot's motion: what its declared model leaves over, the effects that explain it, and their use.

`diagnose` goes through all of it: clocks, fit, forward selection, multistep fit, model discrepancy, and errors on
drives kept aside. Its verdict compares the error of open-loop prediction that is left with the bracket of what a right
model could have: from what the noise of measured poses alone makes, to the lowest error that any model reached.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

from proxytune.arrays import one_thread
from proxytune.diagnosis.answer import RULES, Estimate, Progress, Rules, verdict
from proxytune.diagnosis.motion import effect_size, multistep_fit, prediction
from proxytune.diagnosis.motion.clocks import Clocks, Parts, cut_into_blocks, on_one_clock, split
from proxytune.diagnosis.motion.discrepancy import Learning, learn
from proxytune.diagnosis.motion.drives import Drives, Floats, gather
from proxytune.diagnosis.motion.evidence import AdoptedEffect, Findings, Variant
from proxytune.diagnosis.motion.excitation import LIMITS, Limits, NextDrive, design_drive
from proxytune.diagnosis.motion.fitting import Fit, check_motion, check_units, intervals
from proxytune.diagnosis.motion.innovations import Noise, at_edge
from proxytune.diagnosis.motion.moments import Period, find_period
from proxytune.diagnosis.motion.multistep_fit import has_body
from proxytune.diagnosis.motion.screening import MOTION_EFFECTS, motion_effects
from proxytune.diagnosis.motion.selection import fit_declared, select_effects
from proxytune.diagnosis.stages import Stages, facts_of
from proxytune.driving import Robot
from proxytune.effects import SHIPPED, Catalogue, effect_of
from proxytune.errors import LogError
from proxytune.logs import Log
from proxytune.settings import nearest
from proxytune.space import Theta

CONFIRMED_S = 2.0
"""The horizon at which errors are confirmed on the bullet plant."""
PERIODIC = "time, again and again"
"""What a remainder with a period is said to depend on."""
MAIN_S = 2.0
"""The horizon of the one error that stands for all."""


class Bracket(NamedTuple):
    """The two errors between which that of a right model lies [m]."""

    lower: float  # what the noise of measured poses alone makes
    # what a right model might have by chance where `reached` was the lowest, less what drives repeat of it
    upper: float
    reached: float  # the lowest error that any model reached
    again: prediction.Repeated | None  # what drives from the same commands do not repeat, if there are any

    @property
    def least(self) -> float:
        """The lower end with what repeats leave at least, in the windows that have any [m]."""
        if self.again is None:
            return self.lower
        share = self.again.share
        apart = self.again.apart * share.interval[0] / share.value
        return max(self.lower, float(np.sqrt((1.0 - self.again.part) * self.lower**2 + self.again.part * apart**2)))


def bracket(lower: float, reached: float, again: prediction.Repeated | None, rules: Rules = RULES) -> Bracket:
    """Bracket the error of a right model [m]; the lower end, an estimate too, is never above what a model reached."""
    lower, upper = min(lower, reached), reached
    if again is not None:
        # All of the error is noise in windows that were driven once.
        most = min(reached, again.apart * again.share.interval[1] / again.share.value)
        upper = float(np.sqrt((1.0 - again.part) * reached**2 + again.part * most**2))
    return Bracket(lower, max(lower, rules.lowest_by_chance * upper), reached, again)


def is_explained(after: float, floor: Bracket, *, unnamed: bool, rules: Rules = RULES) -> bool | None:
    """Tell whether the error left [m] is no more than noise; None where it is larger, and shows no structure."""
    if _is_at_floor(after, floor, unnamed, rules):
        return True
    repeats_more = floor.again is not None and floor.again.share.interval[1] < 1.0 / rules.floor_factor
    return False if unnamed or repeats_more else None


def _is_at_floor(after: float, floor: Bracket, unnamed: bool, rules: Rules) -> bool:
    """Tell whether an error is no more than noise: of poses, or of what drives do not repeat, or nothing lowers it."""
    if after <= rules.floor_factor * floor.lower:
        return True
    if unnamed or floor.reached < rules.lowers * after:
        return False
    if floor.again is not None:
        repeated = after <= rules.repeats_alike * floor.again.apart and floor.upper <= rules.known_bracket * floor.least
        return floor.again.share.value >= 1.0 / rules.floor_factor and repeated
    return floor.upper < rules.lowest_by_chance * rules.narrow_bracket * floor.lower


@dataclass(frozen=True)
class HorizonError:
    """The error of open-loop prediction over windows of one horizon, on drives that were not fitted."""

    horizon_s: float  # length of the windows [s]
    windows: int  # how many there are
    before: prediction.Rmse  # position [m] with declared effects only
    after: prediction.Rmse  # position [m] with the effects that were found
    ratio: prediction.Ratio  # after by before
    floor: Bracket  # between which errors a model that is right would be [m]
    heading_before: prediction.Rmse  # heading [rad]
    heading_after: prediction.Rmse  # heading [rad]
    heading_floor: float  # what the noise of measured headings alone makes [rad]

    @property
    def removable_left(self) -> float | None:
        """The share of the squared error above the lower floor that is left, None where nothing was above it."""
        above = self.before.value**2 - self.floor.lower**2
        left = self.after.value**2 - self.floor.lower**2
        return max(0.0, left) / above if above > 0.05 * self.before.value**2 else None


class KeptAside(NamedTuple):
    """The drives kept aside, on which errors are measured, with all of their log, and the noise of their poses."""

    drives: Drives
    whole: Drives
    noise: multistep_fit.PoseNoise


PoseErrors = Callable[[Drives, Theta, prediction.Windows], Floats]
"""Gives the distance of a model's poses from measured ones (M, 2): [m], [rad]."""


def horizon_error(
    found: Findings, tested: KeptAside, horizon_s: float, learnt: Theta, how: PoseErrors = prediction.pose_errors
) -> HorizonError | None:
    """Measure the error at a horizon, None where too few blocks have a window of it.

    The model that was `learnt`, where there is one, may lower what was reached; `how` is a plant's poses.
    """
    drives, rules = tested.drives, tested.drives.rules
    windows = prediction.cut(drives, horizon_s)
    if prediction.count_blocks(drives, windows) < rules.fewest_blocks:
        return None
    blocks = prediction.blocks_of(drives, windows)
    before = how(drives, found.declared.theta, windows) ** 2
    same = found.model.theta == found.declared.theta
    after = before if same else how(drives, found.model.theta, windows) ** 2
    lower, turn = multistep_fit.noise_floor(drives, windows, tested.noise)
    besides = [one.beside.theta for one in found.negligible]
    if learnt:
        besides.append(learnt)
    others = [prediction.pose_errors(drives, theta, windows) ** 2 for theta in besides]
    reached = min(float(np.sqrt(squares[:, 0].mean())) for squares in (before, after, *others))
    return HorizonError(
        horizon_s=horizon_s,
        windows=len(windows.begin),
        before=prediction.rmse(before[:, 0], blocks),
        after=prediction.rmse(after[:, 0], blocks),
        ratio=prediction.ratio_over(drives, windows, after[:, 0], before[:, 0]),
        floor=bracket(lower, reached, prediction.compare_repeats(tested.whole, found.model.theta, horizon_s), rules),
        heading_before=prediction.rmse(before[:, 1], blocks),
        heading_after=prediction.rmse(after[:, 1], blocks),
        heading_floor=turn,
    )


def main_error(errors: Sequence[HorizonError]) -> HorizonError:
    """The error at the main horizon, which stands for all."""
    return min(errors, key=lambda error: abs(error.horizon_s - MAIN_S))


@dataclass(frozen=True)
class Diagnosis:
    """The diagnosis of a model of motion, from one log."""

    log: str  # the log's name
    robot: Robot
    verdict: str  # "nothing missing", "explained", "partly explained", "unexplained" or "cannot be told"
    declared: Mapping[str, Estimate]  # declared parameters, fitted without any other effect, by name in θ
    theta: Mapping[str, Estimate]  # all parameters of the extended model, by name in θ
    effects: tuple[AdoptedEffect, ...]  # the effects that were added, all of which matter for prediction
    # effects that have evidence, and are not shown to matter for prediction: no part of the model
    negligible: tuple[AdoptedEffect, ...]
    # the error without each of both by the error with it, on drives that were not fitted, by name and horizon
    effect_sizes: Mapping[str, effect_size.EffectSize]
    # the fit of the extended model's parameters to windows, None where single steps tell as well
    multistep: multistep_fit.MultistepFit | None
    # signals that explain what no named effect does, those of the learnt discrepancy first
    residual_depends_on: tuple[str, ...]
    errors: tuple[HorizonError, ...]  # on the planar plant, by horizon, shortest first
    confirmed: HorizonError | None  # the error over 2 s on the bullet plant, None where the robot has no body for it
    could_not_be_seen: tuple[str, ...]  # effects that these drives could not have shown
    # what to drive to tell rivals apart, or noise from what is missing; None where nothing is asked
    next_drive: NextDrive | None
    command: str  # kind of the log's commands
    parts: Parts  # the drives that were fitted and tested
    found: Findings  # what the search came to
    clocks: tuple[Clocks, ...]  # those of the log, and of the log to test on where that is another
    # two groups that the drives fall in as if of two robots, by number, or None
    robot_clusters: effect_size.RobotClusters | None
    drive_names: tuple[str, ...]  # names of the log's drives
    learning: Learning  # what was learnt beside the named effects, and what that is worth
    period: Period | None = None  # what slows the robot down again and again, None where nothing does; no model has it

    @property
    def dropped_values(self) -> dict[str, Estimate]:
        """Values that effects had which do not matter, by name in θ; they are not in the model."""
        return {
            name: Estimate(beside.theta[name], (beside.theta[name],) * 2, self.robot.catalogue.parameters[name].unit)
            for effect, beside, _ in self.found.negligible
            for name in effect.names
        }

    def at_edge(self, effect: AdoptedEffect) -> tuple[str, ...]:
        """Names in θ of an effect's values at an end that is not neutral: the effect then stands for something else."""
        return _at_edge({name: one.value for name, one in self.theta.items()}, effect, self.found.model.drives)

    @property
    def edges(self) -> tuple[str, ...]:
        """Such parameters of all that was added."""
        return tuple(name for effect in self.effects for name in self.at_edge(effect))

    @property
    def expected_false_names(self) -> float:
        """The number of effects that chance adds to a model that is right, at most: a share of logs for each look."""
        return (len(self.found.adopted) + len(self.found.negligible) + 1) * self.rules.p_value

    @property
    def rules(self) -> Rules:
        """The rules that it went by."""
        return self.found.model.drives.rules

    @property
    def noise(self) -> Noise:
        """Drive and pose noise of the extended model."""
        return self.found.model.noise


_OnOneClock = tuple[Log, Log | None, tuple[Clocks, ...]]
"""A log and one to test on, if there is one, on one clock, and what their clocks were."""


@one_thread()
def diagnose(
    log: Log,
    robot: Robot,
    declared: Iterable[str],
    *,
    test: Log | None = None,
    seed: int = 1,
    report: Progress = lambda _: None,
    rules: Rules = RULES,
    limits: Limits = LIMITS,
    folder: Path | None = None,
    read: _OnOneClock | None = None,
) -> Diagnosis:
    """Tune what is declared, find what is missing, and test both on drives kept aside, as `diagnose_log` says it.

    Clocks are read by the motion of a robot of first order, and again beside that of the named effects: while fewer
    drives have another clock then, all is done once more with what was `read` so.

    Raises:
        LogError: If the log cannot bear the question (too short, no motion, other units), or a declared effect is
            unknown or does not act on motion.
    """
    declared, given = tuple(declared), (log, test)
    names, parameters = declared_parameters(declared, robot.catalogue), robot.catalogue.parameters
    start = {name: robot.theta.get(name, parameters[name].neutral_value(robot.figures)) for name in names}
    log, test, clocks = read or _on_one_clock(*given, robot)
    # An offset of clocks and a delay are one number: where an offset is taken out, the delay is fitted in any case.
    if any(one.offset.value for one in clocks) and "delay" not in names:
        names, start = (*names, "delay"), {**start, "delay": clocks[0].assumed_delay_s}
    parts = Parts(*(replace(drives, rules=rules) for drives in split(log, robot, test)))
    check_motion(log.name, parts.fitted)
    check_units(log.name, parts.fitted, start)
    whole = replace(gather(test or log, robot, (test or log).episodes), rules=rules)
    logs = [one and replace(one, frames=None) for one in (log, test)]
    facts = facts_of(robot, logs, names, seed, rules, limits) if folder else ""
    known = {"robot": robot, "rules": rules, "fitted": parts.fitted, "tested": parts.tested, "whole": whole}
    keep = Stages(folder, facts, report, **known).keep
    report("fitting what is declared")
    declared_alone = keep("declared", lambda: fit_declared(parts.fitted, start, names))
    selected = keep("selected", lambda: select_effects(declared_alone, seed, report))
    if any(one.odd or one.drift.value for one in clocks):
        again = _on_one_clock(*given, robot, selected.model.theta)
        # A model that was fitted to drives on wrong clocks may still move as if others were.
        if _count_odd(again[2]) < _count_odd(clocks):
            report("clocks are read again beside this model, which moves as if they jumped or drifted")
            return diagnose(
                given[0],
                robot,
                declared,
                test=given[1],
                seed=seed,
                report=report,
                rules=rules,
                limits=limits,
                folder=folder,
                read=again,
            )
    named = keep("worth", lambda: effect_size.drop_negligible(selected, seed, parts.tested))
    report("fitting to windows of prediction")
    declared_fit, before = keep("declared_windows", lambda: multistep_fit.fit_multistep(named.declared))
    # Before and after are compared on equal terms.
    model, after = declared_fit, before
    if named.adopted or named.negligible:
        model, after = keep("windows", lambda: multistep_fit.fit_multistep(named.model))
    found = replace(named, declared=declared_fit, model=model)
    report("learning what no named effect explains")
    learning = keep("learnt", lambda: learn(found, parts.tested, multistep_fit.HORIZONS_S))
    report("testing on drives kept aside")
    tested = KeptAside(parts.tested, whole, multistep_fit.pose_noise(parts.tested, found.model.theta))
    asked = multistep_fit.HORIZONS_S
    told = [keep(f"error_{h:g}", lambda h=h: horizon_error(found, tested, h, learning.model)) for h in asked]  # type: ignore[misc]
    errors = tuple(error for error in told if error is not None)
    if not errors:
        raise LogError(f"{log.name}: no second of unbroken poses to test on; record longer drives")
    period = find_period(parts.fitted, found.model.theta)
    main = main_error(errors)
    unnamed = bool(found.unnamed_curves) or learning.discrepancy.used or period is not None
    explained = is_explained(main.after.value, main.floor, unnamed=unnamed, rules=rules)
    # A value at an end of its range is no explanation, however small the error.
    model = found.model
    explained = explained and not any(_at_edge(model.theta, effect, model.drives) for effect in found.adopted)
    confirmed = None
    if has_body(parts.tested):
        report("confirming on the bullet plant")
        on_bullet = multistep_fit.bullet_pose_errors
        confirmed = keep("bullet", lambda: horizon_error(found, tested, CONFIRMED_S, {}, on_bullet))
    every = whole if test is None else replace(gather(log, robot, log.episodes), rules=rules)
    dropped = tuple(one.effect for one in found.negligible)
    beside = Variant(found.model.theta, found.model.free)
    sizes = effect_size.measure_effect_sizes(found.model, parts.tested, beside, found.adopted, seed)
    for effect, model_with, _ in found.negligible:
        sizes += effect_size.measure_effect_sizes(found.model, parts.tested, model_with, [effect], seed)
    report("designing the next drive")
    seen = {effect_of(name) for name in names} | {effect.effect for effect in (*found.adopted, *dropped)}
    unseen = effect_size.invisible_effects(found.model, seen)
    return Diagnosis(
        log=log.name,
        robot=robot,
        verdict=verdict(explained, named=bool(found.adopted)),
        declared=estimates(found.declared, (), before),
        theta=estimates(found.model, found.adopted, after),
        effects=found.adopted,
        negligible=dropped,
        effect_sizes={effect.effect: size for effect, size in zip((*found.adopted, *dropped), sizes, strict=True)},
        multistep=after,
        residual_depends_on=learning.depends_on(
            [*([PERIODIC] if period else []), *(curve.group.name for curve in found.unnamed_curves)]
        ),
        errors=errors,
        confirmed=confirmed,
        could_not_be_seen=unseen,
        next_drive=keep(
            "next", lambda: design_drive(found, again=explained is None, limits=limits, unseen=unseen, seed=seed)
        ),
        command=log.command,
        parts=parts,
        found=found,
        clocks=clocks,
        robot_clusters=effect_size.find_robot_clusters(cut_into_blocks(every), found.model),
        drive_names=tuple(episode.name for episode in log.episodes),
        learning=learning,
        period=period,
    )


def _on_one_clock(log: Log, test: Log | None, robot: Robot, model: Theta | None = None) -> _OnOneClock:
    log, own = on_one_clock(log, robot, model=model)
    if test is None:
        return log, None, (own,)
    test, other = on_one_clock(test, robot, own, model)
    return log, test, (own, other)


def _count_odd(clocks: Iterable[Clocks]) -> int:
    """The number of drives with another clock than the rest, and of logs whose clocks drift apart."""
    return sum(len(one.odd) + bool(one.drift.value) for one in clocks)


def _at_edge(theta: Theta, effect: AdoptedEffect, drives: Drives) -> tuple[str, ...]:
    fitted = {name for coordinate in effect.free for name in coordinate} or set(effect.names)
    known = (name for name in effect.names if name in fitted and name in theta)
    return tuple(name for name in known if at_edge(name, theta[name], drives))


def declared_effects(robot: Robot) -> tuple[str, ...]:
    """The effects that are declared by default: those of θ that act on motion and that the robot has."""
    return tuple(name for name in robot.catalogue.declared if name in MOTION_EFFECTS and name in robot.theta)


def declared_parameters(effects: Iterable[str], catalogue: Catalogue = SHIPPED) -> tuple[str, ...]:
    """List the names in θ of declared effects' parameters; refuse those unknown, or not on motion."""
    names: list[str] = []
    for effect in effects:
        known = motion_effects(catalogue)
        if effect not in known:
            untraced = effect in catalogue.names and effect not in catalogue.shipped
            lacks = "has no trace, by which a log would show it" if untraced else "no effect on motion has this name"
            raise LogError(f"--declared {effect}: {lacks}; {'give it one' if untraced else nearest(effect, known)}")
        names += [name for name in catalogue.theta_names(effect) if not name.endswith(".imbalance")]
    return tuple(dict.fromkeys(names))


def estimates(
    fitted: Fit, adopted: Iterable[AdoptedEffect], multistep: multistep_fit.MultistepFit | None
) -> dict[str, Estimate]:
    """Give the values of a fitted model with their intervals; the interval of a fixed value has no width."""
    parameters = fitted.drives.robot.catalogue.parameters
    known = intervals(fitted) | (dict(multistep.intervals) if multistep else {})
    for effect in adopted:
        if effect.interval is not None:
            known[effect.names[0]] = effect.interval
    return {
        name: Estimate(value, known.get(name, (value, value)), parameters[name].unit)
        for name, value in fitted.theta.items()
    }
