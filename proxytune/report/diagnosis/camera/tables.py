"""A camera's diagnosis as `diagnose` prints it."""

import numpy as np
from rich.console import Group
from rich.markup import escape
from rich.table import Table
from rich.text import Text

from proxytune.diagnosis import CameraDiagnosis, PictureError
from proxytune.report.diagnosis.camera.document import noise_floor
from proxytune.report.diagnosis.camera.words import camera_headline, camera_notes
from proxytune.report.diagnosis.tables import parameters_table, plain_table


def camera_tables_and_notes(log: str, diagnosis: CameraDiagnosis) -> Group:
    """The verdict, tables and notes."""
    title = Text(camera_headline(log, diagnosis), style="bold")
    parameters = parameters_table("Fitted parameters of the camera", diagnosis.declared, diagnosis.theta)
    return Group(title, parameters, _errors(diagnosis), *map(Text, camera_notes(diagnosis)))


def _errors(diagnosis: CameraDiagnosis) -> Table:
    table = plain_table("Error on frames kept aside", ("error", "before", "after", "floor", "frames"))
    for name, error, decimals in (
        ("markings [px]", diagnosis.pixels, 2),
        ("brightness [grey]", diagnosis.grey, 1),
    ):
        before, after = (_with_interval(one, decimals) for one in (error.before, error.after))
        floor, frames = noise_floor(error), int(np.isfinite(error.before.frames).sum())
        table.add_row(
            escape(name), escape(before), escape(after), "" if floor is None else f"{floor:.{decimals}f}", str(frames)
        )
    return table


def _with_interval(error: PictureError, decimals: int) -> str:
    low, high = error.interval
    return f"{error.value:.{decimals}f} [{low:.{decimals}f} … {high:.{decimals}f}]"
