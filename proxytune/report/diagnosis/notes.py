"""What a diagnosis says in sentences: each effect and its worth, what does not matter, what is left, what to drive."""

from proxytune.diagnosis.horizon.windows import Ratio
from proxytune.diagnosis.naming.findings import AdoptedEffect
from proxytune.diagnosis.naming.materiality import Worth
from proxytune.diagnosis.result import Diagnosis
from proxytune.diagnosis.rules import RULES
from proxytune.report.diagnosis.clocks import clocks_notes
from proxytune.report.diagnosis.learnt import learnt_notes
from proxytune.report.diagnosis.likeness import unlike_notes
from proxytune.report.numbers import fixed, listed

MEANINGS = {
    "nothing missing": "what is left over is no more than noise",
    "explained": "named effects explain what the declared model left over",
    "partly explained": "named effects explain a part; more than noise is left that no named effect accounts for",
    "unexplained": "something is missing, and no named effect accounts for it",
    "cannot be told": "the error is larger than the noise of the poses, no structure was found in it, and how far two "
    "drives from the same commands differ is not known",
}


def headline(diagnosis: Diagnosis) -> str:
    """The verdict and what it means."""
    return f"{diagnosis.log}: {diagnosis.verdict}: {MEANINGS[diagnosis.verdict]}"


def notes(diagnosis: Diagnosis) -> list[str]:
    """Everything that tables do not hold, a line each."""
    lines = clocks_notes(diagnosis.log, diagnosis.clocks, diagnosis.theta)
    lines += unlike_notes(diagnosis.unlike, diagnosis.drive_names)
    lines += [_added(diagnosis, effect) for effect in diagnosis.effects]
    lines += [_immaterial(effect, diagnosis) for effect in diagnosis.immaterial]
    lines += _cautions(diagnosis)
    if diagnosis.residual_depends_on:
        lines.append(f"not explained by any named effect; it depends on: {', '.join(diagnosis.residual_depends_on)}")
    lines += learnt_notes(diagnosis.learning)
    if diagnosis.could_not_be_seen:
        lines.append(f"could not have been seen in these drives: {', '.join(diagnosis.could_not_be_seen)}")
    return lines + _next(diagnosis)


def per_cent(one: Ratio) -> tuple[float, tuple[float, float]]:
    """A ratio of errors as what it adds [%], with its interval."""
    value, low, high = (100.0 * (end - 1.0) for end in (one.value, *one.interval))
    return value, (low, high)


def decisive(worth: Worth) -> float:
    """The horizon [s] at which an effect matters most."""
    return max(worth, key=lambda horizon: worth[horizon].value)


def may_matter(worth: Worth) -> bool:
    """Whether these drives leave it open that an effect matters."""
    return any(one.interval[1] >= RULES.material_factor for one in worth.values())


def _added(diagnosis: Diagnosis, effect: AdoptedEffect) -> str:
    rivals = ", ".join(rival.label for rival in effect.rivals)
    beside = f"; these drives cannot tell it from {rivals}" if rivals else ""
    worth = diagnosis.worth.get(effect.effect, {})
    told = [f"{fixed(per_cent(one)[0], 0)} % ({_ends(one, 0)}) at {h:g} s" for h, one in worth.items()]
    larger = f"; without it the error is larger by {listed(told)}" if told else ""
    return f"added {_label(effect)}: {effect.gain:.0f} nats, p = {effect.p_value:.3f}{larger}{beside}"


def _immaterial(effect: AdoptedEffect, diagnosis: Diagnosis) -> str:
    worth = diagnosis.worth.get(effect.effect, {})
    if not worth:
        return f"not shown to matter: {_label(effect)}, {effect.gain:.0f} nats"
    horizon = decisive(worth)
    value, _ = per_cent(worth[horizon])
    kind = "not shown to matter" if may_matter(worth) else "detectable but immaterial"
    change = f"changes the error at {horizon:g} s by {fixed(value, 1)} % ({_ends(worth[horizon], 1)})"
    return f"{kind}: {_label(effect)}{_values(effect, diagnosis)}, {effect.gain:.0f} nats, {change}"


def _values(effect: AdoptedEffect, diagnosis: Diagnosis) -> str:
    """The fitted values of an effect that is no longer in the model."""
    known = {name: estimate for name, estimate in diagnosis.dropped_values.items() if name in effect.names}
    return "".join(f" {estimate.value:.3g} {estimate.unit}".rstrip() for estimate in known.values())


def _label(effect: AdoptedEffect) -> str:
    return f"{effect.effect} ({effect.form})" if effect.form else effect.effect


def _ends(one: Ratio, decimals: int) -> str:
    low, high = per_cent(one)[1]
    return f"{fixed(low, decimals)} to {'+' if high > 0.0 else ''}{fixed(high, decimals)}"


def _cautions(diagnosis: Diagnosis) -> list[str]:
    edges = [name for effect in diagnosis.effects for name in diagnosis.at_edge(effect)]
    lines = [f"beware: {listed(edges)} at the end of what can be: it stands for something else"] if edges else []
    if diagnosis.verdict == "partly explained":
        lines.append("beware: where something is left that has no name, added effects may stand for it: no physics yet")
    worse = [f"{error.horizon_s:g} s" for error in diagnosis.errors if error.ratio.interval[0] > 1.0]
    if worse:
        lines.append(f"beware: positions after {', '.join(worse)} are predicted worse than before; look at the heading")
    if diagnosis.polish is not None:
        told = ", ".join(f"{h:g} s: {one.value:.2f}" for h, one in diagnosis.polish.ratios.items())
        lines.append(
            f"parameters were fitted to windows of {diagnosis.polish.horizon_s:g} s, not to single steps: their error "
            f"by the other's, on blocks left out, {told}"
        )
    return lines


def _next(diagnosis: Diagnosis) -> list[str]:
    found = diagnosis.manoeuvre
    if found is None:
        return []
    often = f"{found.times} times from the same commands, and diagnose the log with these drives in it"
    if found.nats_per_minute is None:
        return [f"to tell noise from what is missing, drive {found.name} {often}: {found.description}"]
    clear = f"({found.nats_per_minute:.0f} nats a minute)"
    lines = [f"to tell {' from '.join(found.between)}, drive {found.name} {clear}: {found.description}"]
    if found.times > 1:
        lines.append(f"to tell noise from what is missing, drive this {often}")
    return lines
