"""Ways in and out of proxytune from Python: logs of others, score tables of a twin, predictions."""

from collections.abc import Callable
from contextlib import suppress
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from proxytune import diagnosis
from proxytune.api.logs import check_no_more_pictures
from proxytune.domain import DomainFamily
from proxytune.driving import Robot, catalogue_of, is_robot, read_model_of, read_robot, robot_from_geometry
from proxytune.effects import Catalogue, Model
from proxytune.errors import InputError, LogError
from proxytune.importing import Facts, Source, Wanted, as_log, open_log, read_source, with_named_pictures, write_log
from proxytune.logs import Log, check_kind, log_cautions, without_outliers
from proxytune.report import clocks_document, clocks_notes, frame_html, write_picture, write_text
from proxytune.running import watching
from proxytune.scores import ScoreTable, write_scores
from proxytune.seeds import target_seed
from proxytune.settings import GEOMETRY, check_whole
from proxytune.study import StudySettings, bare_family, cautions_of, check_model, measure_agents, read_study_settings

MOST_REPEATS = 1_000_000


@dataclass(frozen=True, repr=False)
class ImportReport:
    """Result of an import: what a bag, a table or a trajectory holds, and the log that was written of it.

    Attributes:
        source: Its channels, drives and notes.
        log: The log's folder; None where none was written.
        cautions: What is probably not meant in it, a sentence each.
    """

    source: Source
    log: Path | None
    cautions: tuple[str, ...] = ()

    def __repr__(self) -> str:
        return f"ImportReport of {len(self.source.surveys)} drives ({self.source.form}), log: {self.log}"

    def _repr_html_(self) -> str:
        return frame_html(f"{self.source.form}: {len(self.source.surveys)} drives", self.drives())

    def drives(self) -> pd.DataFrame:
        """One row per drive: its length, rates, gaps and reaction."""
        return pd.DataFrame(list(map(asdict, self.source.surveys)))

    to_frame = drives

    def document(self) -> dict[str, Any]:
        """The JSON document of `import --json`."""
        written = None if self.log is None else str(self.log)
        found, drives = self.source, [asdict(one) for one in self.source.surveys]
        channels = [{"name": c.name, "type": c.kind, "count": c.count, "role": c.role} for c in found.channels]
        facts = {"form": found.form, "channels": channels, "notes": list(found.notes)}
        return facts | {"log": written, "drives": drives, "cautions": list(self.cautions)}


def import_log(
    source: str | Path, output: str | Path | None = None, *, wanted: Wanted | None = None, facts: Facts | None = None
) -> ImportReport:
    """Read a ROS bag, CSV, TUM, MRCLAM or .npz, say what is in it, and write it as a log.

    Args:
        source: A file or folder.
        output: The log's folder to write; nothing is written where it is not given.
        wanted: Topics and columns to take; chosen where it is not given.
        facts: What only the user knows: robot, figures, map, offset of clocks.

    Raises:
        InputError: If the source cannot be read, with file, row and column.
        RunError: If the log cannot be written.
    """
    known, path = facts or Facts(), Path(source)
    whole = read_source(path, wanted or Wanted(), known.offset_s)
    if known.road and all(drive.pictures is None for drive in whole.drives):
        raise LogError(f"{path}: --map is the map that pictures show, and it has none; leave that out")
    found = with_named_pictures(whole, known)
    if output is not None:
        folder = Path(output)
        robot = _known_robot(known.robot or folder.resolve().name)  # Writing may replace the folder that one is in
        for drive in whole.drives:
            if robot is not None and drive.commands is not None:
                check_kind(drive.commands.kind, robot.name, robot.drive, str(path))
        log = write_log(found, folder, known, origin=path.name)
        return ImportReport(found, folder, log_cautions(log, {} if robot is None else robot.figures))
    bare = replace(found, drives=tuple(replace(drive, pictures=None) for drive in found.drives))
    try:
        with as_log(bare, known, path) as log:
            robot = _known_robot(log.robot)
            return ImportReport(found, None, log_cautions(log, {} if robot is None else robot.figures))
    except LogError as problem:
        return ImportReport(found, None, (f"it makes no log: {problem}",))


def _known_robot(name: str) -> Robot | None:
    with suppress(InputError):
        return read_robot(name, Path.cwd()) if is_robot(name, Path.cwd()) else None
    return None


