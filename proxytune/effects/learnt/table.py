"""A learnt effect as named values of θ, and as the `[effects.learnt.GROUP]` tables of a model.toml."""

import math
from collections.abc import Callable, Mapping

from proxytune.effects.learnt.bases import Knot, Knots
from proxytune.effects.learnt.effect import Curve, Learnt, Seen
from proxytune.effects.learnt.features import GROUPS, Group
from proxytune.errors import SettingsError
from proxytune.settings import Section, nearest
from proxytune.space import Theta

RANGE = "range"
"""The table of what the fit saw, beside those of the groups."""

LARGEST = 100.0
"""No weight is larger: a curve that adds 100 m/s is a slip of the pen."""

LABEL = "learnt from drives: not physics, and of no use beyond what they visited"


def is_learnt(name: str) -> bool:
    """Whether a name of θ belongs to the learnt effect."""
    return name.startswith(f"{Learnt.name}.")


def learnt_theta(effect: Learnt) -> dict[str, float]:
    """The values of a learnt effect by their names in θ: `learnt.GROUP.CHANNEL@KNOT`."""
    theta = {}
    for channel, bounds in zip(Seen._fields, effect.seen, strict=True):
        for end, value in zip(("low", "high"), bounds, strict=True):
            theta[f"{Learnt.name}.{RANGE}.{channel}@{end}"] = float(value)
    for curve in effect.curves:
        for knot, weight in zip(curve.knots, curve.weights, strict=True):
            theta[f"{Learnt.name}.{curve.group}.{curve.channel}@{_text(knot)}"] = float(weight)
    return theta


def learnt_effect(theta: Theta) -> Learnt | None:
    """The learnt effect that θ names, or None.

    Raises:
        SettingsError: If names or values do not make one.
    """
    named = {name: float(value) for name, value in theta.items() if is_learnt(name)}
    if not named:
        return None
    bounds: dict[str, float] = {}
    found: dict[tuple[str, str], dict[Knot, float]] = {}
    for name, value in named.items():
        group, channel, knot = _parts(name)
        if group == RANGE:
            bounds[f"{channel}@{knot}"] = value
        else:
            found.setdefault((group, channel), {})[_knot(name, knot)] = value
    ends = [bounds.get(f"{channel}@{end}", math.nan) for channel in Seen._fields for end in ("low", "high")]
    curves = [
        Curve(group, channel, tuple(sorted(values)), tuple(values[knot] for knot in sorted(values)))
        for (group, channel), values in found.items()
    ]

    def problem(where: str, what: str) -> SettingsError:
        return SettingsError(f"{Learnt.name}.{where}: {what}")

    return _checked(Seen((ends[0], ends[1]), (ends[2], ends[3])), curves, problem)


def read_learnt(section: Section) -> dict[str, float]:
    """The values of the `[effects.learnt]` tables by their names in θ.

    Raises:
        SettingsError: With file, key and remedy.
    """
    section.only((RANGE, *GROUPS))
    if not section.values:
        return {}
    ranges = section.section(RANGE)
    ranges.only(Seen._fields)
    seen = Seen(ranges.bounds("forward"), ranges.bounds("yaw"))
    curves = [curve for group in section.values if group != RANGE for curve in _read_group(section, group)]
    return learnt_theta(_checked(seen, curves, section.error))


def _read_group(section: Section, name: str) -> list[Curve]:
    table = section.section(name)
    table.only(("knots", *GROUPS[name].channels))
    knots = tuple(_read_knot(table, value) for value in _list(table, "knots"))
    curves = []
    for channel in table.values:
        if channel != "knots":
            weights = [_number(table, channel, value) for value in _list(table, channel)]
            if len(weights) != len(knots):
                raise table.error(channel, f"must have one weight for each of {len(knots)} knots, got {len(weights)}")
            curves.append(Curve(name, channel, knots, tuple(weights)))
    if not curves:
        raise table.error("knots", f"is alone; add weights for {' or '.join(GROUPS[name].channels)}")
    return curves


def _list(table: Section, key: str) -> list[object]:
    value = table.values.get(key)
    if not isinstance(value, list) or not value:
        raise table.error(key, f"must be a list of numbers, got {value!r}")
    return value


def _number(table: Section, key: str, value: object) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise table.error(key, f"must be a list of numbers, got {value!r} in it")
    return float(value)


def _read_knot(table: Section, value: object) -> Knot:
    if isinstance(value, list) and len(value) == 2:
        return _number(table, "knots", value[0]), _number(table, "knots", value[1])
    return _number(table, "knots", value)


