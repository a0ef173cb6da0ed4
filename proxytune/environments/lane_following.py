"""Lane following as a Gymnasium environment: picture in, duties out, the episodes that a study scores.

θ is fixed or drawn from intervals at each reset; rewards add up to the task's distance; what is rendered is the
camera's picture beside the map from above with the robot's way.
"""

import difflib
import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import gymnasium
import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw

from proxytune import driving
from proxytune.domain import Episode, make_episode
from proxytune.effects import Signal, parameter_hint
from proxytune.errors import InputError
from proxytune.settings import Section, nearest
from proxytune.space import Parameter

ROWS = 480
"""Height of what is rendered [pixel]."""
WAY, ROBOT = (235, 70, 60), (70, 160, 255)
"""Colours of the robot's way and of the robot."""
ARROW_M = 0.09
"""From the middle of the robot to the tip of what is drawn of it [m]."""


def render(picture: driving.Picture, road: driving.Road, poses: Signal) -> NDArray[np.uint8]:
    """What the camera sees (rows, columns, 3) beside the map with the robot's way until now (ticks, 3).

    Red, green, blue, (ROWS, columns, 3); the number of columns is even, as video encoders ask for.
    """
    seen = Image.fromarray(picture)
    seen = seen.resize((_even(ROWS * seen.width / seen.height), ROWS), Image.Resampling.NEAREST)
    above, scale = _map(road), ROWS / road.size[1]
    draw, way = ImageDraw.Draw(above), poses[:, :2] * (scale, -scale) + (0.0, ROWS)
    draw.line([(float(x), float(y)) for x, y in way], fill=WAY, width=3)
    angles = poses[-1, 2] + np.radians((0.0, 140.0, 220.0))
    corners = way[-1] + ARROW_M * scale * np.stack((np.cos(angles), -np.sin(angles)), axis=-1)
    draw.polygon([(float(x), float(y)) for x, y in corners], fill=ROBOT, outline=(255, 255, 255))
    return np.concatenate((np.asarray(seen), np.asarray(above)), axis=1)


def _map(road: driving.Road) -> Image.Image:
    """The map seen from above, north up."""
    floor = driving.draw_floor(road)
    columns, rows = (
        slice(*(round((end - floor.origin) * floor.pixels_per_metre) for end in (0.0, s))) for s in road.size
    )
    above = Image.fromarray(np.ascontiguousarray(floor.pixels[rows, columns][::-1]))
    return above.resize((_even(ROWS * road.size[0] / road.size[1]), ROWS), Image.Resampling.BOX)


def _even(number: float) -> int:
    return 2 * round(number / 2.0)


ValueRange = tuple[float, float]


def read_theta(given: Mapping[str, Any], known: Mapping[str, Parameter]) -> dict[str, ValueRange]:
    """The interval of each parameter, given as a number, or low and high; of no width where its value is fixed."""
    if not isinstance(given, Mapping):
        raise InputError(f"theta: must give a value or [low, high] by parameter, got {given!r}")
    return {name: _interval(name, value, known) for name, value in given.items()}


def _interval(name: str, value: Any, known: Mapping[str, Parameter]) -> ValueRange:
    if name not in known:
        hint = parameter_hint(name, known)
        if hint.startswith("known are"):  # Seventy names are no hint
            alike = ", ".join(difflib.get_close_matches(name, list(known), cutoff=0.0))
            hint = f"nearest are {alike}; `python -m proxytune list effects` has all"
        raise InputError(f"theta: unknown parameter '{name}'; {hint}")
    parameter, ends = known[name], _numbers(value)
    if len(ends) not in (1, 2) or not all(math.isfinite(end) for end in ends):
        raise InputError(f"theta: {name} must be a finite number or [low, high], got {value!r}")
    if ends[0] > ends[-1]:
        raise InputError(f"theta: {name}: the lower bound must come first, got {value!r}")
    if ends[0] < parameter.low or ends[-1] > parameter.high:
        raise InputError(f"theta: {name} must lie within [{parameter.low:g}, {parameter.high:g}], got {value!r}")
    return ends[0], ends[-1]


def _numbers(value: Any) -> list[float]:
    """The numbers of a value, none where it is not made of numbers."""
    listed = isinstance(value, Sequence | np.ndarray) and not isinstance(value, str)
    try:
        return [float(number) for number in (value if listed else [value])]
    except (TypeError, ValueError):
        return []


TICK_S = 1.0 / driving.TICK_HZ


