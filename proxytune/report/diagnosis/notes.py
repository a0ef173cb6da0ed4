"""Sentences of a diagnosis of motion: each effect and its worth, what is left, clocks, what to drive next."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from proxytune.diagnosis import (
    RANDOM_EFFECTS,
    AdoptedEffect,
    Clocks,
    Diagnosis,
    EffectSize,
    Learning,
    Offset,
    Ratio,
    RobotClusters,
)
from proxytune.effects import PLACE, is_learnt, learnt_effect
from proxytune.files import package_table
from proxytune.report.wording import fixed, listed, percent
from proxytune.space import Theta

VERDICTS: Mapping[str, Mapping[str, str]] = package_table("report/templates/verdicts.toml")
"""What each verdict means, of motion and of the camera, and the next step."""
AMPLE = 30.0
"""Log-likelihood gain [nats] in a minute above which one minute surely decides."""


def motion_headline(diagnosis: Diagnosis, found: str = "", beside: str = "") -> str:
    """What was found and fitted, in the words of `meanings`, then the verdict and what it means."""
    said = say_verdict(found, beside, diagnosis.verdict, "motion", diagnosis.edges)
    sure = f" (expected false names: at most {diagnosis.expected_false_names:.2f})" if diagnosis.effects else ""
    return f"{diagnosis.log}: {said}{sure}"


def say_verdict(found: str, beside: str, verdict: str, part: str, at_ends: Sequence[str]) -> str:
    """A verdict and what it means, after what was found, if anything was, and beside it what was fitted."""
    head = f"{found}{beside}. {verdict.capitalize()}" if found else f"{verdict}{beside}"
    meaning = VERDICTS[verdict][part]
    if not at_ends:
        return f"{head}: {meaning}"
    # A value at the end of all that is possible explains nothing.
    rest = "" if verdict == "partly explained" else f"; {meaning}"
    stand = f"{listed(at_ends)} at the end of the range {'stands' if len(at_ends) == 1 else 'stand'}"
    return f"{head}: {stand} for something else, which no named effect explains{rest}"


def motion_notes(diagnosis: Diagnosis) -> list[str]:
    """Everything that the tables do not hold, a line each."""
    lines = clocks_notes(diagnosis.log, diagnosis.clocks, diagnosis.theta)
    draws = any(effect.effect in RANDOM_EFFECTS for effect in diagnosis.effects)
    if any(clocks.odd for clocks in diagnosis.clocks) and (draws or diagnosis.verdict != "explained"):
        cause = "chance in when commands act" if draws else "what no effect explains"
        lines.append(f"beware: {cause} can look like clocks of single drives; check how these were set")
    lines += unlike_notes(diagnosis.robot_clusters, diagnosis.drive_names)
    lines += [_say_added(diagnosis, effect) for effect in diagnosis.effects]
    lines += moves_from(diagnosis)
    lines += [_say_immaterial(effect, diagnosis) for effect in diagnosis.negligible]
    if diagnosis.verdict == "partly explained":
        lines.append("beware: added effects may stand in for what is still unnamed: their values are no physics yet")
    if worse := [f"{error.horizon_s:g} s" for error in diagnosis.errors if error.ratio.interval[0] > 1.0]:
        lines.append(f"beware: positions after {', '.join(worse)} are predicted worse than before; check the heading")
    if diagnosis.multistep is not None:
        ratios = ", ".join(f"{h:g} s: {one.value:.2f}" for h, one in diagnosis.multistep.ratios.items())
        fitted = f"parameters were fitted to windows of {diagnosis.multistep.horizon_s:g} s instead of single steps"
        lines.append(f"{fitted}; ratio of the errors on blocks left out: {ratios}")
    if rest := ", ".join(diagnosis.residual_depends_on):
        calm = diagnosis.verdict in ("explained", "nothing missing")
        left, so = ("what little is left", "; the values found may stand in for it") if calm else ("the rest", "")
        lines.append(f"no named effect explains {left}, which depends on: {rest}{so}")
    if diagnosis.period is not None:
        behind = f"the robot falls behind {diagnosis.period}; a new drive does not tell when, so no model has it"
        lines.append(f"{behind}: look for what cuts the motors' power, or holds up their commands, so often")
    lines += learnt_notes(diagnosis.learning)
    if diagnosis.could_not_be_seen:
        lines.append(f"these drives could not have shown: {', '.join(diagnosis.could_not_be_seen)}")
    return lines + next_drives(diagnosis)


def moves_from(diagnosis: Diagnosis) -> list[str]:
    """Say which throttle keeps a car at rest where that is its friction's doing: a dead band looks much the same."""
    theta = diagnosis.theta
    inertia, friction = (theta.get(f"rolling.{name}") for name in ("inertia", "friction"))
    if inertia is None or friction is None or not inertia.value * friction.value > 0.0 or "dead_band" in theta:
        return []
    least = inertia.value * friction.value / diagnosis.robot.figures["full_speed"]
    rests = f"with this rolling a throttle up to {least:.2g} moves nothing"
    apart = "to tell them apart, drive fast, then let the car roll without throttle"
    return [f"{rests}: a dead band of as much looks nearly the same; {apart}"]


