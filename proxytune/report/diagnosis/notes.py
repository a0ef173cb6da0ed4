"""What a diagnosis says in sentences: each effect and its worth, what does not matter, what is left, what to drive."""

from proxytune.diagnosis import RULES, AdoptedEffect, Diagnosis, EffectSize, Ratio
from proxytune.report.diagnosis.clocks import clocks_notes
from proxytune.report.diagnosis.learnt import learnt_notes
from proxytune.report.diagnosis.likeness import unlike_notes
from proxytune.report.numbers import fixed, listed

MEANINGS = {
    "nothing missing": "only noise is left",
    "explained": "with the effects added, only noise is left",
    "partly explained": "the effects added explain a part; more than noise is left, and no named effect explains it",
    "unexplained": "something is missing, and no named effect explains it",
    "cannot be told": "the error is larger than the noise of the poses but shows no structure; how far two drives "
    "from the same commands differ is not known",
}


AMPLE = 30.0
"""Log-likelihood gain [nats] in a minute above which one minute surely decides."""


def headline(diagnosis: Diagnosis) -> str:
    """The verdict and what it means."""
    return f"{diagnosis.log}: {diagnosis.verdict}: {MEANINGS[diagnosis.verdict]}"


def notes(diagnosis: Diagnosis) -> list[str]:
    """Everything that the tables do not hold, a line each."""
    lines = clocks_notes(diagnosis.log, diagnosis.clocks, diagnosis.theta)
    lines += unlike_notes(diagnosis.robot_clusters, diagnosis.drive_names)
    lines += [_say_added(diagnosis, effect) for effect in diagnosis.effects]
    lines += [_say_immaterial(effect, diagnosis) for effect in diagnosis.negligible]
    lines += _cautions(diagnosis)
    if diagnosis.residual_depends_on:
        lines.append(f"no named effect explains the rest, which depends on: {', '.join(diagnosis.residual_depends_on)}")
    lines += learnt_notes(diagnosis.learning)
    if diagnosis.could_not_be_seen:
        lines.append(f"these drives could not have shown: {', '.join(diagnosis.could_not_be_seen)}")
    return lines + next_drives(diagnosis)


def per_cent(one: Ratio) -> tuple[float, tuple[float, float]]:
    """A ratio of errors as what it adds [%], with its interval."""
    value, low, high = (100.0 * (end - 1.0) for end in (one.value, *one.interval))
    return value, (low, high)


def decisive(worth: EffectSize) -> float:
    """The horizon [s] at which an effect matters most."""
    return max(worth, key=lambda horizon: worth[horizon].value)


def may_matter(worth: EffectSize) -> bool:
    """Whether these drives leave it open that an effect matters."""
    return any(one.interval[1] >= RULES.material_factor for one in worth.values())


def _say_added(diagnosis: Diagnosis, effect: AdoptedEffect) -> str:
    rivals = ", ".join(rival.label for rival in effect.rivals)
    beside = f"; these drives fit {rivals} as well" if rivals else ""
    worth = diagnosis.effect_sizes.get(effect.effect, {})
    growth = [f"{fixed(per_cent(one)[0], 0)} % ({_ends(one, 0)}) at {h:g} s" for h, one in worth.items()]
    larger = f"; without it the error grows by {listed(growth)}" if growth else ""
    return f"added {_label(effect)}: {_gain(effect)}, p = {effect.p_value:.3f}{larger}{beside}"


def _say_immaterial(effect: AdoptedEffect, diagnosis: Diagnosis) -> str:
    worth = diagnosis.effect_sizes.get(effect.effect, {})
    if not worth:
        return f"not shown to matter: {_label(effect)}, {_gain(effect)}"
    horizon = decisive(worth)
    value, _ = per_cent(worth[horizon])
    kind = "not shown to matter" if may_matter(worth) else "detectable but immaterial"
    change = f"changes the error at {horizon:g} s by {fixed(value, 1)} % ({_ends(worth[horizon], 1)})"
    return f"{kind}: {_label(effect)}{_values(effect, diagnosis)}, {_gain(effect)}, {change}"


def _values(effect: AdoptedEffect, diagnosis: Diagnosis) -> str:
    """The fitted values of an effect that is no longer in the model."""
    estimates = {name: estimate for name, estimate in diagnosis.dropped_values.items() if name in effect.names}
    return "".join(f" {estimate.value:.3g} {estimate.unit}".rstrip() for estimate in estimates.values())


def _gain(effect: AdoptedEffect) -> str:
    return f"log-likelihood gain {effect.gain:.0f} nats"


def _label(effect: AdoptedEffect) -> str:
    return f"{effect.effect} ({effect.form})" if effect.form else effect.effect


def _ends(one: Ratio, decimals: int) -> str:
    low, high = per_cent(one)[1]
    return f"{fixed(low, decimals)} to {'+' if high > 0.0 else ''}{fixed(high, decimals)}"


def _cautions(diagnosis: Diagnosis) -> list[str]:
    edges = [name for effect in diagnosis.effects for name in diagnosis.at_edge(effect)]
    lines = [f"beware: {listed(edges)} at the end of the range: it probably stands for something else"] if edges else []
    if diagnosis.verdict == "partly explained":
        lines.append("beware: added effects may stand in for what is still unnamed: their values are no physics yet")
    worse = [f"{error.horizon_s:g} s" for error in diagnosis.errors if error.ratio.interval[0] > 1.0]
    if worse:
        lines.append(f"beware: positions after {', '.join(worse)} are predicted worse than before; check the heading")
    if diagnosis.multistep is not None:
        ratios = ", ".join(f"{h:g} s: {one.value:.2f}" for h, one in diagnosis.multistep.ratios.items())
        lines.append(
            f"parameters were fitted to windows of {diagnosis.multistep.horizon_s:g} s instead of single steps; ratio "
            f"of the errors on blocks left out: {ratios}"
        )
    return lines


def next_drives(diagnosis: Diagnosis) -> list[str]:
    """What to drive next, a line each; nothing where there is nothing to tell apart."""
    next_drive = diagnosis.manoeuvre
    if next_drive is None:
        return []
    often = f"{next_drive.times} times from the same commands, and diagnose the log with these drives in it"
    if next_drive.nats_per_minute is None:
        return [f"to tell noise from what is missing, drive {next_drive.name} {often}: {next_drive.description}"]
    gain = f"expected gain {next_drive.nats_per_minute:.0f} nats a minute"
    clear = "one minute is ample" if next_drive.nats_per_minute >= AMPLE else gain
    drive = f"drive {next_drive.name} ({clear}): {next_drive.description}"
    lines = [f"to tell {' from '.join(next_drive.between)}, {drive}"]
    if next_drive.times > 1:
        lines.append(f"to tell noise from what is missing, drive this {often}")
    return lines
