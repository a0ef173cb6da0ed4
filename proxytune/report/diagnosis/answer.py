"""Answer of a diagnosis, of motion and camera: headline, tables, notes, figures with captions, next step."""

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TypeVar

import numpy as np
from matplotlib.figure import Figure
from rich.console import Group
from rich.text import Text

from proxytune.diagnosis import CameraDiagnosis, Diagnosis, LogDiagnosis, PictureError, Ratio, Rmse
from proxytune.report.diagnosis import document
from proxytune.report.diagnosis.camera_figures import camera_figures
from proxytune.report.diagnosis.camera_notes import camera_headline, camera_notes
from proxytune.report.diagnosis.figures import motion_figures
from proxytune.report.diagnosis.notes import VERDICTS, motion_headline, motion_notes, next_drives
from proxytune.report.export.ros import commands_text, player_text
from proxytune.report.html import write_page
from proxytune.report.meanings import findings, fitted
from proxytune.report.text import group_texts, table_text
from proxytune.report.view import Column, Drawn, Paragraphs, Picture, Table, View, columns_of, foot_of
from proxytune.report.wording import fixed, short, span
from proxytune.report.writing import CAPTIONS, picture_of, save_figures, write_text

Said = TypeVar("Said")
MOST_TRIED = 8
"""So many effects that were tried are in the table."""


def write_diagnosis(found: LogDiagnosis, folder: Path, command: str = "") -> list[Path]:
    """Write diagnosis.json, model.toml, next/commands.csv with a ROS 2 node that plays it, figures and page; paths."""
    whole, model, page = (folder / name for name in ("diagnosis.json", "model.toml", "report.html"))
    text = json.dumps(document.diagnosis_document(found), indent=2, allow_nan=False, ensure_ascii=False)
    write_text(whole, text)
    write_text(model, document.extended_model_text(found))
    following = [folder / "next" / name for name in ("commands.csv", "play_commands.py")]
    if found.motion is None or found.motion.next_drive is None:
        for path in following:  # An earlier diagnosis may have had a drive
            path.unlink(missing_ok=True)
        following = []
    else:
        write_text(following[0], commands_text(found.motion))
        write_text(following[1], player_text(found.motion))
    figures = diagnosis_figures(found)
    drawn, foot = save_figures(figures, folder), foot_of(command, [("log", found.log), ("robot", found.robot.name)])
    write_page(page, diagnosis_view(found, figures), foot)
    return [whole, model, *following, *drawn, page]


def diagnosis_view(found: LogDiagnosis, figures: Mapping[str, Drawn]) -> View:
    """A diagnosis: the figures by their names, then the tables and all notes."""
    notes = tuple(f"{note[:1].upper()}{note[1:]}." for note in diagnosis_notes(found))
    paragraphs = [Paragraphs("What else is to be known", notes)] if notes else []
    drives, part = [] if found.motion is None else next_drives(found.motion), found.motion or found.camera
    next_step = f"{'; '.join(drives)}." if drives else VERDICTS[part.verdict]["next"] if part else ""
    tables = [table for _, own, _ in _said(found) for table in own]
    title = f"{found.log}: what does the model of {found.robot.name} lack?"
    return View(title, f"{diagnosis_headline(found)}.", next_step, (*diagnosis_pictures(figures), *tables, *paragraphs))


def diagnosis_text(found: LogDiagnosis) -> Group:
    """The diagnosis as `diagnose` prints it: of motion, then of the camera, a verdict, tables and notes."""
    parts = list[Group | Text]()
    for headline, tables, notes in _said(found):
        parts += [Text("")] if parts else []
        parts.append(group_texts(Text(headline, style="bold"), *map(table_text, tables), *notes))
    return group_texts(*_with_remarks(found, parts))


def diagnosis_figures(found: LogDiagnosis) -> dict[str, Figure]:
    """Every figure that there is something to draw for, by name."""
    motion = {} if found.motion is None else motion_figures(found.motion)
    camera = {} if found.camera is None else camera_figures(found.camera)
    return {**motion, **camera}


def diagnosis_headline(found: LogDiagnosis) -> str:
    """What was found, each effect with its size and what it is worth; then the verdicts and what they mean."""
    return "; ".join(headline for headline, _, _ in _said(found))


def diagnosis_notes(found: LogDiagnosis) -> list[str]:
    """Everything that the tables do not hold, a line each."""
    return _with_remarks(found, [note for _, _, own in _said(found) for note in own])