def per_cent(one: Ratio) -> tuple[float, tuple[float, float]]:
    """A ratio of errors as what it adds [%], with its interval."""
    value, low, high = (100.0 * (end - 1.0) for end in (one.value, *one.interval))
    return value, (low, high)


def decisive(worth: EffectSize) -> float:
    """The horizon [s] at which an effect matters most."""
    return max(worth, key=lambda horizon: worth[horizon].value)


def may_matter(worth: EffectSize, factor: float) -> bool:
    """True if these drives leave it open that the error grows by the factor from which an effect matters."""
    return any(one.interval[1] >= factor for one in worth.values())


def _say_added(diagnosis: Diagnosis, effect: AdoptedEffect) -> str:
    rivals = ", ".join(rival.label for rival in effect.rivals)
    beside = f"; these drives fit {rivals} as well" if rivals else ""
    worth = diagnosis.effect_sizes.get(effect.effect, {})
    growth = [f"{fixed(per_cent(one)[0], 0)} % ({_ends(one, 0)}) at {h:g} s" for h, one in worth.items()]
    larger = f"; without it the error grows by {listed(growth)}" if growth else ""
    gain = f"log-likelihood gain {effect.gain:.0f} nats"
    return f"added {_label(effect)}: {gain}, p = {effect.p_value:.3f}{larger}{beside}"


def _say_immaterial(effect: AdoptedEffect, diagnosis: Diagnosis) -> str:
    worth, gain = diagnosis.effect_sizes.get(effect.effect, {}), f"log-likelihood gain {effect.gain:.0f} nats"
    if not worth:
        return f"not shown to matter: {_label(effect)}, {gain}"
    horizon = decisive(worth)
    value, _ = per_cent(worth[horizon])
    kind = "not shown to matter" if may_matter(worth, diagnosis.rules.material_factor) else "detectable but immaterial"
    if worth[horizon].interval[0] > 1.0:
        kind = "left out, for it is not shown to matter on the drives that were fitted, if on those kept aside"
    dropped = (one for name, one in diagnosis.dropped_values.items() if name in effect.names)
    values = "".join(f" {one.value:.3g} {one.unit}".rstrip() for one in dropped)
    change = f"changes the error at {horizon:g} s by {fixed(value, 1)} % ({_ends(worth[horizon], 1)})"
    return f"{kind}: {_label(effect)}{values}, {gain}, {change}"


def _label(effect: AdoptedEffect) -> str:
    return f"{effect.effect} ({effect.form})" if effect.form else effect.effect


def _ends(one: Ratio, decimals: int) -> str:
    low, high = per_cent(one)[1]
    return f"{fixed(low, decimals)} to {'+' if low < 0.0 < high else ''}{fixed(high, decimals)}"


