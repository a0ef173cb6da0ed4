"""Lane following as a domain family: a robot on a map, its plant, camera and effects, as a `[domain]` table has them.

A family's episodes are kept under its `identity`: a digest of all that determines a result but the episode itself.
"""

import functools
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from types import MappingProxyType
from typing import Any, TypeVar

import numpy as np

from proxytune.domain import Demonstration, Episode, Policy, Recording
from proxytune.driving.agent import Agent
from proxytune.driving.agents import AGENTS, AtTheWheel, load_agent
from proxytune.driving.bullet import BulletCamera, need_pybullet
from proxytune.driving.cameras import GroundPlaneCamera
from proxytune.driving.episode import (
    METRICS,
    TICK_HZ,
    Course,
    Drive,
    Driver,
    Instance,
    Sees,
    Sight,
    driving_score,
    measured,
    picture_only,
    score_trajectory,
    start_pose,
)
from proxytune.driving.expert import Observation, Playback, Pupil, lesson_driver
from proxytune.driving.fleet import AT_ONCE, PLANTS, drive_fleet, fleet_at, only, plant_at
from proxytune.driving.lane import off_map
from proxytune.driving.maps import chosen_map
from proxytune.driving.optics import CameraFigures
from proxytune.driving.plants import Plant, check_body, drivetrain
from proxytune.driving.road import Arc, Road
from proxytune.driving.road_picture import draw_floor
from proxytune.driving.robot import Robot, catalogue_of, is_robot, read_model_of, read_robot, robot_home, robot_names
from proxytune.effects import Chain, Effect, FilterContext, Signal, Stage, effects_from, read_effects, stage_chain
from proxytune.errors import EpisodeError, InputError
from proxytune.identity import digest, meaning_of, modules_beside, versions_of
from proxytune.lineage import code_name
from proxytune.settings import Section, figure_cautions, nearest
from proxytune.space import Parameter, Theta

Score = TypeVar("Score")


def identity_of(settings: tuple[Any, ...], robot: Path, folder: Path, versions: Mapping[str, str]) -> str:
    """A digest of settings, of what our code, the robot's files and the user's modules mean, and of versions.

    The settings' `repr` counts: a class of theirs, as that of the map, cannot be renamed without giving every episode
    another name.
    """
    own = meaning_of(modules_beside(folder), folder)
    return digest(settings, code_name("driving"), robot_meaning(robot), own, sorted(versions.items()))


@functools.lru_cache
def robot_meaning(robot: Path) -> str:
    """A digest of what the files of a robot's folder mean."""
    return meaning_of((path for path in robot.iterdir() if path.is_file()), robot)


NO_SETTINGS = ("folder", "cautions")
"""Fields that no episode depends on."""
_RATE_HZ = 60.0
"""Camera effects hold for good: no rate changes what they do."""


def mounted_camera(robot: Robot, effects: Iterable[Effect]) -> CameraFigures:
    """The robot's nominal camera with what camera effects set; a SettingsError if there is none, or can be none."""
    figures = robot.camera_figures()
    nominal = figures.channels()
    mounting = stage_chain(effects, Stage.CAMERA)
    memory = mounting.begin(FilterContext(_RATE_HZ, nominal, robot.figures))
    return figures.with_channels(mounting.apply(nominal[None], memory)[0][0])


def image_chain(effects: Iterable[Effect], figures: Mapping[str, float]) -> Chain:
    """The image effects that change a picture, given the nominal figures: neutral ones would only cost time."""
    chain = stage_chain(effects, Stage.IMAGE)

    def vanishes(effect: Effect) -> bool:
        return all(getattr(effect, one.name, None) == one.neutral_value(figures) for one in effect.parameters)

    return Chain(tuple(effect for effect in chain.effects if not vanishes(effect)))


def with_columns(robot: Robot, least: int) -> Robot:
    """The robot with a camera of at least so many columns, rows in proportion; every other figure is the same."""
    camera = robot.camera_figures()
    columns = max(camera.columns, least)
    rows = round(camera.rows * columns / camera.columns)
    size = {"camera_columns": float(columns), "camera_rows": float(rows)}
    return replace(robot, figures=MappingProxyType({**robot.figures, **size}))


CAMERAS = ("ground_plane", "renderer")