def _said(found: LogDiagnosis) -> list[tuple[str, list[Table], list[str]]]:
    """Headline, tables and notes of motion, then of the camera, as far as there are such."""
    said = []
    if (motion := found.motion) is not None:
        found_of = findings(document.motion_effects(motion), motion.robot.catalogue)
        beside = found_of, fitted(motion.declared, motion.theta)
        said.append((motion_headline(motion, *beside), _motion_tables(motion), motion_notes(motion)))
    if (camera := found.camera) is not None:
        beside = findings(document.camera_effects(camera)), fitted(camera.declared, camera.theta)
        said.append((camera_headline(found.log, camera, *beside), _camera_tables(camera), camera_notes(camera)))
    return said


def _with_remarks(found: LogDiagnosis, said: Sequence[Said]) -> list[Said | str]:
    """Cautions, a line each, then what is said, then why a part is missing."""
    refused = {"motion": found.motion_refused, "camera": found.camera_refused}
    missing = [f"{part}: {why}" for part, why in refused.items() if why]
    return [*(f"beware: {line}" for line in found.cautions), *said, *missing]


def diagnosis_pictures(figures: Mapping[str, Drawn]) -> list[Picture]:
    """The figures that there are, with captions."""
    return [picture_of("diagnosis", name, figures[name]) for name in CAPTIONS["diagnosis"] if name in figures]


def _motion_tables(diagnosis: Diagnosis) -> list[Table]:
    """Parameters, errors by length of the window, and the effects tried, best first."""
    rows = list[tuple[str, ...]]()
    confirmed = [(diagnosis.confirmed, ", bullet")] if diagnosis.confirmed else []
    for error, plant in [*((error, "") for error in diagnosis.errors), *confirmed]:
        place = (_with_ends(error.before, 1, 1e3), _with_ends(error.after, 1, 1e3), _with_ends(error.ratio, 2))
        floor = span((1e3 * error.floor.lower, 1e3 * error.floor.upper), 1)
        headings = (error.heading_before.value, error.heading_after.value, error.heading_floor)
        before, after, least = (fixed(float(np.degrees(one)), 2) for one in headings)
        rows += [(f"{error.horizon_s:g} s{plant}", *place, floor), ("  heading [deg]", before, after, "", least)]
    first = diagnosis.found.tried[:MOST_TRIED]
    tried = tuple((one.effect, one.form, f"{one.gain:.1f}", f"{one.p_value:.3f}") for one in first)
    title, heads = "Error on held-out drives: RMSE of position [mm]", ("before", "after", "after / before")
    return [
        _parameters_table("Fitted parameters", diagnosis),
        Table(title, columns_of(("window",), (*heads, "noise floor")), tuple(rows)),
        Table("Effects tried, best first", columns_of(("effect", "form"), ("log-likelihood gain [nats]", "p")), tried),
    ]


def _with_ends(one: Rmse | Ratio | PictureError, decimals: int, scale: float = 1.0) -> str:
    low, high = one.interval
    return f"{fixed(scale * one.value, decimals)} ({span((scale * low, scale * high), decimals)})"


def _camera_tables(diagnosis: CameraDiagnosis) -> list[Table]:
    """Parameters, and errors on frames kept aside."""
    rows = []
    for name, error, decimals in (("markings [px]", diagnosis.pixels, 2), ("brightness [grey]", diagnosis.grey, 1)):
        floor, frames = document.camera_noise_floor(error), int(np.isfinite(error.before.frames).sum())
        both = (_with_ends(one, decimals) for one in (error.before, error.after))
        rows.append((name, *both, "" if floor is None else f"{floor:.{decimals}f}", str(frames)))
    heads = columns_of(("error",), ("before", "after", "floor", "frames"))
    return [
        _parameters_table("Fitted parameters of the camera", diagnosis),
        Table("Error on frames kept aside", heads, tuple(rows)),
    ]


def _parameters_table(title: str, diagnosis: Diagnosis | CameraDiagnosis) -> Table:
    """Fitted parameters before and after effects were added, by name in θ."""
    rows = []
    for name, after in diagnosis.theta.items():
        if name.endswith(".imbalance") and after.value == 0.0:
            continue
        low, high = after.interval
        old = short(diagnosis.declared[name].value, 4) if name in diagnosis.declared else ""
        interval = f"{short(low, 4)} to {short(high, 4)}" if low < high else ""
        rows.append((name, old, short(after.value, 4), interval, after.unit))
    heads = columns_of(("parameter",), ("declared only", "effects added", "95 % interval"))
    return Table(title, (*heads, Column("unit")), tuple(rows))