class Tally:
    """Adds up the parts of a drive from a starting pose (3,), each scored as the task scores a whole one."""

    def __init__(self, road: driving.Road, seconds: float, start: Signal) -> None:
        self._road, self._seconds = road, seconds
        self._parts: list[Signal] = [start[None]]
        self._ticks, self._distance, self._aside = 0, 0.0, 0.0

    @property
    def poses(self) -> Signal:
        """The start, then the pose after every tick, (ticks + 1, 3)."""
        return np.concatenate(self._parts)

    def add(self, poses: Signal) -> float:
        """The distance [m] along the lane in the next ticks' poses (ticks, 3)."""
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
        """Every metric of the drive as a study scores it."""
        return self._score(self.poses, self._seconds)

    def _score(self, poses: Signal, seconds: float) -> dict[str, float]:
        return driving.score_trajectory(self._road, poses, tick_s=TICK_S, seconds=seconds)


OPTIONS = ("theta", "start", "episode_seed")
"""What `reset` may be told of the episode."""
OWN_KEYS = ("theta", "start", "model", "folder", "render_mode")
"""What the environment may be told besides the keys of a `[domain]` table."""
SEEDS = 2**32
"""How many seeds of episodes there are, as in a study."""


class _EpisodeUnderWay(NamedTuple):
    """An episode under way."""

    plant: driving.Plant
    course: driving.Course
    rollouts: driving.Rollouts
    tally: Tally


