"""The lane-following domain as a Gymnasium environment: picture in, duties out."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

import gymnasium
import numpy as np
from numpy.typing import NDArray

from proxytune.domain import Episode, make_episode
from proxytune.driving.agents import Picture
from proxytune.driving.episode import Course, Rollout, check_command
from proxytune.driving.family import lane_following
from proxytune.driving.lane_following import LaneFollowing
from proxytune.driving.plant import Plant
from proxytune.environments.drawing import render
from proxytune.environments.randomisation import draw_theta, read_theta
from proxytune.environments.tally import Tally
from proxytune.errors import InputError
from proxytune.settings import Section, nearest

OPTIONS = ("theta", "start", "episode_seed")
"""What `reset` may be told of the episode."""

SEEDS = 2**32
"""How many seeds of episodes there are, as in a study."""


class _Drive(NamedTuple):
    """An episode under way."""

    plant: Plant
    course: Course
    rollout: Rollout
    tally: Tally


class LaneFollowingEnv(gymnasium.Env[Picture, NDArray[Any]]):
    """One robot that is to follow its lane: the episodes that a study scores, one control step at a time.

    Observation: the camera's newest picture, (rows, columns, 3), uint8. Action: duties of the left and right wheel,
    each in [−1, 1]; what lies beyond is clipped. A step holds it for one control step of the robot.

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
        self.family = _family(domain, model, Path(folder))
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
        self._drive: _Drive | None = None
        self._step, self._over = 0, True

    def reset(
        self, *, seed: int | None = None, options: Mapping[str, Any] | None = None
    ) -> tuple[Picture, dict[str, Any]]:
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
        self._drive = _Drive(plant, course, Rollout(instance, plant, course), tally)
        self._step, self._over = 0, False
        told = {"theta": dict(episode.theta), "start": episode.start, "episode_seed": episode.seed}
        return self._picture(), {**self._info(), **told}

    def step(self, action: NDArray[Any]) -> tuple[Picture, float, bool, bool, dict[str, Any]]:
        """Hold two duties for one control step.

        Raises:
            InputError: If there is no episode under way.
            EpisodeError: If the action is not two finite duties, or the plant cannot follow it.
        """
        drive = self._under_way()
        if self._over:
            raise InputError("the episode is over; call reset() for another one")
        command = np.asarray(action, dtype=float)
        check_command(command, self._step / self._control_hz)
        drive.rollout.step(command)
        self._step += 1
        reward = drive.tally.add(drive.rollout.poses)
        terminated = drive.rollout.crashed or any(drive.course.ended(x, y) for x, y, _ in drive.rollout.poses.tolist())
        truncated = not terminated and self._step >= drive.rollout.steps
        self._over = terminated or truncated
        return self._picture(), reward, terminated, truncated, self._info()

    def render(self) -> NDArray[np.uint8] | None:
        """The camera's picture beside the map with the robot's way, (480, columns, 3); None without a render_mode."""
        if self.render_mode is None:
            return None
        drive = self._under_way()
        return render(drive.rollout.picture, self.family.map, drive.tally.poses)

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
        return make_episode(draw_theta(intervals, self.np_random), agent="-", start=start, seed=seed)

    def _under_way(self) -> _Drive:
        if self._drive is None:
            raise InputError("no episode is under way; call reset() first")
        return self._drive

    def _picture(self) -> Picture:
        """A copy: the camera is slower than the commands, so two steps may see one picture."""
        return self._under_way().rollout.picture.copy()

    def _info(self) -> dict[str, Any]:
        drive = self._under_way()
        scores = drive.tally.whole() if self._over else drive.tally.so_far()
        return {"pose": drive.rollout.poses[-1].copy(), **scores}


def _family(domain: Mapping[str, Any], model: str | Path | None, folder: Path) -> LaneFollowing:
    plain = {key: str(value) if isinstance(value, Path) else value for key, value in domain.items()}
    return lane_following(Section(folder / LaneFollowingEnv.__name__, "", plain), model=Path(model) if model else None)


def _whole(name: str, value: Any, count: int) -> int:
    if isinstance(value, bool) or not isinstance(value, int | np.integer) or not 0 <= value < count:
        raise InputError(f"{name}: must be a whole number from 0 to {count - 1}, got {value!r}")
    return int(value)
