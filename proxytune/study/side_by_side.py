"""One episode in proxy and target: the same agent from the same start under the same seed."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from proxytune.domain import DomainFamily, Episode
from proxytune.driving.road.maps import Road
from proxytune.errors import InputError
from proxytune.settings import read_settings
from proxytune.study.family import load_family
from proxytune.study.settings import StudySettings
from proxytune.study.single_episode import RecordedEpisode, record_episode

APART_M = 0.05
"""Proxy and target have parted once their robots are so far from each other [m]."""


@dataclass(frozen=True, eq=False)
class SideBySide:
    """An episode in the proxy and, where there is one to drive in, in the target.

    Attributes:
        episode: Which one; its θ is the proxy's.
        units: The family's metrics with their units.
        road: The map, where robots drive on one of ours.
        proxy: What became of it in the proxy.
        target: What became of it in the target, None if there is none.
    """

    episode: Episode
    units: Mapping[str, str]
    road: Road | None
    proxy: RecordedEpisode
    target: RecordedEpisode | None

    @property
    def command_unit(self) -> str:
        """What commands are given in, empty where that is not known: on our roads wheels are given duties."""
        return "" if self.road is None else "duty"

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
    proxy: DomainFamily, target: DomainFamily | None, episode: Episode, *, filmed: bool = False
) -> SideBySide:
    """Run an episode in the proxy at its θ, and in the target as that is.

    Raises:
        EpisodeError: If agent or domain fail in either.
    """
    road = getattr(proxy, "map", None)
    there = None if target is None else record_episode(target, replace(episode, theta=()), filmed=filmed)
    here = record_episode(proxy, episode, filmed=filmed)
    return SideBySide(episode, proxy.metrics, road if isinstance(road, Road) else None, here, there)


def load_target(settings: StudySettings, proxy: DomainFamily, model: Path, option: str) -> DomainFamily:
    """The study's domain as a model.toml describes it.

    Args:
        settings: Of the study.
        proxy: The study's own family.
        model: The model.toml.
        option: What named it, for complaints.

    Raises:
        InputError: If there is no such model, or it is of another robot.
    """
    check_robot(proxy, model, option)
    return load_family(settings, model)


def check_robot(family: DomainFamily, model: Path, option: str) -> None:
    """Refuse a model of another robot than the family's.

    Raises:
        InputError: If there is no such model, or it is of another robot.
    """
    if not model.is_file():
        raise InputError(f"{option} {model}: no such file; check the path")
    robot = getattr(family, "robot", None)
    stated = read_settings(model).values.get("robot", robot)
    if robot is not None and stated != robot:
        raise InputError(
            f"{option} {model}: is of the robot '{stated}'; give a model of '{robot}', which the study drives"
        )
