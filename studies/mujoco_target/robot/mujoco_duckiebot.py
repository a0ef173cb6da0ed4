"""The domain family of that robot on proxytune's map: the shipped agents drive it by proxytune's camera.

Nothing that moves comes from proxytune: its effects and plants have no part here but in the camera, its pitch and blur.
"""

import functools
import hashlib
from dataclasses import dataclass, replace
from pathlib import Path

import mujoco
import numpy as np
from mujoco_plant import BODY, TICK_S, MujocoPlant

from proxytune.driving import METRICS, Course, drive, lane_following, load_agent, off_map, score_trajectory, start_pose
from proxytune.identity import meaning_of, modules_beside
from proxytune.settings import Section, read_settings
from proxytune.space import Parameter

PARAMETERS = {
    "gear_friction": Parameter(name="gear_friction", unit="", low=0.0, high=0.4, neutral=0.0),
    "motor_imbalance": Parameter(name="motor_imbalance", unit="", low=-0.3, high=0.3, neutral=0.0),
    "latency": Parameter(name="latency", unit="s", low=0.0, high=0.6, neutral=0.15),
    "camera_pitch": Parameter(name="camera_pitch", unit="deg", low=3.0, high=35.0, neutral=19.15),
    "blur": Parameter(name="blur", unit="s", low=0.0, high=0.2, neutral=0.05),
}
ON_THE_CAMERA = ("camera_pitch", "blur")


class Duties:
    """In place of a drivetrain: duties go to the motors as they are."""

    def begin(self, setting):
        """Nothing to remember."""

    def apply(self, signal, memory):
        """The same duties."""
        return signal, memory


@dataclass(frozen=True)
class MujocoDuckiebot:
    """S_Θ of the robot in MuJoCo: `view` is the lane-following family whose map, camera and noise it has."""

    view: object
    held: tuple
    metrics = METRICS
    parameters = PARAMETERS

    @property
    def identity(self):
        """A digest of the settings, the model, the code and MuJoCo's version."""
        own = meaning_of([BODY, *modules_beside(BODY.parent)], BODY.parent)
        parts = (self.view.identity, self.held, own, mujoco.__version__)
        return hashlib.sha256(repr(parts).encode()).hexdigest()[:16]

    @property
    def starts(self):
        """How many starting poses the map has."""
        return self.view.starts

    def check_agent(self, name):
        """Load the agent once."""
        self.view.check_agent(name)

    def run(self, episode):
        """Drive one episode and score it."""
        noise = {"position_noise_m": self.view.position_noise_m, "heading_noise_deg": self.view.heading_noise_deg}
        start = np.array(start_pose(self.view.map, episode.start, seed=episode.seed, **noise))
        course = Course(start, self.view.seconds, episode.seed, functools.partial(off_map, self.view.map))
        theta = {**dict(self.held), **dict(episode.theta)}
        instance = self.view.instance({name: theta[name] for name in ON_THE_CAMERA if name in theta})
        agent = load_agent(episode.agent, self.view.folder)
        with self.plant_at(start, theta) as plant:
            driven = drive(replace(instance, drivetrain=Duties()), plant, agent, course)
        return score_trajectory(self.view.map, driven.poses, tick_s=TICK_S, seconds=self.view.seconds)

    def plant_at(self, start, theta):
        """The robot at a start, its motors as θ has them."""
        values = {name: parameter.neutral for name, parameter in PARAMETERS.items()} | dict(theta)
        return MujocoPlant(start, **{name: values[name] for name in values if name not in ON_THE_CAMERA})


def family(domain: Section, *, model: Path | None):
    """Called with the study's [domain] table, that of lane following; a model holds values of PARAMETERS."""
    held = {}
    if model:
        settings = read_settings(model)
        settings.only(("format", "parameters"))
        given = settings.section("parameters")
        given.only(PARAMETERS)
        held = {name: given.number(name, low=PARAMETERS[name].low, high=PARAMETERS[name].high) for name in given}
    return MujocoDuckiebot(lane_following(domain, model=None), tuple(sorted(held.items())))
