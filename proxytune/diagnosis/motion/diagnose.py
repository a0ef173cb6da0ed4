"""From a log to a verdict: what the declared model leaves over, which effect explains it, and what that is worth."""

from collections.abc import Iterable
from dataclasses import replace

from proxytune.diagnosis.answer import Diagnosis, Estimate, HorizonError, KeptAside, horizon_error, main_error, verdict
from proxytune.diagnosis.motion.clocks import Parts, all_drives, cut_into_blocks, cut_out_long_rests, read_clocks, split
from proxytune.diagnosis.motion.discrepancy_match import Learning, learn
from proxytune.diagnosis.motion.effect_size import Worth, invisible_effects, two_robots, worth
from proxytune.diagnosis.motion.evidence import AdoptedEffect, DroppedEffect, Findings, Variant
from proxytune.diagnosis.motion.fitting import Fit, check_motion, check_units, intervals
from proxytune.diagnosis.motion.manoeuvres import next_manoeuvre
from proxytune.diagnosis.motion.multistep_fit import (
    HORIZONS_S,
    Polish,
    bullet_pose_errors,
    has_body,
    polish_fit,
    pose_noise,
)
from proxytune.diagnosis.motion.screening import MOTION_EFFECTS, motion_effects
from proxytune.diagnosis.motion.selection import Report, fit_declared, name_effects
from proxytune.driving import Robot
from proxytune.effects import DECLARED, SHIPPED, Catalogue, effect_of
from proxytune.errors import LogError
from proxytune.logs import Log
from proxytune.settings import nearest

CONFIRMED_S = 2.0
"""The horizon at which errors are confirmed on the bullet plant."""


def diagnose(
    log: Log,
    robot: Robot,
    declared: Iterable[str],
    *,
    test: Log | None = None,
    seed: int = 1,
    report: Report = lambda _: None,
) -> Diagnosis:
    """Tune what is declared, find what is missing, and test both on drives kept aside.

    Args:
        log: Measured drives.
        robot: The robot that drove.
        declared: Effects whose parameters are tuned in any case.
        test: Another log to test on; without it a part of the drives is kept.
        seed: Of the null distributions.
        report: Takes a line about each step, as it begins.

    Raises:
        LogError: If the log cannot bear the question: too short, no motion, other units.
        SettingsError: If a declared effect is unknown or does not act on motion.
    """
    names, parameters = declared_parameters(declared, robot.catalogue), robot.catalogue.parameters
    start = {name: robot.theta.get(name, parameters[name].neutral_value(robot.figures)) for name in names}
    log, test = cut_out_long_rests(log), cut_out_long_rests(test) if test is not None else None
    own = read_clocks(log, robot)
    clocks = (own,) if test is None else (own, read_clocks(test, robot, own))
    # An offset of clocks and a delay are one number: where an offset is taken out, the delay is fitted in any case.
    if any(one.offset.value for one in clocks) and "delay" not in names:
        names, start = (*names, "delay"), {**start, "delay": own.assumed_delay_s}
    parts = split(log, robot, test, clocks)
    check_motion(log.name, parts.fitted)
    check_units(log.name, parts.fitted, start)
    report("fitting what is declared")
    found = name_effects(fit_declared(parts.fitted, start, names), seed, report)
    report("fitting to windows of prediction")
    found, polishes = _polish_models(found)
    report("learning what no named effect explains")
    learning = learn(found, parts.tested, HORIZONS_S)
    report("testing on drives kept aside")
    whole = all_drives(test or log, robot, clocks[-1])
    tested = KeptAside(parts.tested, whole, pose_noise(parts.tested, found.model.theta))
    errors = tuple(error for h in HORIZONS_S if (error := horizon_error(found, tested, h, learning.theta)) is not None)
    if not errors:
        raise LogError(f"{log.name}: no second of unbroken poses to test on; record longer drives")
    answer = _give_verdict(found, learning, main_error(errors))
    return Diagnosis(
        log=log.name,
        robot=robot,
        verdict=answer,
        declared=estimates(found.declared, (), polishes[0]),
        theta=estimates(found.model, found.adopted, polishes[1]),
        effects=found.adopted,
        immaterial=tuple(dropped.effect for dropped in found.immaterial),
        worth=_weigh_effects(found, parts, seed),
        polish=polishes[1],
        residual_depends_on=learning.depends_on(curve.group.name for curve in found.remainder),
        errors=errors,
        confirmed=_confirm_on_bullet(found, tested, report),
        could_not_be_seen=_list_invisible(found, names),
        manoeuvre=next_manoeuvre(found, again=answer == "cannot be told"),
        parts=parts,
        found=found,
        clocks=clocks,
        unlike=two_robots(cut_into_blocks(whole if test is None else all_drives(log, robot, own)), found.model),
        drive_names=tuple(episode.name for episode in log.episodes),
        learning=learning,
    )