def next_drives(diagnosis: Diagnosis) -> list[str]:
    """Say what to drive next, a line each; nothing where there is nothing to tell apart."""
    if (drive := diagnosis.next_drive) is None:
        return []
    often = f"{drive.times} times from the same commands, and diagnose the log with these drives in it"
    if drive.between[0] == "noise":
        return [f"to tell {' from '.join(drive.between)}, drive {drive.name} {often}: {drive.description}"]
    gain = f"expected gain {drive.nats_per_minute:.0f} nats a minute"
    clear = "one minute is ample" if drive.nats_per_minute >= AMPLE else gain
    lines = [f"to tell {' from '.join(drive.between)}, drive {drive.name} {often} ({clear}): {drive.description}"]
    if diagnosis.verdict == "cannot be told":
        lines.append("the same drives tell noise from what is missing")
    return lines


def clocks_notes(log: str, clocks: Sequence[Clocks], theta: Mapping[str, Any]) -> list[str]:
    """Say what is wrong with the clocks and what to do; where a delay was fitted, that an offset looks the same."""
    notes = [f"clocks of {log}: {note}" for own in clocks for note in _say_clocks(own)]
    declared = next((own.declared_s for own in clocks), None)
    if declared is not None:
        later = f"poses of {log} are stamped {declared:.3g} s later than commands, as it declares"
        notes.append(f"{later}; that was taken out")
    elif "delay" in theta:
        same = "delay and an offset between the clocks of commands and poses are one number"
        moved = any(own.offset.value for own in clocks)
        known = "is the robot's only if one clock stamped both"
        lost = "cannot be told here, as an offset was taken out: set both to one clock to know it"
        notes.append(f"{same}: the robot's own delay {lost}" if moved else f"{same}: the delay {known}")
    return notes


def _say_clocks(clocks: Clocks) -> Iterator[str]:
    """Say what is wrong with all clocks, with those of single drives, and within a drive."""
    latency, offset, assumed = clocks.latency, clocks.offset, clocks.assumed_delay_s
    if offset.value:
        side = "before its command, which no robot does" if latency.value < 0.0 else "after its command"
        lag = f"motion comes {abs(latency.value):.2f} s {side}"
        early = "early" if offset.value < 0.0 else "late"
        stamped = f"poses are stamped {abs(offset.value):.2f} s too {early} ({_ends_s(offset)})"
        corrected = "this was corrected. Stamp both with one clock, or move the poses yourself"
        yield f"{lag}; {stamped} if the robot's delay is {assumed:.2f} s; {corrected}"
    if clocks.drift.value:
        low, high = sorted(1e2 * abs(end) for end in clocks.drift.interval)
        runs = f"{1e2 * abs(clocks.drift.value):.2g} % ({low:.2g} to {high:.2g})"
        way = f"{'faster' if clocks.drift.value > 0.0 else 'slower'} than that of the commands"
        corrected = "this was corrected. Stamp both with one clock, or synchronise them"
        yield f"the poses' clock runs {runs} {way}; {corrected}"
    for name, one in clocks.drives.items():
        stamped = f"{abs(one.value):.2f} s {'earlier' if one.value < 0.0 else 'later'} ({_ends_s(one)})"
        others = f"in drive {name} poses are stamped {stamped} than in the others"
        yield f"{others}; this was corrected. Check how its clocks were set"
    for drive, time_s, by_s in clocks.jumps:
        stamped = f"poses are stamped {abs(by_s):.2f} s {'earlier' if by_s < 0.0 else 'later'} from then on"
        used = "only the longest stretch without a jump was used. Keep clocks from being set during a drive"
        yield f"in drive {drive} the clock jumps at about {time_s:.0f} s: {stamped}; {used}"


def _ends_s(offset: Offset) -> str:
    return f"{abs(offset.interval[0]):.2f} to {abs(offset.interval[1]):.2f}"


def unlike_notes(unlike: RobotClusters | None, names: Sequence[str]) -> list[str]:
    """One sentence that names the groups and says what to do."""
    if unlike is None:
        return []
    parts = [
        f"{gain:.2f} in {', '.join(names[number] for number in group)}"
        for gain, group in zip(unlike.gains, unlike.groups, strict=True)
    ]
    disagree = f"drives disagree: the {unlike.wheel} wheel's gain is {' but '.join(parts)}, as if of two robots"
    both = "no result here holds for both: diagnose each group alone, or find what changed"
    return [f"{disagree}, or of one on two floors; {both}"]


