"""Logs of a simulated domain: driven through manoeuvres and measured as a robot's would be (`record`).

`film` lets the robot's expert drive along the lanes, with the pictures that its camera takes on the way.
"""

import functools
import math
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd
import tomlkit
from numpy.typing import NDArray

from proxytune import driving
from proxytune.diagnosis.motion.drives import Floats, duties_of
from proxytune.diagnosis.motion.manoeuvres import LIBRARY, commands_of, mirrored
from proxytune.effects import Blur, RollingShutter
from proxytune.errors import EpisodeError
from proxytune.logs import COMMANDS, Frames, Log, LogEpisode

POSITION_NOISE_M = 0.002
HEADING_NOISE_RAD = 0.005
"""White noise of a measured pose, as a tracker above the floor has it."""

PICTURES = "frames/%06d.png"
"""Where a log's pictures lie in its folder."""
CAMERA = {
    "frames": PICTURES,
    "exposure": "fixed",
    "poses": {"position_m": POSITION_NOISE_M, "heading_deg": round(math.degrees(HEADING_NOISE_RAD), 4)},
}
"""What log.toml states of the pictures: no effect adjusts the exposure from one to the next."""
Table = tuple[str, str, Mapping[str, tuple[Floats, Floats]]]
"""Where it lies, and what `proxytune.logs.read_commands` gives: kind of commands, times [s] and commands by drive."""


def record(
    family: driving.LaneFollowing, *, name: str, repeats: int, seconds: float, seed: int, table: Table | None = None
) -> Log:
    """Drive every manoeuvre so many times, each time at another size and to the other side; or the drives of a table.

    Args:
        family: The domain; its effects are what is recorded.
        name: What the log is called.
        repeats: Drives of each manoeuvre, or of each drive of the table.
        seconds: Length of a manoeuvre [s].
        seed: Of sizes, starts and noise.
        table: Commands to drive as they are instead of manoeuvres.

    Raises:
        LogError: If the table's commands are not for the robot.
    """
    robot = driving.read_robot(family.robot, family.folder)
    rate = robot.figures["control_rate"]
    times = np.arange(round(seconds * rate)) / rate
    instance = family.instance({})
    own = [] if table is None else _duties(Log(table[0], family.robot, table[1], rate, {}, ()), robot, table[2])
    episodes = []
    for number in range(repeats * (len(own) or len(LIBRARY))):
        random = np.random.default_rng((seed, number))
        if own:
            sized = own[number % len(own)]
            times = np.arange(len(sized)) / rate
        else:
            sized = commands_of(LIBRARY[number % len(LIBRARY)][2], times, robot) * random.uniform(0.75, 1.0)
            if number // len(LIBRARY) % 2 == 1:
                sized = mirrored(sized, robot)
        commands = np.asarray(np.round(sized, 4), dtype=float)
        start = np.array((0.0, 0.0, random.uniform(-np.pi, np.pi)))
        with family.plant_at(instance.robot, start) as plant:
            poses = tracked(driving.follow(instance, plant, start, commands, number), random)
        episodes.append(LogEpisode(str(number), times, commands, poses, None))
    return Log(name, family.robot, KIND[robot.drive], rate, {}, tuple(episodes))


def _duties(log: Log, robot: driving.Robot, drives: Mapping[str, tuple[Floats, Floats]]) -> list[Floats]:
    """The drives of a table as what the robot is given at each control step (rows, 2); the last command lasts one."""
    found = []
    for times, commands in drives.values():
        held = np.arange(max(2, round((times[-1] - times[0]) * log.rate_hz) + 1)) / log.rate_hz + times[0]
        found.append(duties_of(log, robot, commands)[np.searchsorted(times, held + 1e-6, side="right") - 1])
    return found


KIND = {"differential": "duty", "ackermann": "ackermann"}
"""Kind of the commands that robots are given, by how they drive."""


def tracked(poses: Floats, random: np.random.Generator) -> Floats:
    """Poses (rows, 3) as a tracker measures them: with white noise."""
    noise = random.standard_normal(poses.shape) * (POSITION_NOISE_M, POSITION_NOISE_M, HEADING_NOISE_RAD)
    return np.asarray(poses + noise)


def log_text(log: Log, source: str) -> str:
    """A log.toml for a recorded log."""
    pose = f"x, y with {POSITION_NOISE_M:g} m, heading with {HEADING_NOISE_RAD:g} rad of white noise (1 sigma)"
    facts = {"format": 1, "name": log.name, "robot": log.robot, "command": log.command, "rate_hz": log.rate_hz}
    facts |= {"pose": pose, "measured": False, "source": source}
    facts |= {"map": Path(log.frames.road).name, "camera": CAMERA} if log.frames else {}
    return tomlkit.dumps(facts)


def samples_text(log: Log) -> str:
    """A samples.csv for a recorded log."""
    columns = ("time", *COMMANDS[log.command], "x", "y", "heading")
    tables = [
        pd.DataFrame(np.column_stack((e.times, e.commands, e.poses)), columns=columns).assign(episode=e.name)
        for e in log.episodes
    ]
    return pd.concat(tables)[["episode", *columns]].to_csv(index=False, float_format="%.4f", lineterminator="\n")


