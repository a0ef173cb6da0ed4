"""One episode to look at: its scores, and what moved, was commanded and was seen, in proxy and target alike."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from proxytune.domain import DomainFamily, Episode, Recording
from proxytune.effects import is_learnt, parameter_hint
from proxytune.errors import EpisodeError, InputError
from proxytune.running import run_episode
from proxytune.settings import check_numbers, read_settings
from proxytune.space import Theta
from proxytune.study.settings import StudySettings
from proxytune.study.study_run import failure_of

Columns = Mapping[str, NDArray[np.float64]]


@dataclass(frozen=True, eq=False)
class RecordedEpisode:
    """What became of one episode."""

    metrics: Mapping[str, float]  # its scores, by name
    # columns by name: `time` [s] and, of a robot on a floor, x, y [m] and heading [rad]; none where the family keeps no
    # poses
    poses: Columns
    commands: Columns  # columns by name: `time` [s] and a channel each; none likewise
    # what the camera saw before each command, (commands, rows, columns, 3); None where nobody asked for pictures, or
    # the family cannot give them
    pictures: NDArray[np.uint8] | None = None

    @property
    def has_places(self) -> bool:
        """Whether it is known where the robot was."""
        return {"time", "x", "y"} <= set(self.poses)

    @property
    def places(self) -> NDArray[np.float64]:
        """Where the robot was at each time of `poses`, (times, 2): x, y [m]."""
        return np.column_stack((self.poses["x"], self.poses["y"]))

    @property
    def seconds(self) -> float:
        """When it ended [s]."""
        return float(self.poses["time"][-1])

    @property
    def channels(self) -> tuple[str, ...]:
        """Names of the commands' channels."""
        return tuple(name for name in self.commands if name != "time")


def check_episode(family: DomainFamily, agent: str, theta: Theta, start: int) -> None:
    """Refuse what the family does not have: an InputError tells what it has."""
    family.check_agent(agent)
    if not 0 <= start < family.starts:
        raise InputError(f"start {start}: the family has {family.starts}; give 0 to {family.starts - 1}")
    check_numbers(theta)
    # A model.toml checks its learnt curves where it is read; a family that is built of effects drives them.
    named = {name: value for name, value in theta.items() if not (is_learnt(name) and hasattr(family, "effects"))}
    for name, value in named.items():
        if (known := family.parameters.get(name)) is None:
            raise InputError(f"θ: unknown parameter '{name}'; {parameter_hint(name, family.parameters)}")
        if not known.low <= value <= known.high:
            raise InputError(f"θ: {name} must lie within [{known.low:g}, {known.high:g}], got {value:g}")


def can_record(family: DomainFamily) -> bool:
    """Whether a family keeps more of an episode than its scores (`domain.Recorder`)."""
    return hasattr(family, "record")


def record_episode(family: DomainFamily, episode: Episode, *, filmed: bool = False) -> RecordedEpisode:
    """Run an episode and keep all that the family shows of it.

    Where pictures are wanted, a family with `replay` gives them: the recorded commands are driven again, which takes as
    long as the episode.

    Raises:
        EpisodeError: If the agent or the domain fails, or columns of its recording do not belong together.
    """
    recorder: Any = _Recorder(family, filmed)
    outcome = run_episode(recorder, episode)
    if outcome.metrics is None:
        raise EpisodeError(failure_of(outcome))
    return RecordedEpisode(outcome.metrics, recorder.kept.poses, recorder.kept.commands, recorder.pictures)