@dataclass(frozen=True, repr=False)
class Measurement:
    """Scores of a study's agents in the domain of a model, as a target is measured.

    Attributes:
        scores: The table.
        model: The model.toml of the domain.
        seed: Seed of the episodes.
        repeats: Episodes from every start.
        cautions: What is probably not meant in the model or the robot, and metrics left out, a sentence each.
    """

    scores: ScoreTable
    model: Path
    seed: int
    repeats: int
    cautions: tuple[str, ...] = ()

    def __repr__(self) -> str:
        return f"Measurement of {len(self.scores.agents)} agents in {self.model.name}, seed {self.seed}"

    def _repr_html_(self) -> str:
        return frame_html(repr(self), self.means())

    def means(self) -> pd.DataFrame:
        """One row per agent: its mean score in each metric."""
        index = pd.Index(self.scores.agents, name="agent")
        return pd.DataFrame(self.scores.means, index=index, columns=list(self.scores.metrics))

    to_frame = means

    def document(self) -> dict[str, Any]:
        """The JSON document of `measure --json`, without the file."""
        return {
            "model": str(self.model),
            "seed": self.seed,
            "agents": list(self.scores.agents),
            "episodes": len(self.scores.episodes),
            "repeats": self.repeats,
            "means": {str(agent): dict(row) for agent, row in self.means().to_dict("index").items()},
            "cautions": list(self.cautions),
        }

    def write(self, path: str | Path) -> None:
        """Write the score table as CSV.

        Raises:
            RunError: If it cannot be written.
        """
        write_scores(self.scores, Path(path))


def measure(
    study: str | Path, model: str | Path, *, repeats: int = 1, seed: int | None = None, progress: bool = False
) -> Measurement:
    """Drive a study's agents, and those that it holds out by name, in the domain of a model file.

    Args:
        study: The study's folder, or its study.toml, for its agents, starts and [domain].
        model: The model.toml of the domain.
        repeats: Episodes from every start, each with its own placement noise.
        seed: Seed of the episodes; the study's seed plus an offset where it is not given.
        progress: Show a bar.

    Raises:
        InputError: If the study or the model cannot be used.
        RunError: If an episode fails.
    """
    settings, path = read_study_settings(Path(study)), Path(model)
    own = target_seed(settings.seed) if seed is None else seed
    check_whole("--seed", own)
    if not 1 <= repeats <= MOST_REPEATS:
        raise InputError(f"--repeats must be between 1 and {MOST_REPEATS}, got {repeats}")
    check_model(settings, path, "--model")
    settings = replace(settings, agents=tuple(dict.fromkeys((*settings.agents, *settings.held_out))))
    episodes = len(settings.agents) * settings.starts * repeats
    family = bare_family(settings, path)
    cautions = [*cautions_of(family), *_unread(settings, family, path)]
    with watching(progress, episodes) as watcher:
        scores = measure_agents(settings, path, own, watcher, repeats, cautions.append)
    return Measurement(scores, path, own, repeats, tuple(cautions))


def _unread(settings: StudySettings, family: DomainFamily, model: Path) -> tuple[str, ...]:
    """Say so where a model leaves a family's identity, which names all that a result depends on, as without one."""
    with suppress(InputError):  # Of a family that needs a model
        if bare_family(settings, None).identity == family.identity:
            told = f"{settings.family} is the same without it (identity), so its factory reads no value in it"
            return (f"--model {model}: {told}",)
    return ()


@dataclass(frozen=True, repr=False)
class Prediction:
    """Poses of a log as a fitted model predicts them, beside the measured ones.

    Attributes:
        poses: One row per predicted pose: episode, start_time, time [s], x, y [m], heading [rad].
        horizon_s: Length of the windows [s].
        error: Root mean square error over the windows.
        clocks: Those of the log, as `diagnose` reads and corrects them.
        notes: What is wrong with them, a line each.
        cautions: What is probably not meant in the model or the log, a sentence each.
    """

    poses: pd.DataFrame
    horizon_s: float
    error: diagnosis.Agreement
    clocks: diagnosis.Clocks
    notes: tuple[str, ...] = ()
    cautions: tuple[str, ...] = ()

    def __repr__(self) -> str:
        return f"Prediction over {self.error.windows} windows of {self.horizon_s:g} s: {self.sentence}"

    def _repr_html_(self) -> str:
        return frame_html(repr(self), self.poses)

    @property
    def sentence(self) -> str:
        """Say how far the predicted poses are from the measured ones."""
        rmse = self.error
        if not rmse.poses:
            return "nothing to compare with, for no drive has measured poses over a whole window"
        return f"RMSE {1e3 * rmse.place:.1f} mm, {np.degrees(rmse.turn):.2f}° over {rmse.poses} poses"

    def document(self) -> dict[str, Any]:
        """The JSON document of `predict --json`, without the file."""
        rmse = self.error
        place, turn = (rmse.place, rmse.turn) if rmse.poses else (None, None)
        error = {"value": place, "unit": "m", "heading": turn, "heading_unit": "rad", "poses": rmse.poses}
        facts = {"rows": len(self.poses), "windows": rmse.windows, "horizon_s": self.horizon_s}
        return facts | {"error": error, "clocks": clocks_document([self.clocks]), "cautions": list(self.cautions)}


