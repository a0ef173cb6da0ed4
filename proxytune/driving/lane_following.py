"""The lane-following domain family: a robot on a map, its plant, camera and effects."""

import functools
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from proxytune.domain import Demonstration, Episode, Policy, Recording
from proxytune.driving import task
from proxytune.driving.agents import Picture
from proxytune.driving.agents.loading import load_agent
from proxytune.driving.agents.playback import Observation, Playback
from proxytune.driving.agents.pupil import Pupil
from proxytune.driving.drivetrain import drivetrain
from proxytune.driving.episode import (
    TICK_HZ,
    Course,
    Drive,
    Driver,
    Instance,
    Sight,
    drive,
    measured,
    picture_only,
)
from proxytune.driving.expert import lesson_driver
from proxytune.driving.identity import earlier_identities, identity_of
from proxytune.driving.lockstep import drive_together, groups_of
from proxytune.driving.mounting import image_chain, mounted_camera
from proxytune.driving.picture_size import with_columns
from proxytune.driving.plant import Plant
from proxytune.driving.plants import fleet_at, plant_at
from proxytune.driving.renderers import camera_over
from proxytune.driving.road.lane import off_map
from proxytune.driving.road.maps import Road
from proxytune.driving.road.reading import shipped_map
from proxytune.driving.road.texture import draw_floor
from proxytune.driving.robot import Robot, read_robot, robot_home
from proxytune.effects import Catalogue, Signal, Stage, effects_from, stage_chain
from proxytune.errors import EpisodeError
from proxytune.space import Parameter, Theta
from proxytune.versions import versions_of