class _Recorder:
    """What running an episode asks of a family, answered by one that records it if it can."""

    def __init__(self, family: Any, filmed: bool) -> None:
        self._family, self._filmed = family, filmed
        self.metrics: Mapping[str, str] = family.metrics
        self.kept = Recording({}, {}, {})
        self.pictures: NDArray[np.uint8] | None = None

    def run(self, episode: Episode) -> Mapping[str, float]:
        """Run the episode, and keep its recording and pictures."""
        if not can_record(self._family):
            return self._family.run(episode)  # type: ignore[no-any-return]
        self.kept = self._family.record(episode)
        _check_columns("poses", self.kept.poses)
        _check_columns("commands", self.kept.commands)
        if self._filmed and hasattr(self._family, "replay"):
            issued = np.column_stack([column for name, column in self.kept.commands.items() if name != "time"])
            pictures = np.asarray(self._family.replay(episode, issued).pictures)
            coloured = pictures.dtype == np.uint8 and pictures.ndim == 4 and pictures.shape[-1] == 3
            self.pictures = pictures if coloured and len(pictures) == len(issued) else None
        return self.kept.metrics


def _check_columns(what: str, columns: Columns) -> None:
    lengths = {len(column) for column in columns.values()}
    if columns and ("time" not in columns or len(lengths) > 1 or not min(lengths)):
        raise EpisodeError(f"record of the domain family: {what} need a column `time` and as many rows in every column")


APART_M = 0.05
"""Proxy and target have parted once their robots are so far from each other [m]."""


@dataclass(frozen=True, eq=False)
class SideBySide:
    """An episode in the proxy and, where there is one to drive in, in the target."""

    episode: Episode  # which one; its θ is the proxy's
    units: Mapping[str, str]  # the family's metrics with their units
    command_unit: str  # what commands are given in, empty where that is not known
    road: Any  # the map to draw ways on, where the family has one (`domain.Recorder`)
    proxy: RecordedEpisode  # what became of it in the proxy
    target: RecordedEpisode | None  # what became of it in the target, None if there is none

    @property
    def sides(self) -> dict[str, RecordedEpisode]:
        """Proxy, and target if there is one, by their names."""
        return {"proxy": self.proxy} if self.target is None else {"proxy": self.proxy, "target": self.target}

    @property
    def parted_s(self) -> float | None:
        """The first time at which the robots are more than APART_M apart [s]; None if never while both drive."""
        if self.target is None or not (self.proxy.has_places and self.target.has_places):
            return None
        times = self.proxy.poses["time"]
        times = times[times <= self.target.seconds]
        there = [np.interp(times, self.target.poses["time"], self.target.poses[name]) for name in ("x", "y")]
        gaps = np.hypot(*(self.proxy.places[: len(times)] - np.column_stack(there)).T)
        return float(times[np.argmax(gaps > APART_M)]) if (gaps > APART_M).any() else None


def drive_side_by_side(
    episode: Episode, *, proxy: DomainFamily, target: DomainFamily | None, filmed: bool = False
) -> SideBySide:
    """Run an episode in the proxy at its θ, and in the target as that is; an EpisodeError if either fails."""
    unit, road = getattr(proxy, "command_unit", ""), getattr(proxy, "road_to_draw", None)
    there = None if target is None else record_episode(target, replace(episode, theta=()), filmed=filmed)
    return SideBySide(episode, proxy.metrics, unit, road, record_episode(proxy, episode, filmed=filmed), there)


def check_robot(family: DomainFamily, model: Path, option: str) -> None:
    """Refuse a model that is not there, or of another robot than the family's, by an InputError."""
    _check_model(getattr(family, "robot", None), model, option)


def check_model(settings: StudySettings, model: Path, option: str) -> None:
    """Refuse a model that is not there, or of another robot than the study's [domain] states, by an InputError."""
    ours = settings.family.startswith("proxytune.driving")  # What a key of theirs says others know
    _check_model(settings.domain.get("robot") if ours else None, model, option)


def _check_model(robot: str | None, model: Path, option: str) -> None:
    if not model.is_file():
        raise InputError(f"{option} {model}: no such file; check the path")
    if robot is not None and (stated := read_settings(model).values.get("robot", robot)) != robot:
        other = f"is of the robot '{stated}'; give a model of '{robot}', which the study drives"
        raise InputError(f"{option} {model}: {other}")