@dataclass(frozen=True, repr=False)
class PicturePrediction:
    """Pictures of a log's camera as a fitted model draws them.

    Attributes:
        folder: Where they and frames.csv are.
        frames: Their number.
        grey_error: Mean absolute difference from the measured ones on the floor [grey levels].
    """

    folder: Path
    frames: int
    grey_error: float

    def __repr__(self) -> str:
        return f"PicturePrediction: {self.sentence}"

    def _repr_html_(self) -> str:
        return frame_html(self.sentence, pd.DataFrame([self.document()]))

    @property
    def sentence(self) -> str:
        """Say how far the drawn pictures are from the measured ones."""
        return f"{self.frames} frames: mean absolute difference on the floor {self.grey_error:.1f} grey levels"

    def document(self) -> dict[str, Any]:
        """The JSON document of `predict --frames --json`."""
        return {"frames": self.frames, "output": str(self.folder), "grey_error": self.grey_error}


def predict(
    model: str | Path,
    log: Log | str | Path,
    *,
    horizon_s: float = 2.0,
    frames: str | Path | None = None,
    wanted: Wanted | None = None,
    facts: Facts | None = None,
    tell: Callable[[str], None] = lambda line: None,
) -> Prediction | PicturePrediction:
    """Predict the poses of a log, or with `frames` the pictures of its camera, by a fitted model.

    In each window the model starts from the measured pose and is driven by the recorded commands, on one clock with the
    poses: where clocks are apart, the log is corrected as for a diagnosis.

    Args:
        model: A model.toml.
        log: A log, its folder, or what `import_log` reads.
        horizon_s: Length of the windows [s].
        frames: The folder for predicted pictures and frames.csv.
        wanted: Topics and columns to take of a bag or table.
        facts: What only the user knows of a bag or table.
        tell: Hears how many pictures are drawn.

    Raises:
        InputError: If the model or the log cannot be used, or the folder has more pictures than the log.
        RunError: If a picture cannot be written.
    """
    if not (np.isfinite(horizon_s) and horizon_s > 0.0):
        raise InputError(f"--horizon must be a positive number of seconds, got {horizon_s}")
    fitted, known = read_model_of(Path(model), Path.cwd()), facts or Facts()
    catalogue = catalogue_of(fitted.robot, Path.cwd())
    keys = {figure: key for key, figure in GEOMETRY.items()}
    stated = {keys[name]: value for name, value in (fitted.geometry or {}).items() if name in keys}
    named = replace(known, robot=known.robot or fitted.robot, figures=known.figures or stated)
    with open_log(log, wanted or Wanted(), named) as (drives, _):
        if frames is not None:
            return _predict_pictures(fitted, drives, catalogue, Path(frames), tell)
        if drives.command == "none":
            hint = "" if drives.frames is None else ", or give --frames to predict those"
            raise InputError(f"{drives.name}: has no commands to predict poses from; give a log of drives{hint}")
        robot = _robot_of(fitted, drives, catalogue)
        cautions = (*fitted.cautions, *log_cautions(drives, robot.figures))
        if drives.robot != fitted.robot and not known.robot:
            cautions = (*cautions, f"the log is of the robot '{drives.robot}', and the model of '{fitted.robot}'")
        drives = replace(drives, episodes=tuple(map(without_outliers, drives.episodes)))
        corrected, clocks = diagnosis.on_one_clock(drives, robot, model=fitted.theta)
        # Else a log is predicted whole, as it was recorded, long rests and all.
        drives = corrected if clocks.differ else drives
        table = diagnosis.predict(drives, robot, fitted.theta, horizon_s)
        notes = tuple(clocks_notes(drives.name, [clocks], {}))
        return Prediction(table, horizon_s, diagnosis.agreement(table, drives, horizon_s), clocks, notes, cautions)


def _predict_pictures(
    model: Model, log: Log, catalogue: Catalogue, folder: Path, tell: Callable[[str], None]
) -> PicturePrediction:
    frames = diagnosis.frames_of(log)
    check_no_more_pictures(folder, len(frames.paths))
    numbers, errors = list[int](), list[float]()
    for part in diagnosis.predict_pictures(log, _robot_of(model, log, catalogue), model.theta):
        for number, picture in zip(part.numbers.tolist(), part.pictures, strict=True):
            write_picture(folder / (diagnosis.PICTURES % number), picture)
        numbers += part.numbers.tolist()
        errors += part.grey_errors.tolist()
        tell(f"drawing: {len(numbers)} frames")
    # It comes last, so that a list never names what is not there.
    write_text(folder / "frames.csv", diagnosis.frames_text(log, frames, numbers))
    return PicturePrediction(folder, len(numbers), float(np.mean(errors)))


def _robot_of(model: Model, log: Log, catalogue: Catalogue) -> Robot:
    if is_robot(model.robot, catalogue.folder):
        return diagnosis.robot_of(log, model.robot, catalogue)
    robot = robot_from_geometry(model.robot, model.geometry or log.geometry, log.rate_hz)
    return replace(robot, catalogue=catalogue)
