"""How a map was laid: what its lines and the whole of it are off, as a camera's fit has it."""

import numpy as np

from proxytune.diagnosis.camera.model.fitting import CameraFit
from proxytune.diagnosis.camera.model.views import Tape
from proxytune.diagnosis.camera.result import LaidLine, LaidMap, estimate_of, interval_of
from proxytune.driving.road.markings import LINES

SURE = 3.0
"""A line is told to lie beside its place from so many standard deviations on."""

WIDTHS = ("white lines", "yellow lines", "yellow dashes")


def describe_map(fit: CameraFit) -> LaidMap:
    """What the fit says of the map."""
    degrees = np.array((1.0, 1.0, np.degrees(1.0)))
    offsets = zip(("x_m", "y_m", "heading_deg"), fit.state.offset * degrees, fit.offset_sd * degrees, strict=True)
    offset = {name: estimate_of(value, sd, name.rpartition("_")[-1]) for name, value, sd in offsets}
    stretches = fit.views.markings.stretches
    first = Tape(stretches).size - len(WIDTHS)
    widths = zip(WIDTHS, fit.state.tape[first:], fit.tape_sd[first:], strict=True)
    return LaidMap(offset, _lines(fit, stretches), {name: estimate_of(value, sd, "m") for name, value, sd in widths})


def _lines(fit: CameraFit, stretches: int) -> tuple[LaidLine, ...]:
    tape, lines = Tape(stretches), []
    for stretch in range(stretches):
        for number, name in enumerate(LINES):
            place = tape.shift(np.array(stretch), np.array(number))
            value, sd = float(fit.state.tape[place]), float(fit.tape_sd[place])
            if abs(value) > SURE * sd:
                lines.append(LaidLine(name, stretch, value, interval_of(value, sd)))
    return tuple(sorted(lines, key=lambda line: -abs(line.right_m)))