def frames_text(log: Log, frames: Frames, numbers: Sequence[int], float_format: str | None = None) -> str:
    """A frames.csv for pictures of these of a log's frames, numbered as they come, from 0."""
    chosen = list(numbers)
    names = [log.episodes[drive].name for drive in frames.drives[chosen]]
    table = pd.DataFrame({"frame": chosen, "episode": names, "time": frames.times[chosen]})
    return table.to_csv(index=False, float_format=float_format, lineterminator="\n")


COLUMNS = 160
"""What agents are shown is too coarse for a diagnosis, so the camera is given so many columns where it has fewer."""
FRAMES_HZ = 2.0
"""About how many pictures are taken in a second."""
SHORTEST_S, LONGEST_S = 5.0, 20.0
"""How long a lane drive lasts [s]: in 5 s it comes from a straight into a bend, or out of one."""
LANES = 1
"""Tells the seeds of lane drives from those of manoeuvres."""


class FilmedDrive(NamedTuple):
    """A lane drive with n pictures."""

    episode: LogEpisode  # commands, and the measured pose at each
    # middle of each exposure (n,) [s]: half the blur and half the readout before the picture was finished
    times: Floats
    pictures: NDArray[np.uint8]  # red, green and blue (n, rows, columns, 3), all effects of the instance in them


class _Lap(NamedTuple):
    """One drive to come: its number, its start, whether it goes the other way from there, and pictures to take."""

    number: int
    start: int
    turned: bool
    frames: int


def film(family: driving.LaneFollowing, frames: int, seed: int) -> Iterator[FilmedDrive]:
    """Let the robot's expert drive from every start, then from each the other way, and take so many pictures in all.

    A SettingsError without expert or camera, before anything is driven; an EpisodeError from a drive that ends early.
    """
    instance = family.instance({}, columns=COLUMNS)
    instance.robot.expert_figures()
    return (_film_drive(family, instance, lap, seed) for lap in _laps(frames, family.starts))


def _laps(frames: int, starts: int) -> Iterator[_Lap]:
    """Pictures shared out evenly; there are as many rounds of all starts as keep drives short."""
    both_ways = 2 * starts
    rounds = math.ceil(frames / (both_ways * LONGEST_S * FRAMES_HZ))
    drives = min(frames, rounds * both_ways)
    for number in range(drives):
        share = (number + 1) * frames // drives - number * frames // drives
        yield _Lap(number, number % starts, number // starts % 2 == 1, share)


def _film_drive(family: driving.LaneFollowing, instance: driving.Instance, lap: _Lap, seed: int) -> FilmedDrive:
    random = np.random.default_rng((seed, lap.number, LANES))
    own = int(random.integers(2**32))
    noise = {"position_noise_m": family.position_noise_m, "heading_noise_deg": family.heading_noise_deg}
    start = np.array(driving.start_pose(family.map, lap.start, seed=own, **noise))
    if lap.turned:  # in the middle of the lane that it then looks along
        heading = start[2] + math.pi
        other = driving.lane_pose(family.map, start[:2], heading)
        start = np.array((*driving.lane_point(family.map, other.counter_clockwise, other.along), heading))
    seconds = max(SHORTEST_S, lap.frames / FRAMES_HZ)
    course = driving.Course(start, seconds, own, functools.partial(driving.off_map, family.map))
    expert = driving.Expert(family.map, *instance.robot.expert_figures(), seed=own)
    with family.plant_at(instance.robot, start) as plant:
        driven = driving.drive(instance, plant, expert, course, driving.Sight)
    steps, times = _instants(instance, driven, lap)
    rate, rows = instance.robot.figures["control_rate"], len(driven.commands)
    poses = tracked(driving.measured(instance, driven.poses, own)[:: round(driving.TICK_HZ / rate)][:rows], random)
    episode = LogEpisode(f"lane_{lap.number}", np.arange(rows) / rate, driven.commands, poses, None)
    return FilmedDrive(episode, times, np.stack([driven.memory.pictures[step] for step in steps]))


def _instants(instance: driving.Instance, driven: driving.Drive, lap: _Lap) -> tuple[list[int], Floats]:
    """Control steps at which the newest picture is another one, spread over the drive, and when it was exposed [s]."""
    hold, every = (round(driving.TICK_HZ / instance.robot.figures[rate]) for rate in ("control_rate", "camera_rate"))
    finished = np.arange(len(driven.commands)) * hold // every * every
    fresh = np.flatnonzero(np.diff(finished, prepend=0) > 0)
    if len(fresh) < lap.frames:
        ended = f"ended after {len(driven.commands) * hold / driving.TICK_HZ:.2f} s"
        problem = f"lane drive from start {lap.start} {ended} with {len(fresh)} of {lap.frames} pictures"
        raise EpisodeError(f"{problem}; record fewer frames, or correct the model")
    steps = fresh[(np.arange(lap.frames) + 1) * len(fresh) // lap.frames - 1]
    # The middle of a picture's exposure, that of its middle row, is half of both before it is finished.
    lasting = {Blur.name: "blur", RollingShutter.name: "readout"}
    parts = [getattr(effect, lasting[effect.name]) for effect in instance.image.effects if effect.name in lasting]
    return steps.tolist(), finished[steps] / driving.TICK_HZ - float(sum(parts)) / 2.0
