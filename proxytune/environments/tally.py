"""The task's metrics of an episode under way."""

import numpy as np

from proxytune.driving import task
from proxytune.driving.episode import TICK_HZ
from proxytune.driving.road.maps import Road
from proxytune.effects import Signal

TICK_S = 1.0 / TICK_HZ


class Tally:
    """Adds up the parts of a drive, each scored as the task scores a whole one.

    Args:
        road: The map.
        seconds: When time is over [s].
        start: Starting pose (3,): x [m], y [m], heading [rad].
    """

    def __init__(self, road: Road, seconds: float, start: Signal) -> None:
        self._road, self._seconds = road, seconds
        self._parts: list[Signal] = [start[None]]
        self._ticks, self._distance, self._aside = 0, 0.0, 0.0

    @property
    def poses(self) -> Signal:
        """The start, then the pose after every tick, (ticks + 1, 3)."""
        return np.concatenate(self._parts)

    def add(self, poses: Signal) -> float:
        """The distance [m] along the lane in the next ticks' poses (ticks, 3).

        Raises:
            EpisodeError: If a pose is not finite.
        """
        part = self._score(np.concatenate((self._parts[-1][-1:], poses)), self._seconds - self._ticks * TICK_S)
        ticks = round(part["survival_time"] / TICK_S)
        self._parts.append(poses)
        self._ticks += ticks
        self._distance += part["distance"]
        self._aside += part["deviation"] * ticks
        return part["distance"]

    def so_far(self) -> dict[str, float]:
        """The distance, survival time and mean deviation until now."""
        deviation = self._aside / self._ticks if self._ticks else self.whole()["deviation"]
        return {"distance": self._distance, "survival_time": self._ticks * TICK_S, "deviation": deviation}

    def whole(self) -> dict[str, float]:
        """Every metric of the drive as a study scores it.

        Raises:
            EpisodeError: If a pose is not finite.
        """
        return self._score(self.poses, self._seconds)

    def _score(self, poses: Signal, seconds: float) -> dict[str, float]:
        return task.score_trajectory(self._road, poses, tick_s=TICK_S, seconds=seconds)