@dataclass(frozen=True)
class LaneFollowing:
    """S_Θ of a robot that follows a lane."""

    robot: str  # name of the robot
    plant: str  # one of PLANTS
    camera: str  # one of CAMERAS
    map: Road  # the road, whether the package's or the user's own
    seconds: float  # longest time an episode takes [s]
    position_noise_m: float  # standard deviation of where the robot is put down [m]
    heading_noise_deg: float  # standard deviation of how it is turned [deg]
    effects: tuple[tuple[str, float], ...]  # values of effects besides the robot's nominal ones, sorted by name
    folder: Path  # where a user's own agents, effects and robots lie
    # what is probably not meant in its robot or model, a sentence each
    cautions: tuple[str, ...] = field(default=(), compare=False, repr=False)

    @property
    def identity(self) -> str:
        """A digest of settings, of what robot, code and the user's modules mean, and of versions."""
        settings = tuple(getattr(self, name) for name in self.__dataclass_fields__ if name not in NO_SETTINGS)
        return identity_of(settings, robot_home(self.robot, self.folder), self.folder, self.versions)

    @property
    def versions(self) -> Mapping[str, str]:
        """Versions of the packages that simulate."""
        with_bullet = self.plant == "bullet" or self.camera == "renderer"
        return versions_of(("numpy", "pybullet") if with_bullet else ("numpy",))

    @property
    def metrics(self) -> Mapping[str, str]:
        """The task's metrics with their units."""
        return METRICS

    @property
    def parameters(self) -> Mapping[str, Parameter]:
        """Every parameter of the catalogue of effects, a user's own when asked for by name."""
        return catalogue_of(self.robot, self.folder).parameters

    @property
    def nominal(self) -> Mapping[str, float]:
        """Values of an instance that names no θ: by this family's effects, the robot's, and else its figures."""
        robot = read_robot(self.robot, self.folder)
        known, figures = {**robot.theta, **dict(self.effects)}, robot.figures
        neutral = {
            name: one.neutral_value(figures)
            for name, one in robot.catalogue.parameters.items()
            if not isinstance(one.neutral, str) or one.neutral in figures
        }
        return {**neutral, **known}

    @property
    def starts(self) -> int:
        """Number of starting poses of the map."""
        return len(self.map.starts)

    def check_agent(self, name: str) -> None:
        """Load the agent once."""
        self._agent(name)

    def run(self, episode: Episode) -> Mapping[str, float]:
        """Drive one episode and score it."""
        return only(self.run_many([episode]))

    def run_many(self, episodes: Sequence[Episode]) -> list[Mapping[str, float] | EpisodeError]:
        """Drive episodes side by side and score each as `run` does, to the bit; an EpisodeError where one failed."""
        return [_scored(self._metrics, driven) for driven in self.drive_many(episodes)]

    def record(self, episode: Episode) -> Recording:
        """Drive one episode; its scores, the true pose at every tick, and the duties of both wheels."""
        driven = self.drive(episode)
        return Recording(self._metrics(driven.poses), *driven.columns(read_robot(self.robot, self.folder)))

    def drive(self, episode: Episode) -> Drive:
        """Drive one episode.

        Raises:
            EpisodeError: With the time at which the agent failed.
        """
        return only(self.drive_many([episode]))

    def drive_many(self, episodes: Sequence[Episode]) -> list[Drive | EpisodeError]:
        """Drive episodes side by side, each as `drive` does."""
        return self._drive(episodes, [self._agent(episode.agent) for episode in episodes], self.seconds)

    def _agent(self, name: str) -> Agent:
        """An agent; ours are made for two wheels, others answer with the robot's own commands."""
        agent = load_agent(name, self.folder)
        steers = name in AGENTS and read_robot(self.robot, self.folder).drive == "ackermann"
        return AtTheWheel(agent) if steers else agent

    def _metrics(self, poses: Signal) -> Mapping[str, float]:
        return score_trajectory(self.map, poses, tick_s=1.0 / TICK_HZ, seconds=self.seconds)

    @property
    def command_unit(self) -> str:
        """The unit of a command: wheels are given duties, a car shares of full throttle and full lock."""
        return "duty" if read_robot(self.robot, self.folder).drive == "differential" else "of full"

    @property
    def road_to_draw(self) -> Road:
        """The road that a figure draws the robot's way on."""
        return self.map

    @property
    def best_score(self) -> float:
        """Both wheels in the lane until time is over."""
        return self.seconds

    def demonstrate(self, episode: Episode, seconds: float) -> tuple[Demonstration, int]:
        """Let the robot's expert drive for some time [s]; steps off the road are not worth imitating."""
        return self._lesson(episode, None, seconds)

    def guide(self, episode: Episode, policy: Policy, seconds: float) -> tuple[Demonstration, int]:
        """Let a policy drive for some time [s], and the robot's expert say what it would do at every step."""
        return self._lesson(episode, policy, seconds)

    def _lesson(self, episode: Episode, policy: Policy | None, seconds: float) -> tuple[Demonstration, int]:
        robot = read_robot(self.robot, self.folder)
        driver = lesson_driver(self.map, robot, episode.seed, policy)
        shown = only(self._drive([episode], [driver], seconds, sees=Sight))
        return shown.memory.samples, round(seconds * robot.figures["control_rate"])

    def examine(self, episode: Episode, policy: Policy) -> float:
        """The paper's driving score of a policy, from −`seconds` to `seconds`."""
        return self.examine_together([episode], policy)[0]

    def examine_together(self, episodes: Sequence[Episode], policy: Policy) -> list[float]:
        """Score several episodes as `examine` does, to the bit; what the first that fails raises is raised."""
        wheels, pupil = read_robot(self.robot, self.folder).wheel_distance(), Pupil(policy)
        timed = functools.partial(driving_score, tick_s=1.0 / TICK_HZ, seconds=self.seconds)
        score = functools.partial(timed, self.map, wheel_distance=wheels)
        driven = self._drive(episodes, [pupil] * len(episodes), self.seconds)
        return [only([_scored(score, one)]) for one in driven]

    def measured(self, episode: Episode, driven: Drive) -> Signal:
        """The poses of an episode's drive as they are measured, (ticks + 1, 3); it is scored on the true ones."""
        return measured(self.instance(dict(episode.theta)), driven.poses, episode.seed)

    def replay(self, episode: Episode, commands: Signal) -> Observation:
        """Drive recorded commands (steps, 2), one per control step, in place of the episode's agent.

        It goes on wherever it leads, so that two domains can be compared step by step.
        """
        seconds = len(commands) / read_robot(self.robot, self.folder).figures["control_rate"]
        driven = only(self._drive([episode], [Playback(commands)], seconds, ended=lambda x, y: False))
        return Observation(driven.poses, np.stack(driven.memory.pictures))

    def course(self, episode: Episode, seconds: float) -> Course:
        """Start of an episode, and its end: after some time [s], or off the map."""
        noise = {"position_noise_m": self.position_noise_m, "heading_noise_deg": self.heading_noise_deg}
        start = np.asarray(start_pose(self.map, episode.start, seed=episode.seed, **noise))
        return Course(start, seconds, episode.seed, functools.partial(off_map, self.map))

    def _drive(
        self,
        episodes: Sequence[Episode],
        drivers: Sequence[Driver],
        seconds: float,
        *,
        sees: Sees = picture_only,
        ended: Callable[[float, float], bool] | None = None,
    ) -> list[Drive | EpisodeError]:
        """Drive episodes side by side for some time [s], or until they have `ended`: off the map."""
        driven: list[Drive | EpisodeError] = []
        at_once = AT_ONCE[self.plant]
        for first in range(0, len(episodes), at_once):
            some = episodes[first : first + at_once]
            thetas = {episode.theta: self.instance(dict(episode.theta)) for episode in some}
            instances = [thetas[episode.theta] for episode in some]
            courses = [self.course(episode, seconds) for episode in some]
            courses = [replace(course, ended=ended) for course in courses] if ended else courses
            with fleet_at(self.plant, instances[0].robot, np.stack([course.start for course in courses])) as fleet:
                driven += drive_fleet(instances, fleet, drivers[first : first + at_once], courses, sees)
        return driven

    def instance(self, theta: Theta, columns: int = 0) -> Instance:
        """The domain instance S_θ: nominal effects, then the family's, then θ; pictures of at least so many columns."""
        return _instance(self, tuple(sorted(theta.items())), columns)

    def plant_at(self, robot: Robot, start: Signal) -> Plant:
        """The plant with the robot at a starting pose."""
        return plant_at(self.plant, robot, start)