class LaneFollowingEnv(gymnasium.Env[driving.Picture, NDArray[Any]]):
    """One robot that is to follow its lane: the episodes that a study scores, one control step at a time.

    Observation: the camera's newest picture, (rows, columns, 3), uint8. Action: duties of the left and right wheel, of
    a car throttle and steering, each in [−1, 1]; what lies beyond is clipped. A step holds it for one control step.

    Reward: metres along the lane's centre line in its direction in this step, counted while in the lane, as the task's
    metric `distance`: an episode's rewards add up to it.

    Terminated when the robot leaves the map or hits something, truncated when time is over.

    Info: `pose` (3,), x [m], y [m] and heading [rad]; `distance` [m], `survival_time` [s] and mean `deviation` [m]
    until now. After the last step the task's other metrics join them, and all are what a study scores. `reset` also
    says `theta`, `start` and `episode_seed`, which make the same episode again in a study or by options of `reset`.

    Args:
        theta: By a parameter's name its value, or [low, high] to draw from evenly at each reset; others are nominal.
        start: Index of the map's starting pose; drawn at each reset if not given.
        model: A model.toml whose robot and effects it has, as that of a target.
        folder: Where a user's own robots, effects and maps lie.
        render_mode: "rgb_array" for the camera's picture beside the map from above, or None.
        domain: Keys of a study's `[domain]` table: robot, plant, camera, map, seconds, position_noise_m,
            heading_noise_deg, effects.

    Raises:
        InputError: If there is no such robot, plant, map, parameter or start.
    """

    metadata: dict[str, Any] = {"render_modes": ["rgb_array"], "render_fps": 20}  # noqa: RUF012 - as in gymnasium

    def __init__(
        self,
        *,
        theta: Mapping[str, Any] | None = None,
        start: int | None = None,
        model: str | Path | None = None,
        folder: str | Path = ".",
        render_mode: str | None = None,
        **domain: Any,
    ) -> None:
        plain = {key: str(value) if isinstance(value, Path) else value for key, value in domain.items()}
        table = Section(Path(folder) / LaneFollowingEnv.__name__, "", plain)
        table.only((*driving.DOMAIN_KEYS, *OWN_KEYS))
        self.family = driving.lane_following(table, model=Path(model) if model else None)
        self._theta = read_theta(theta or {}, self.family.parameters)
        self._start = None if start is None else _whole("start", start, self.family.starts)
        if render_mode not in (None, *self.metadata["render_modes"]):
            raise InputError(f"render_mode: unknown value {render_mode!r}; use 'rgb_array' or None")
        self.render_mode = render_mode
        robot = self.family.instance({}).robot
        self.metadata = {**self.metadata, "render_fps": round(robot.figures["control_rate"])}
        self._control_hz = robot.figures["control_rate"]
        camera = robot.camera_figures()
        self.observation_space = gymnasium.spaces.Box(0, 255, (camera.rows, camera.columns, 3), np.uint8)
        self.action_space = gymnasium.spaces.Box(-1.0, 1.0, (2,), np.float32)
        self._drive: _EpisodeUnderWay | None = None
        self._step, self._over = 0, True

    def reset(
        self, *, seed: int | None = None, options: Mapping[str, Any] | None = None
    ) -> tuple[driving.Picture, dict[str, Any]]:
        """Put the robot down for another episode.

        Args:
            seed: Of the starts, placements and effects of this episode and of those after it.
            options: For this episode alone: `theta` as in the constructor, whose other parameters it leaves as they
                are; `start`; and `episode_seed`, the seed of everything random in a study's episode.

        Raises:
            InputError: If there is no such option, parameter or start.
        """
        super().reset(seed=seed)
        episode = self._episode(options or {})
        self.close()
        instance = self.family.instance(dict(episode.theta))
        course = self.family.course(episode, self.family.seconds)
        plant = self.family.plant_at(instance.robot, course.start)
        tally = Tally(self.family.map, self.family.seconds, course.start)
        rollouts = driving.Rollouts([instance], [course], driving.Plants([plant]))
        self._drive = _EpisodeUnderWay(plant, course, rollouts, tally)
        self._step, self._over = 0, False
        told = {"theta": dict(episode.theta), "start": episode.start, "episode_seed": episode.seed}
        return self._picture(), {**self._info(), **told}

    def step(self, action: NDArray[Any]) -> tuple[driving.Picture, float, bool, bool, dict[str, Any]]:
        """Hold two duties for one control step.

        Raises:
            InputError: If there is no episode under way.
            EpisodeError: If the action is not two finite duties, or the plant cannot follow it.
        """
        drive = self._under_way()
        if self._over:
            raise InputError("the episode is over; call reset() for another one")
        command = driving.command_of(action, self._step / self._control_hz)
        drive.rollouts.step(command[None])
        self._step += 1
        [poses], [crashed] = drive.rollouts.poses, drive.rollouts.crashed
        reward = drive.tally.add(poses)
        terminated = crashed or any(drive.course.ended(x, y) for x, y, _ in poses.tolist())
        truncated = not terminated and self._step >= drive.rollouts.steps
        self._over = terminated or truncated
        return self._picture(), reward, terminated, truncated, self._info()

    def render(self) -> NDArray[np.uint8] | None:
        """The camera's picture beside the map with the robot's way, (480, columns, 3); None without a render_mode."""
        if self.render_mode is None:
            return None
        drive = self._under_way()
        return render(drive.rollouts.pictures()[0], self.family.map, drive.tally.poses)

    def close(self) -> None:
        """End the plant's world; once is enough, twice does no harm."""
        if self._drive is not None:
            self._drive.plant.__exit__(None, None, None)
        self._drive = None

    def _episode(self, options: Mapping[str, Any]) -> Episode:
        """The next episode; the same draws are made whatever is fixed."""
        for name in options:
            if name not in OPTIONS:
                raise InputError(f"options: unknown '{name}'; {nearest(name, OPTIONS)}")
        drawn = {"start": self.np_random.integers(self.family.starts), "episode_seed": self.np_random.integers(SEEDS)}
        fixed = {} if self._start is None else {"start": self._start}
        chosen = {**drawn, **fixed, **options}
        intervals = {**self._theta, **read_theta(options.get("theta", {}), self.family.parameters)}
        start = _whole("start", chosen["start"], self.family.starts)
        seed = _whole("episode_seed", chosen["episode_seed"], SEEDS)
        theta = {name: float(self.np_random.uniform(*intervals[name])) for name in sorted(intervals)}
        return make_episode(theta, agent="-", start=start, seed=seed)

    def _under_way(self) -> _EpisodeUnderWay:
        if self._drive is None:
            raise InputError("no episode is under way; call reset() first")
        return self._drive

    def _picture(self) -> driving.Picture:
        """A copy: the camera is slower than the commands, so two steps may see one picture."""
        return np.array(self._under_way().rollouts.pictures()[0])

    def _info(self) -> dict[str, Any]:
        drive = self._under_way()
        scores = drive.tally.whole() if self._over else drive.tally.so_far()
        return {"pose": drive.rollouts.poses[0, -1].copy(), **scores}


def _whole(name: str, value: Any, count: int) -> int:
    if isinstance(value, bool) or not isinstance(value, int | np.integer) or not 0 <= value < count:
        raise InputError(f"{name}: must be a whole number from 0 to {count - 1}, got {value!r}")
    return int(value)
