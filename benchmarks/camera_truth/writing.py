"""Writing a blind set: a log's folder as a user would have it, and what is true of it."""

import io
import json
import shutil
from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from camera_truth.cases import POSES, Case, draw_case
from camera_truth.exposure import exposed, instants
from camera_truth.ground import photographed_floor
from camera_truth.pinhole import Pinhole
from camera_truth.room import sky, walls
from camera_truth.routes import ROWS_HZ, Drive, drives, places
from proxytune.driving import Road, draw_floor, shipped_map
from proxytune.driving.road_picture import Floor
from proxytune.files import shipped

Values = NDArray[np.float64]


@dataclass(frozen=True)
class Truth:
    """What is true of a set."""

    case: str  # its name
    seed: int
    effects: tuple[str, ...]  # what is wrong with the camera, outside effects among it
    theta: Mapping[str, float]  # figures that differ from nominal, by the names of parameters
    figures: Mapping[str, float]  # all figures
    outside: Mapping[str, Any]  # what no catalogue has
    position_m: float  # scatter of measured places [m]
    heading_deg: float  # scatter of measured headings [deg]
    tape_m: float  # how far lines lie from their places [m]: standard deviation, or the largest for 0.02
    scene: Mapping[str, Any]  # how the set was taken, for looking at results by it


def write_set(folder: Path, case: str, seed: int) -> Truth:
    """Write the log of a case with 120 frames.

    Args:
        folder: Where to; made if it is not there.
        case: See draw_case.
        seed: Of all that is random.
    """
    drawn = draw_case(case, seed)
    random = [np.random.default_rng(child) for child in drawn.seeds.spawn(4)]
    road = shipped_map(drawn.road)
    floor = draw_floor(road) if drawn.plain else photographed_floor(road, drawn.tape_m, random[0])
    (folder / "frames").mkdir(parents=True, exist_ok=True)
    way = (
        _write_drives(folder, drawn, road, random[1]) if drawn.moves else _write_places(folder, drawn, road, random[1])
    )
    for number, scene in enumerate(_scenes(drawn, floor, way, random[2])):
        gain = 1.0 if drawn.fixed else 1.0 + random[3].uniform(-0.1, 0.1)
        _write_picture(folder, number, drawn, exposed(scene, drawn.sight, gain, drawn.noise, random[3]))
    _describe(folder, drawn)
    return _truth(drawn)


def write_truth(file: Path, truth: Truth) -> None:
    """Keep what is true in a file of JSON."""
    file.write_text(json.dumps(asdict(truth), indent=1) + "\n", encoding="utf-8")


def _truth(case: Case) -> Truth:
    sight, (position_m, heading_deg) = case.sight, POSES[case.scatter]
    names = ("moves", "road", "plain", "walls", "fixed", "quality", "noise")
    scene = {name: getattr(case, name) for name in names}
    tape_m = 0.0 if case.plain else case.tape_m
    known = (case.effects, dict(sight.theta), dict(sight.figures), dict(sight.outside))
    return Truth(case.name, case.seed, *known, position_m, heading_deg, tape_m, scene)


def _scenes(case: Case, floor: Floor, way: Values | tuple[Drive, ...], random: np.random.Generator) -> Iterator[Values]:
    """What reaches the lens, frame by frame."""
    late, weights = instants(case.sight, moves=case.moves)
    room = walls(random) if case.walls else sky()
    with Pinhole(case.sight, floor, room, moves=case.moves) as pinhole:
        if isinstance(way, tuple):
            for drive in way:
                for time in drive.frames:
                    yield pinhole.expose(drive.at(time + late.mean()), drive.at(time + late), weights)
        else:
            for pose in way:
                yield pinhole.expose(pose, pose[None], weights)


def _measured(poses: Values, case: Case, random: np.random.Generator) -> Values:
    position_m, heading_deg = POSES[case.scatter]
    return poses + random.normal(size=poses.shape) * (position_m, position_m, np.radians(heading_deg))


def _write_places(folder: Path, case: Case, road: Road, random: np.random.Generator) -> Values:
    poses = places(road, random)
    rows = [f"0,{number}.0,{_text(pose)}" for number, pose in enumerate(_measured(poses, case, random))]
    _write_rows(folder / "samples.csv", "episode,time,x,y,heading", rows)
    return poses


def _write_drives(folder: Path, case: Case, road: Road, random: np.random.Generator) -> tuple[Drive, ...]:
    way = drives(road, random)
    samples, frames = [], []
    for episode, drive in enumerate(way):
        rows = np.column_stack((drive.duties, _measured(drive.rows, case, random)))
        samples += [f"{episode},{number / ROWS_HZ:.2f},{_text(row)}" for number, row in enumerate(rows)]
        frames += [f"{len(frames) + number},{episode},{time:.4f}" for number, time in enumerate(drive.frames)]
    _write_rows(folder / "samples.csv", "episode,time,left,right,x,y,heading", samples)
    _write_rows(folder / "frames.csv", "frame,episode,time", frames)
    return way


def _text(row: Values) -> str:
    return ",".join(f"{value:.6f}" for value in row)


def _write_rows(file: Path, head: str, rows: list[str]) -> None:
    file.write_text("\n".join((head, *rows)) + "\n", encoding="utf-8")


def _write_picture(folder: Path, number: int, case: Case, picture: NDArray[np.uint8]) -> None:
    data, image = io.BytesIO(), Image.fromarray(picture)
    if case.quality:
        image.save(data, "JPEG", quality=case.quality)
    else:
        image.save(data, "PNG")
    (folder / "frames" / f"{number:06d}.{_ending(case)}").write_bytes(data.getvalue())


def _ending(case: Case) -> str:
    return "jpg" if case.quality else "png"


def _describe(folder: Path, case: Case) -> None:
    """Write log.toml, and a map file beside it where the tape is worse than the shipped map says."""
    position_m, heading_deg = POSES[case.scatter]
    road, own = case.road, case.tape_m != 0.005 and not case.plain
    if own:
        shutil.copyfile(shipped("robots") / "maps" / f"{road}.toml", folder / "laid.toml")
        with (folder / "laid.toml").open("a", encoding="utf-8") as file:
            file.write(f"tape_m = {case.tape_m}\n")
    lines = [
        "format = 1",
        f'name = "{folder.name}"',
        'robot = "duckiebot"',
        f'map = "{"laid.toml" if own else road}"',
        f'command = "{"duty" if case.moves else "none"}"',
        *([f"rate_hz = {ROWS_HZ}"] if case.moves else []),
        'pose = "true pose and white noise; x right, y up [m]; heading [rad] counter-clockwise from +x"',
        "measured = false",
        "",
        "[camera]",
        f'frames = "frames/%06d.{_ending(case)}"',
        f"poses = {{ position_m = {position_m}, heading_deg = {heading_deg} }}",
        f'exposure = "{"fixed" if case.fixed else "auto"}"',
    ]
    (folder / "log.toml").write_text("\n".join(lines) + "\n", encoding="utf-8")
