"""Meaning of effects and parameters in a clause each, and a finding in a sentence: names, sizes, worth.

What an effect does is the first clause of its docstring, a user's own effect's as well.
"""

import inspect
from collections.abc import Iterable, Mapping
from dataclasses import asdict
from typing import Any

from proxytune.diagnosis import Estimate
from proxytune.effects import SHIPPED, Catalogue
from proxytune.errors import ExtensionError
from proxytune.files import package_table
from proxytune.report.wording import digits, fixed, listed, plain, short, span

SHARED_OUT = "the right wheel has {} more of it than both have on average, the left one as much less"
UNEVEN = {
    "dead_band": "width",
    "stiction": "breakaway",
    "saturation": "limit",
    "motor_lag": "time_constant",
    "backlash": "gap",
}
"""Effects that are shared out between the wheels, and what of each is."""
CLAUSES: Mapping[str, str] = package_table("report/templates/clauses.toml") | {
    f"{effect}.imbalance": SHARED_OUT for effect in UNEVEN
}
"""By name in θ: what a value says; {} stands for the value with its unit and interval."""
WORSE = 2.0
"""From here on an error without an effect is told as so many times the one with it."""
MOST_FITTED = 4
"""So many declared parameters are told with their values in the first sentence; the table has all."""
HORIZON = "2"
"""The windows [s] whose error tells what an effect is worth, where there are such."""


def what_it_does(effect: str, catalogue: Catalogue) -> str:
    """What an effect does, in a clause: the first of its docstring; empty where it has none."""
    said = (inspect.getdoc(catalogue.effect(effect)) or "").partition("\n\n")[0].replace("\n", " ").replace("`", "")
    clause = min((said.partition(end)[0] for end in (": ", "; ", ". ")), key=len).rstrip(".")
    return clause[:1].lower() + clause[1:]


def clause_of(name: str, said: str) -> str:
    """What a parameter's value says, by its name in θ; empty for a user's own parameter."""
    return CLAUSES[name].format(said) if name in CLAUSES else ""


def finding(effect: Mapping[str, Any], catalogue: Catalogue = SHIPPED) -> str:
    """An effect that was added, as `diagnose --json` has it, in a clause with its size, and what it is worth."""
    name, known = str(effect["name"]), effect.get("parameters") or {}
    try:
        own = dict(zip((it.name for it in catalogue.effect(name).parameters), catalogue.theta_names(name), strict=True))
    except ExtensionError:
        own = {}
    sized = {key: one for key, one in known.items() if one["value"] is not None}
    # What a form of the effect holds at 0 says nothing.
    sizes = {key: _size(one) for key, one in sized.items() if one["value"] != 0.0 or len(set(one["interval"])) > 1}
    said = {key: _clause(own.get(key, key), sized[key]) or f"{plain(key)} {size}" for key, size in sizes.items()}
    if "imbalance" in said and UNEVEN.get(name) in said:
        del said["imbalance"]
        said[UNEVEN[name]] += _on_each_wheel(name, sized)
    return f"{plain(name)}: {'; '.join([listed(list(said.values())), *_worth(effect)])}" if said else plain(name)


def _clause(name: str, estimate: Mapping[str, Any]) -> str:
    """What a value says, by its name in θ; a factor below 1 is told as 1 − 0.01, not as 1 + −0.01."""
    adds = "1 + {}"
    if adds not in CLAUSES.get(name, "") or estimate["value"] >= 0.0:
        return clause_of(name, _size(estimate))
    ends = [None if end is None else -end for end in reversed(estimate["interval"])]
    less = {**estimate, "value": -estimate["value"], "interval": ends}
    return CLAUSES[name].replace(adds, "1 − {}").format(_size(less))


def _on_each_wheel(effect: str, sized: Mapping[str, Mapping[str, Any]]) -> str:
    """What each wheel has of an effect that is shared out between them."""
    value, share = sized[UNEVEN[effect]]["value"], sized["imbalance"]["value"]
    # A limit takes away what is above it.
    left, right = (
        1.0 - (1.0 - value) * part if effect == "saturation" else value * part for part in (1.0 - share, 1.0 + share)
    )
    return f" on average, {short(left)} on the left wheel and {short(right)} on the right"


def findings(effects: Iterable[Mapping[str, Any]], catalogue: Catalogue = SHIPPED) -> str:
    """All effects that were added, one after another; empty where none was."""
    said = [finding(effect, catalogue) for effect in effects]
    return "; ".join(said) if any(":" in one for one in said) else listed(said)


def fitted(names: Iterable[str], theta: Mapping[str, Estimate]) -> str:
    """Values that were fitted of what was declared, as ", with trim 0.043 (0.042 to 0.044)"; empty where none was."""
    known = [name for name in names if name in theta and not name.endswith(".imbalance")]
    words = {name: name if ":" in name else plain(name).replace(".", " ") for name in known[:MOST_FITTED]}
    said = [f"{word} {_size(asdict(theta[name]))}" for name, word in words.items()]
    said += [f"{len(known) - MOST_FITTED} more"] * (len(known) > MOST_FITTED)
    return f", with {listed(said)}" if said else ""


def _size(estimate: Mapping[str, Any]) -> str:
    """A value with unit and interval; a duty is told as the clause has it."""
    (low, high), unit = estimate["interval"], "" if estimate["unit"] == "duty" else f" {estimate['unit']}".rstrip()
    if low is None or high is None or not low < high:
        return f"{short(estimate['value'])}{unit}"
    # One figure of half its width: of an interval just wider than a power of ten, one of the whole would be all of it.
    places = max(0, digits((low, (low + high) / 2.0)) - 1)
    return f"{fixed(estimate['value'], places)}{unit} ({span((low, high), places)})"


def _worth(effect: Mapping[str, Any]) -> list[str]:
    """What predictions are without it; nothing where that was not measured, or is nothing."""
    worth = {h: one for h, one in (effect.get("worth") or {}).items() if one["interval"][0] > 0.0}
    if not worth:
        return []
    horizon = HORIZON if HORIZON in worth else max(worth, key=lambda h: worth[h]["value"])
    value, (low, high) = worth[horizon]["value"], worth[horizon]["interval"]
    if 1.0 + value / 100.0 < WORSE:
        return [f"without it predictions over {horizon} s are {value:.0f} % worse ({low:.0f} to {high:.0f})"]
    times, least, most = (short(1.0 + one / 100.0, 2) for one in (value, low, high))
    return [f"without it predictions over {horizon} s are {times} times as far off ({least} to {most})"]