def _checked(seen: Seen, curves: list[Curve], problem: Callable[[str, str], SettingsError]) -> Learnt:
    """The effect, if its values make one."""
    for channel, (low, high) in zip(Seen._fields, seen, strict=True):
        if not (math.isfinite(low) and math.isfinite(high) and low <= 0.0 <= high):
            raise problem(
                f"{RANGE}.{channel}", f"must be finite with 0 in it, got [{low:g}, {high:g}]; state what was seen"
            )
    for curve in curves:
        where, group = f"{curve.group}.{curve.channel}", GROUPS[curve.group]
        _check_knots(curve, f"{curve.group}.knots", group, problem)
        for weight in curve.weights:
            if not abs(weight) <= LARGEST:
                raise problem(where, f"weights must be between {-LARGEST:g} and {LARGEST:g}, got {weight:g}")
        other = next(one for one in curves if one.group == curve.group)
        if other.knots != curve.knots:
            raise problem(where, f"must have the same knots as {other.group}.{other.channel}: one weight for each")
    order = {(group, channel): None for group, one in GROUPS.items() for channel in one.channels}
    places = list(order)
    return Learnt(seen, tuple(sorted(curves, key=lambda curve: places.index((curve.group, curve.channel)))))


def _check_knots(curve: Curve, where: str, group: Group, problem: Callable[[str, str], SettingsError]) -> None:
    pairs = group.unit.count(",") == 1
    for knot in curve.knots:
        values = knot if isinstance(knot, tuple) else (knot,)
        if (len(values) == 2) != pairs:
            raise problem(where, f"must be {'pairs' if pairs else 'numbers'} [{group.unit}], got {list(values)}")
        if not all(map(math.isfinite, values)):
            raise problem(where, "must be finite")
        if not any(values):
            raise problem(where, "0 is no knot: nothing is added there; take it out")
        if group.low is not None and values[0] < group.low:
            raise problem(where, f"must be at least {group.low:g} {group.unit}, got {values[0]:g}")
    if list(curve.knots) != sorted(set(curve.knots)):
        raise problem(where, "must be in ascending order, each once")


def learnt_text(theta: Theta) -> str:
    """The `[effects.learnt.GROUP]` tables that read back as the learnt effect of this θ, empty where it has none."""
    effect = learnt_effect(theta)
    if effect is None:
        return ""
    lines = [f"\n# {LABEL}", f"[effects.{Learnt.name}.{RANGE}]"]
    lines += [
        f"{channel} = [{low!r}, {high!r}]" for channel, (low, high) in zip(Seen._fields, effect.seen, strict=True)
    ]
    for group in dict.fromkeys(curve.group for curve in effect.curves):
        curves = [curve for curve in effect.curves if curve.group == group]
        lines += [
            f"\n[effects.{Learnt.name}.{group}]  # {GROUPS[group].title}",
            _row("knots", curves[0].knots, GROUPS[group].unit),
        ]
        lines += [_row(curve.channel, curve.weights, GROUPS[group].channels[curve.channel].unit) for curve in curves]
    return "\n".join(lines) + "\n"


def _row(key: str, values: Knots, unit: str) -> str:
    return f"{key} = [{', '.join(repr(list(v) if isinstance(v, tuple) else v) for v in values)}]  # {unit}"


def _parts(name: str) -> tuple[str, str, str]:
    """Group, channel and knot of a name in θ."""
    head, _, knot = name.partition("@")
    words = head.split(".")
    channels: Mapping[str, object] = {}
    if len(words) == 3 and (words[1] in GROUPS or words[1] == RANGE):
        channels = GROUPS[words[1]].channels if words[1] in GROUPS else {**dict.fromkeys(Seen._fields)}
    if len(words) != 3 or words[2] not in channels or not knot:
        known = [f"{Learnt.name}.{group}.{channel}@KNOT" for group, one in GROUPS.items() for channel in one.channels]
        raise SettingsError(f"{name}: no group of the learnt effect has this name; {nearest(name, known)}")
    return words[1], words[2], knot


def _knot(name: str, text: str) -> Knot:
    try:
        values = [float(part) for part in text.split(",")]
    except ValueError:
        raise SettingsError(f"{name}: '{text}' is no knot; write a number, or two with a comma") from None
    return (values[0], values[1]) if len(values) == 2 else values[0]


def _text(knot: Knot) -> str:
    return ",".join(repr(float(value)) for value in (knot if isinstance(knot, tuple) else (knot,)))