def _scored(score: Callable[[Signal], Score], driven: Drive | EpisodeError) -> Score | EpisodeError:
    """The score of a drive; an EpisodeError where it failed or cannot be scored."""
    if isinstance(driven, EpisodeError):
        return driven
    try:
        return score(driven.poses)
    except EpisodeError as problem:
        return problem


@functools.lru_cache(maxsize=4)
def _instance(family: LaneFollowing, theta: tuple[tuple[str, float], ...], columns: int) -> Instance:
    named = read_robot(family.robot, family.folder)
    robot = with_columns(named, columns) if columns else named
    effects = effects_from({**robot.theta, **dict(family.effects), **dict(theta)}, robot.figures, robot.catalogue)
    mounted, floor = mounted_camera(robot, effects), draw_floor(family.map)
    camera = GroundPlaneCamera(mounted, floor) if family.camera == "ground_plane" else BulletCamera(mounted, floor)
    image, measurement = image_chain(effects, robot.figures), stage_chain(effects, Stage.MEASUREMENT)
    return Instance(robot, drivetrain(robot, effects), camera, image, measurement)


DOMAIN_KEYS = ("robot", "plant", "camera", "map", "seconds", "position_noise_m", "heading_noise_deg", "effects")
"""What a study's `[domain]` table may say of it."""