def declared_effects(robot: Robot) -> tuple[str, ...]:
    """The effects that are declared by default: those of θ that act on motion and that the robot has."""
    return tuple(name for name in DECLARED if name in MOTION_EFFECTS and name in robot.theta)


def declared_parameters(effects: Iterable[str], catalogue: Catalogue = SHIPPED) -> tuple[str, ...]:
    """The names in θ of declared effects' parameters.

    Raises:
        LogError: If an effect is unknown or does not act on motion.
    """
    names: list[str] = []
    for effect in effects:
        known = motion_effects(catalogue)
        if effect not in known:
            raise LogError(f"--declared {effect}: no effect on motion has this name; {nearest(effect, known)}")
        names += [name for name in catalogue.theta_names(effect) if not name.endswith(".imbalance")]
    return tuple(dict.fromkeys(names))


def estimates(fitted: Fit, adopted: Iterable[AdoptedEffect], polish: Polish | None) -> dict[str, Estimate]:
    """The values of a fitted model with their intervals; the interval of a fixed value has no width."""
    parameters = fitted.drives.robot.catalogue.parameters
    known = intervals(fitted) | (dict(polish.intervals) if polish else {})
    for effect in adopted:
        if effect.interval is not None:
            known[effect.names[0]] = effect.interval
    return {
        name: Estimate(value, known.get(name, (value, value)), parameters[name].unit)
        for name, value in fitted.theta.items()
    }


def _polish_models(found: Findings) -> tuple[Findings, tuple[Polish | None, Polish | None]]:
    """Fit both models to windows, where that helps: before and after are compared on equal terms."""
    declared, before = polish_fit(found.declared)
    if not found.adopted and not found.immaterial:
        return replace(found, declared=declared, model=declared), (before, before)
    model, after = polish_fit(found.model)
    return replace(found, declared=declared, model=model), (before, after)


def _list_invisible(found: Findings, declared: Iterable[str]) -> tuple[str, ...]:
    seen = {effect.effect for effect in (*found.adopted, *(dropped.effect for dropped in found.immaterial))}
    return invisible_effects(found.model, set(map(effect_of, declared)) | seen)


def _give_verdict(found: Findings, learning: Learning, error: HorizonError) -> str:
    unnamed = bool(found.remainder) or learning.remainder.used
    return verdict(error.after.value, error.floor, named=bool(found.adopted), unnamed=unnamed)


def _confirm_on_bullet(found: Findings, tested: KeptAside, report: Report) -> HorizonError | None:
    if not has_body(tested.drives):
        return None
    report("confirming on the bullet plant")
    return horizon_error(found, tested, CONFIRMED_S, {}, bullet_pose_errors)


def _weigh_effects(found: Findings, parts: Parts, seed: int) -> dict[str, Worth]:
    """Weigh every effect on the drives kept aside, the dropped ones too."""
    model = Variant(found.model.theta, found.model.free)
    weighed = [DroppedEffect(effect, model) for effect in found.adopted] + list(found.immaterial)
    return {effect.effect: worth(parts.fitted, parts.tested, beside, effect, seed) for effect, beside, _ in weighed}
