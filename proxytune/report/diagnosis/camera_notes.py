"""Sentences of a camera's diagnosis."""

from collections.abc import Mapping

from proxytune.diagnosis import Blemish, CameraDiagnosis, CameraEffect, Estimate, LaidLine, LaidMap
from proxytune.report.diagnosis.notes import say_verdict
from proxytune.report.wording import fixed, listed, short

MOST_LINES = 3
"""So many lines of the map are told, the farthest from their places first."""
WIDER_M = 0.002
"""Tape is told to be wider or narrower than on the map from here on."""
RELATIVE = (
    "exposure is relative to the map's declared paint: it makes pictures match, and is no figure of the camera where "
    "the paint is not known"
)


def camera_headline(log: str, diagnosis: CameraDiagnosis, found: str = "", beside: str = "") -> str:
    """What was found and fitted of the camera, then the verdict and what it means."""
    return f"{log}: camera: {say_verdict(found, beside, diagnosis.verdict, 'camera', diagnosis.at_ends)}"


def camera_notes(diagnosis: CameraDiagnosis) -> list[str]:
    """Everything that the tables do not hold, a line each."""
    lines = [_say_added(effect) for effect in diagnosis.effects]
    lines += [_say_immaterial(effect, diagnosis.dropped) for effect in diagnosis.negligible]
    if (after := diagnosis.residual_fields[1]).significant:
        field = f"markings lie {after.rms_px:.2f} px (RMS) from their places in the picture, wherever the robot stands"
        lines.append(f"left over and fixed to the camera: {field}; no effect of the catalogue bends pictures so")
        lines[-1] += "; values of added effects are no physics yet" if diagnosis.effects else ""
    rows, columns = diagnosis.gathered.pictures.shape[1:3]
    lines += [_say_blemish(blemish, rows, columns) for blemish in diagnosis.blemishes]
    lines += [RELATIVE] if any(name.startswith("exposure") for name in diagnosis.theta) else []
    lines += _say_map(diagnosis.laid)
    if diagnosis.could_not_be_seen:
        lines.append(f"these frames could not have shown: {', '.join(diagnosis.could_not_be_seen)}")
    lines += [f"to see more, take {views}" for views in diagnosis.next_views]
    return lines + list(diagnosis.notes)


def _say_added(effect: CameraEffect) -> str:
    """Say what is known of an effect that bends the picture, or of one that changes its look alone."""
    rivals, growth = ", ".join(effect.rivals), f"grows by {_growth(effect)} %"
    if effect.nats is not None:
        beside = f"; these frames fit {rivals} as well" if rivals else ""
        gain, kept = f"log-likelihood gain {fixed(effect.nats, 0)} nats", ""
        if effect.nats <= -0.5:
            kept = " so the frames fitted speak against it; it is kept for frames that were not fitted:"
        return f"added {effect.effect}: {gain},{kept} without it the displacement of markings {growth}{beside}"
    beside = f"; {rivals} looks like it" if rivals else ""
    if effect.error_without is None:
        return f"added {effect.effect}, which no model can predict pixel by pixel{beside}"
    return f"added {effect.effect}: without it the error in brightness {growth}{beside}"


def _say_immaterial(effect: CameraEffect, values: Mapping[str, Estimate]) -> str:
    known = [values[name] for name in effect.names if name in values]
    value = "".join(f" {short(one.value)} {one.unit}".rstrip() for one in known)
    change = f"without it the displacement of markings grows by {_growth(effect)} %"
    return f"detectable but immaterial: {effect.effect}{value}, {change}"


def _growth(effect: CameraEffect) -> str:
    if effect.error_without is None:
        return "an unknown number of"
    return fixed(100.0 * (effect.error_without - 1.0), 0 if effect.error_without > 1.1 else 1)


def _say_blemish(blemish: Blemish, rows: int, columns: int) -> str:
    (left, right), (top, bottom) = blemish.columns, blemish.rows
    across = ("left", "middle", "right")[min(2, int(3.0 * ((left + right + 1) / 2.0 / columns)))]
    down = ("upper", "middle", "lower")[min(2, int(3.0 * ((top + bottom + 1) / 2.0 / rows)))]
    where = "middle" if across == down else " ".join(word for word in (down, across) if word != "middle")
    place = f"columns {left} to {right}, rows {top} to {bottom} of {columns} × {rows}"
    return f"something covers the {where} of the picture: {place}"


def _say_map(laid: LaidMap) -> list[str]:
    lines = [_say_line(line) for line in laid.lines[:MOST_LINES]]
    if (rest := len(laid.lines) - MOST_LINES) > 0:
        lines.append(f"{rest} more lines of the map lie beside their places: see `map` in diagnosis.json")
    for name, width in laid.widths.items():
        if abs(width.value) >= WIDER_M and not width.interval[0] <= 0.0 <= width.interval[1]:
            larger, smaller = ("longer", "shorter") if name.endswith("dashes") else ("wider", "narrower")
            way = larger if width.value > 0.0 else smaller
            lines.append(f"{name} are {1e3 * abs(width.value):.1f} mm {way} than on the map")
    moved = [
        f"{fixed(1e3 * one.value, 0)} mm in {name[0]}" if one.unit == "m" else f"{fixed(one.value, 2)}° in heading"
        for name, one in laid.offset.items()
        if not one.interval[0] <= 0.0 <= one.interval[1]
    ]
    return [*lines, f"the whole map lies off by {listed(moved)}"] if moved else lines


def _say_line(line: LaidLine) -> str:
    ahead = line.line.endswith("dashes")
    ways = ("ahead of", "behind") if ahead else ("to the right of", "to the left of")
    verb, their = ("lie", "their") if ahead else ("lies", "its")
    low, high = sorted(abs(1e3 * end) for end in line.interval)
    size = f"{abs(1e3 * line.right_m):.0f} mm ({low:.0f} to {high:.0f})"
    way = ways[0] if line.right_m > 0.0 else ways[1]
    return f"the {line.line} of stretch {line.stretch} {verb} {size} {way} {their} place, driving counter-clockwise"