def lane_following(section: Section, *, model: Path | None) -> LaneFollowing:
    """The family that a study's `[domain]` table describes.

    Args:
        section: Keys robot, plant, camera, map, seconds, position_noise_m, heading_noise_deg, and effects.
        model: A model.toml whose effects every instance has, besides those of the section.

    Raises:
        SettingsError: With file, key and remedy.
    """
    section.only(DOMAIN_KEYS)
    folder = section.path.resolve().parent
    given = read_model_of(model, folder) if model else None
    robot = _agreed(section, "robot", given.robot if given else None, "duckiebot")
    if not is_robot(robot, folder):
        raise section.error("robot", f"unknown value '{robot}'; {nearest(robot, robot_names(folder))}")
    catalogue = catalogue_of(robot, folder)
    plant = section.text("plant", _agreed(section, "plant", given.plant if given else None, "bullet"), choices=PLANTS)
    camera = section.text("camera", "ground_plane", choices=CAMERAS)
    _check_equipment(section, read_robot(robot, folder), plant, camera)
    figures = read_robot(robot, folder).figures
    theta, _ = read_effects(section.section("effects"), catalogue)
    effects = {**(given.theta if given else {}), **theta}
    road = chosen_map(section)
    _check_bends(section, read_robot(robot, folder), road)
    return LaneFollowing(
        robot=robot,
        plant=plant,
        camera=camera,
        map=road,
        seconds=section.number("seconds", 60.0, low=1.0, high=3600.0),
        position_noise_m=section.number("position_noise_m", 0.01, low=0.0, high=0.1),
        heading_noise_deg=section.number("heading_noise_deg", 2.0, low=0.0, high=30.0),
        effects=tuple(sorted(effects.items())),
        folder=folder,
        cautions=(*figure_cautions(figures, f"robot {robot}"), *(given.cautions if given else ())),
    )


def _check_equipment(section: Section, robot: Robot, plant: str, camera: str) -> None:
    """Refuse what no episode can go without, a camera, PyBullet or a body for it, before the first one."""
    key = "plant"
    try:
        if plant == "bullet":
            need_pybullet()
        key = "camera"
        if camera == "renderer":
            need_pybullet('camera = "ground_plane"')
        key = "robot"
        robot.camera_figures()
        if plant == "bullet":
            check_body(robot)
    except InputError as problem:
        raise section.error(key, str(problem)) from None


def _check_bends(section: Section, robot: Robot, road: Road) -> None:
    """Refuse a map whose lanes bend more tightly than the robot can turn."""
    lanes = [arc.radius - road.lane_offset for arc in road.segments if isinstance(arc, Arc)]
    least = robot.least_radius
    if lanes and min(lanes) < least:
        tight = f"lanes of {road.name} bend at {min(lanes):.2g} m, robot '{robot.name}' turns at {least:.2g} m or more"
        raise section.error("map", f'{tight}; take map = "car_loop" or a map of your own')


def _agreed(section: Section, key: str, of_model: str | None, default: str) -> str:
    value = section.text(key, of_model or default)
    if of_model is not None and value != of_model:
        raise section.error(key, f"is '{value}' but the model says '{of_model}'; take one of them out")
    return value