@dataclass(frozen=True)
class LaneFollowing:
    """S_Θ of a robot that follows a lane.

    Attributes:
        robot: Name of the robot.
        plant: One of PLANTS.
        camera: One of CAMERAS.
        map: The road, whether the package's or the user's own.
        seconds: Longest time an episode takes [s].
        position_noise_m: Standard deviation of where the robot is put down [m].
        heading_noise_deg: Standard deviation of how it is turned [deg].
        effects: Values of effects besides the robot's nominal ones, sorted by name.
        folder: Where a user's own agents, effects and robots lie.
    """

    robot: str
    plant: str
    camera: str
    map: Road
    seconds: float
    position_noise_m: float
    heading_noise_deg: float
    effects: tuple[tuple[str, float], ...]
    folder: Path

    @property
    def identity(self) -> str:
        """A digest of settings, of what robot, code and the user's modules mean, and of versions."""
        settings = tuple(getattr(self, name) for name in self.__dataclass_fields__ if name != "folder")
        return identity_of(settings, robot_home(self.robot, self.folder), self.folder, self.versions)

    @property
    def earlier_identities(self) -> tuple[str, ...]:
        """Identities under which earlier code kept episodes that are the very same."""
        # Maps were known by their names: one of another name, or changed since, has no earlier episodes.
        name = self.map.name if self.map == shipped_map("small_loop") else "none of then"
        world = (self.robot, self.plant, self.camera, name, self.seconds)
        settings = (*world, self.position_noise_m, self.heading_noise_deg, self.effects)
        return earlier_identities(settings, robot_home(self.robot, self.folder), self.folder)

    @property
    def versions(self) -> Mapping[str, str]:
        """Versions of the packages that simulate."""
        with_bullet = self.plant == "bullet" or self.camera == "renderer"
        return versions_of(("numpy", "pybullet") if with_bullet else ("numpy",))

    @property
    def metrics(self) -> Mapping[str, str]:
        """The task's metrics with their units."""
        return task.METRICS

    @property
    def parameters(self) -> Mapping[str, Parameter]:
        """Every parameter of the catalogue of effects, a user's own when asked for by name."""
        return Catalogue(self.folder).parameters

    @property
    def starts(self) -> int:
        """How many starting poses the map has."""
        return len(self.map.starts)

    def check_agent(self, name: str) -> None:
        """Load the agent once.

        Raises:
            SettingsError: If there is no such agent.
        """
        load_agent(name, self.folder)

    def run(self, episode: Episode) -> Mapping[str, float]:
        """Drive one episode and score it.

        Raises:
            EpisodeError: With the time at which the agent failed.
        """
        return task.score_trajectory(self.map, self.drive(episode).poses, tick_s=1.0 / TICK_HZ, seconds=self.seconds)

    def record(self, episode: Episode) -> Recording:
        """Drive one episode; its scores, the true pose at every tick, and the duties of both wheels.

        Raises:
            EpisodeError: With the time at which the agent failed.
        """
        driven, control_hz = self.drive(episode), read_robot(self.robot, self.folder).figures["control_rate"]
        metrics = task.score_trajectory(self.map, driven.poses, tick_s=1.0 / TICK_HZ, seconds=self.seconds)
        return Recording(metrics, *driven.columns(control_hz))

    def drive(self, episode: Episode) -> Drive:
        """Drive one episode.

        Raises:
            EpisodeError: With the time at which the agent failed.
        """
        return self._drive(episode, load_agent(episode.agent, self.folder), self.course(episode, self.seconds))

    @property
    def best_score(self) -> float:
        """Both wheels in the lane until time is over."""
        return self.seconds

    def demonstrate(self, episode: Episode, seconds: float) -> tuple[Demonstration, int]:
        """Let the robot's expert drive for some time [s]; steps off the road are not worth imitating.

        Raises:
            SettingsError: If the robot has no expert.
        """
        return self._lesson(episode, None, seconds)

    def guide(self, episode: Episode, policy: Policy, seconds: float) -> tuple[Demonstration, int]:
        """Let a policy drive for some time [s], and the robot's expert say what it would do at every step on the road.

        Raises:
            EpisodeError: If the policy raises or does not answer with two finite duties.
            SettingsError: If the robot has no expert.
        """
        return self._lesson(episode, policy, seconds)

    def _lesson(self, episode: Episode, policy: Policy | None, seconds: float) -> tuple[Demonstration, int]:
        robot = read_robot(self.robot, self.folder)
        driver = lesson_driver(self.map, robot, episode.seed, policy)
        shown = self._drive(episode, driver, self.course(episode, seconds), Sight).memory
        return shown.samples, round(seconds * robot.figures["control_rate"])

    def examine(self, episode: Episode, policy: Policy) -> float:
        """The paper's driving score of a policy, from −`seconds` to `seconds`.

        Raises:
            EpisodeError: If the policy raises or does not answer with two finite duties.
            SettingsError: If the robot does not state the distance between its wheels.
        """
        score = self._driving_score()
        return score(self._drive(episode, Pupil(policy), self.course(episode, self.seconds)).poses)

    def examine_together(self, episodes: Sequence[Episode], policy: Policy) -> list[float]:
        """What `examine` says of each of several episodes, to the bit: those of one θ are driven side by side.

        Raises:
            EpisodeError: As `examine` does, for the first episode that fails; SettingsError likewise.
        """
        score = self._driving_score()
        try:
            return [score(poses) for group in groups_of(episodes) for poses in self._drive_together(group, policy)]
        except EpisodeError:
            # Side by side another episode may fail first
            return [self.examine(episode, policy) for episode in episodes]

    def _drive_together(self, episodes: Sequence[Episode], policy: Policy) -> list[Signal]:
        instance = self.instance(dict(episodes[0].theta))
        courses = [self.course(episode, self.seconds) for episode in episodes]
        with fleet_at(self.plant, instance.robot, np.stack([course.start for course in courses])) as fleet:
            return drive_together(instance, fleet, policy, courses)

    def _driving_score(self) -> Callable[[Signal], float]:
        """The paper's driving score of poses."""
        wheels = read_robot(self.robot, self.folder).wheel_distance()
        timed = functools.partial(task.driving_score, tick_s=1.0 / TICK_HZ, seconds=self.seconds)
        return functools.partial(timed, self.map, wheel_distance=wheels)

    def measured(self, episode: Episode, driven: Drive) -> Signal:
        """The poses of an episode's drive as they are measured, (ticks + 1, 3); it is scored on the true ones."""
        return measured(self.instance(dict(episode.theta)), driven.poses, episode.seed)

    def replay(self, episode: Episode, commands: Signal) -> Observation:
        """Drive recorded commands (steps, 2), one per control step, in place of the episode's agent.

        It goes on wherever it leads, so that two domains can be compared step by step.
        """
        seconds = len(commands) / read_robot(self.robot, self.folder).figures["control_rate"]
        endless = replace(self.course(episode, seconds), ended=lambda x, y: False)
        driven = self._drive(episode, Playback(commands), endless)
        return Observation(driven.poses, np.stack(driven.memory.pictures))

    def course(self, episode: Episode, seconds: float) -> Course:
        """Where an episode starts, and its end: after some time [s], or off the map."""
        noise = {"position_noise_m": self.position_noise_m, "heading_noise_deg": self.heading_noise_deg}
        start = np.asarray(task.start_pose(self.map, episode.start, seed=episode.seed, **noise))
        return Course(start, seconds, episode.seed, functools.partial(off_map, self.map))

    def _drive(
        self, episode: Episode, driver: Driver, course: Course, sees: Callable[[Picture, Signal], Any] = picture_only
    ) -> Drive:
        instance = self.instance(dict(episode.theta))
        with self.plant_at(instance.robot, course.start) as plant:
            return drive(instance, plant, driver, course, sees)

    def instance(self, theta: Theta, columns: int = 0) -> Instance:
        """The domain instance S_θ: nominal effects, then the family's, then θ; pictures of at least so many columns."""
        return _instance(self, tuple(sorted(theta.items())), columns)

    def plant_at(self, robot: Robot, start: Signal) -> Plant:
        """The plant with the robot at a starting pose."""
        return plant_at(self.plant, robot, start)


@functools.lru_cache(maxsize=4)
def _instance(family: LaneFollowing, theta: tuple[tuple[str, float], ...], columns: int) -> Instance:
    named = read_robot(family.robot, family.folder)
    robot = with_columns(named, columns) if columns else named
    effects = effects_from({**robot.theta, **dict(family.effects), **dict(theta)}, robot.figures, robot.catalogue)
    camera = camera_over(draw_floor(family.map), mounted_camera(robot, effects), family.camera)
    image, measurement = image_chain(effects, robot.figures), stage_chain(effects, Stage.MEASUREMENT)
    return Instance(robot, drivetrain(robot, effects), camera, image, measurement)