LEAST_SHARE = 0.05
"""A map of the floor is told in words where the speed on one side of a line differs by this share."""


def _say_map(theta: Theta) -> list[str]:
    """Say on which side of a line along x or y a learnt map slows the robot down or speeds it up."""
    mapped = (PLACE, "x", "y")
    effect = learnt_effect(theta) if any(f".{group}.forward@" in name for name in theta for group in mapped) else None
    along = [
        (axis, places, np.array(curve.weights))
        for curve in (effect.curves if effect else ())
        if curve.group in mapped and curve.channel == "forward"
        for axis, places in zip(
            "xy" if curve.group == PLACE else curve.group,
            np.reshape(curve.knots, (len(curve.knots), -1)).T,
            strict=True,
        )
    ]
    found = [(0.0, "")]
    for axis, places, weights in along:
        lines = np.unique(places)
        for line in (lines[1:] + lines[:-1]) / 2.0:
            for above in (True, False):
                side = (places > line) == above
                here, there = float(weights[side].mean()), float(weights[~side].mean())
                if abs(here) >= max(LEAST_SHARE, abs(there)):
                    kind = "slower" if here < 0.0 else "faster"
                    words = f"{kind} by {percent(abs(here))} where {axis} {'>' if above else '<'} {line:.2g} m"
                    found.append((abs(here - there) * float(np.sqrt(side.mean() * (1.0 - side.mean()))), words))
    words = max(found)[1]
    return [f"as that map has it, the robot is {words}"] if words else []


SAID_OF = {"held": "from {:g} s after either last changed", "turned": "until {:g} s after it turned round"}
"""When a share of commands is added, by the group of the curve that adds it."""


def _say_commands(theta: Theta) -> list[str]:
    """Say when commands count more or less, where a learnt curve has it."""
    lines = []
    for group, when in SAID_OF.items():
        start = f"learnt.{group}.duty@"
        weights = {float(name.removeprefix(start)): value for name, value in theta.items() if name.startswith(start)}
        share = sum(weights.values())
        if abs(share) >= LEAST_SHARE:
            most = max(weights, key=lambda knot: abs(weights[knot]))
            much = f"{percent(abs(share))} {'less' if share < 0.0 else 'more'}"
            lines.append(f"as that curve has it, a command counts {much} {when.format(most)}")
    return lines


def learnt_notes(learning: Learning) -> list[str]:
    """Say what was learnt; nothing where nothing was."""
    beside = learning.discrepancy
    notes = []
    curves = ", ".join(f"{title} ({percent(beside.share[title])})" for title in beside.share)
    if beside.used:
        worth = "; ".join(
            f"{error.horizon_s:g} s: {1e3 * error.after.value:.1f} mm, {error.ratio.value:.2f} "
            f"({error.ratio.interval[0]:.2f} … {error.ratio.interval[1]:.2f}) of that with names alone"
            for error in learning.errors
        )
        notes.append(f"learnt, not physics: curves over {curves}; position error with them at {worth}")
        own = ", ".join(f"{name} {value:.3g}" for name, value in learning.theta.items() if not is_learnt(name))
        notes += [f"model.toml has what was fitted along with the curves: {own}"] if own else []
        notes += _say_map(learning.theta) + _say_commands(learning.theta)
    elif beside.theta:
        notes.append(f"curves over {curves} were tried and dropped: they do not clearly help on drives left out")
    if learning.looks_like is not None:
        like = learning.looks_like
        values = ", ".join(f"{name} {value:.3g}" for name, value in like.theta.items())
        notes.append(f"the curves look like {like.effect} ({values}), which alone keeps {percent(like.share)} of it")
    if learning.names_doubtful:
        better = "beware: curves beside the declared model predict better than beside the named effects"
        notes.append(f"{better}: the names are likely wrong, and the model with curves is without them")
    return notes
