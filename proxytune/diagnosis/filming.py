"""Lane drives of a domain instance, with the pictures that its camera takes on the way."""

import functools
import math
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from proxytune.diagnosis.measured.drives import Floats
from proxytune.diagnosis.recording import tracked
from proxytune.driving.episode import TICK_HZ, Course, Drive, Instance, Sight, drive, measured
from proxytune.driving.expert import Expert
from proxytune.driving.lane_following import LaneFollowing
from proxytune.driving.road.lane import lane_point, lane_pose, off_map
from proxytune.driving.road.maps import Road
from proxytune.driving.task import start_pose
from proxytune.effects.sight.shutter import Blur, RollingShutter
from proxytune.errors import EpisodeError
from proxytune.logs import LogEpisode

COLUMNS = 160
"""What agents are shown is too coarse for a diagnosis, so the camera is given so many columns where it has fewer."""

FRAMES_HZ = 2.0
"""About how many pictures are taken in a second."""

SHORTEST_S, LONGEST_S = 5.0, 20.0
"""How long a lane drive lasts [s]: in 5 s it comes from a straight into a bend, or out of one."""

LANES = 1
"""Tells the seeds of lane drives from those of manoeuvres."""


class FilmedDrive(NamedTuple):
    """A lane drive with n pictures.

    Attributes:
        episode: Commands, and the measured pose at each.
        times: Middle of each exposure (n,) [s]: half the blur and half the readout before the picture was finished.
        pictures: Red, green and blue (n, rows, columns, 3), all effects of the instance in them.
    """

    episode: LogEpisode
    times: Floats
    pictures: NDArray[np.uint8]


class _Lap(NamedTuple):
    """One drive to come: its number, its start, whether it goes the other way from there, and pictures to take."""

    number: int
    start: int
    turned: bool
    frames: int


def film(family: LaneFollowing, frames: int, seed: int) -> Iterator[FilmedDrive]:
    """Let the robot's expert drive from every start, then from each the other way, and take pictures.

    Args:
        family: The domain, whose expert drives in the right-hand lane with its disturbances.
        frames: How many pictures there are in all.
        seed: Of starts, disturbances and effects.

    Raises:
        SettingsError: If the robot has no expert or no camera, before anything is driven.
        EpisodeError: From the drives, if one ends before its pictures are taken.
    """
    instance = family.instance({}, columns=COLUMNS)
    instance.robot.expert_figures()
    return (_drive(family, instance, lap, seed) for lap in _laps(frames, family.starts))


def _laps(frames: int, starts: int) -> Iterator[_Lap]:
    """Pictures shared out evenly; there are as many rounds of all starts as keep drives short."""
    both_ways = 2 * starts
    rounds = math.ceil(frames / (both_ways * LONGEST_S * FRAMES_HZ))
    drives = min(frames, rounds * both_ways)
    for number in range(drives):
        share = (number + 1) * frames // drives - number * frames // drives
        yield _Lap(number, number % starts, number // starts % 2 == 1, share)


def _drive(family: LaneFollowing, instance: Instance, lap: _Lap, seed: int) -> FilmedDrive:
    random = np.random.default_rng((seed, lap.number, LANES))
    own = int(random.integers(2**32))
    noise = {"position_noise_m": family.position_noise_m, "heading_noise_deg": family.heading_noise_deg}
    start = np.array(start_pose(family.map, lap.start, seed=own, **noise))
    start = _in_other_lane(family.map, start) if lap.turned else start
    seconds = max(SHORTEST_S, lap.frames / FRAMES_HZ)
    course = Course(start, seconds, own, functools.partial(off_map, family.map))
    expert = Expert(family.map, *instance.robot.expert_figures(), seed=own)
    with family.plant_at(instance.robot, start) as plant:
        driven = drive(instance, plant, expert, course, Sight)
    steps, times = _instants(instance, driven, lap)
    rate, rows = instance.robot.figures["control_rate"], len(driven.commands)
    poses = tracked(measured(instance, driven.poses, own)[:: round(TICK_HZ / rate)][:rows], random)
    episode = LogEpisode(f"lane_{lap.number}", np.arange(rows) / rate, driven.commands, poses, None)
    return FilmedDrive(episode, times, np.stack([driven.memory.pictures[step] for step in steps]))


def _in_other_lane(road: Road, pose: Floats) -> Floats:
    """The pose turned round, in the middle of the lane that it then looks along."""
    heading = pose[2] + math.pi
    other = lane_pose(road, pose[:2], heading)
    return np.array((*lane_point(road, other.counter_clockwise, other.along), heading))


def _instants(instance: Instance, driven: Drive, lap: _Lap) -> tuple[list[int], Floats]:
    """Control steps at which the newest picture is another one, spread over the drive, and when it was exposed [s]."""
    hold, every = (round(TICK_HZ / instance.robot.figures[rate]) for rate in ("control_rate", "camera_rate"))
    finished = np.arange(len(driven.commands)) * hold // every * every
    fresh = np.flatnonzero(np.diff(finished, prepend=0) > 0)
    if len(fresh) < lap.frames:
        seconds = len(driven.commands) * hold / TICK_HZ
        raise EpisodeError(
            f"lane drive from start {lap.start} ended after {seconds:.2f} s with {len(fresh)} of {lap.frames} "
            "pictures; record fewer frames, or correct the model"
        )
    steps = fresh[(np.arange(lap.frames) + 1) * len(fresh) // lap.frames - 1]
    return steps.tolist(), finished[steps] / TICK_HZ - _middle(instance)


def _middle(instance: Instance) -> float:
    """How long before a picture is finished the middle of its exposure is, that of its middle row [s]."""
    lasting = {Blur.name: "blur", RollingShutter.name: "readout"}
    parts = [getattr(effect, lasting[effect.name]) for effect in instance.image.effects if effect.name in lasting]
    return float(sum(parts)) / 2.0
