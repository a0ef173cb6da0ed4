"""What every agent of lane following promises."""

import copy
import inspect
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from proxytune.driving.agents import Agent, Picture
from proxytune.driving.agents.loading import NEEDS
from proxytune.driving.ground_plane import GroundPlaneCamera
from proxytune.driving.road.reading import shipped_map
from proxytune.driving.road.texture import draw_floor
from proxytune.driving.robot import Robot, read_robot
from proxytune.testing.claim import ask, claim, claim_members
from proxytune.testing.signals import ROBOT

MAP = "small_loop"


def check_agent(agent: Agent | type[Agent], *, robot: Robot | None = None) -> None:
    """Refuse an agent that breaks a promise.

    It answers any picture with two finite duties in [−1, 1]; the same pictures always get the same answers, also while
    it drives in other episodes; and neither a picture nor a memory is changed in place.

    Args:
        agent: An agent, or what makes one when called.
        robot: Whose camera it sees through; the Duckiebot's if not given.

    Raises:
        ConformanceError: With the promise that is broken.
    """
    what = f"agent {getattr(agent, '__name__', type(agent).__name__)}"
    made: Any = ask(what, agent) if inspect.isclass(agent) else agent
    claim_members(made, what, NEEDS)
    _check(made, what, robot or read_robot(ROBOT))


def _check(agent: Agent, what: str, robot: Robot) -> None:
    seen = _pictures(robot)
    alone = _driven(agent, what, robot, seen)
    for tick, command in enumerate(alone):
        told = f"{what} answers picture {tick} with {command.tolist()}"
        claim(command.shape == (2,), f"{told}; a command is two duties, left and right")
        claim(np.isfinite(command).all() and np.abs(command).max() <= 1.0, f"{told}; duties lie within [-1, 1]")
    again = _driven(agent, what, robot, seen)
    claim(np.array_equal(alone, again), f"{what} drives otherwise the second time; keep all it learns in its memory")
    _claim_apart(agent, what, robot, seen, alone)
    _claim_nothing_in_place(agent, what, robot, seen)


def _pictures(robot: Robot) -> list[Picture]:
    """What the robot sees along a map, from askew too; then night, snow and noise."""
    road = shipped_map(MAP)
    camera = GroundPlaneCamera(robot.camera_figures(), draw_floor(road))
    poses = np.array([(x, y, np.radians(heading) + turned) for x, y, heading in road.starts for turned in (0.0, 0.8)])
    lane = camera.render(poses)
    noise = np.random.default_rng(1).integers(0, 256, lane[0].shape).astype(np.uint8)
    return [picture[-1] if picture.ndim == 4 else picture for picture in (*lane, 0 * noise, 0 * noise + 255, noise)]


def _act(agent: Agent, what: str, picture: Picture, memory: Any) -> tuple[NDArray[np.float64], Any]:
    kept = picture.copy()
    answer: Any = ask(what, lambda: agent.act(kept, memory))
    claim(np.array_equal(picture, kept), f"{what} changes the picture in place; copy it first")
    pair = isinstance(answer, tuple) and len(answer) == 2
    claim(pair, f"{what} answers with {type(answer).__name__}; act must give a tuple: the command and its memory")
    return ask(f"the command of {what}", lambda: np.array(answer[0], dtype=float)), answer[1]


def _driven(agent: Agent, what: str, robot: Robot, seen: Sequence[Picture]) -> NDArray[np.float64]:
    memory, commands = ask(what, lambda: agent.begin(robot)), []
    for picture in seen:
        command, memory = _act(agent, what, picture, memory)
        commands.append(command)
    claim(len({command.shape for command in commands}) == 1, f"{what} answers with commands of several shapes")
    return np.array(commands)


def _claim_apart(agent: Agent, what: str, robot: Robot, seen: Sequence[Picture], alone: NDArray[np.float64]) -> None:
    """Two episodes at once do not disturb each other."""
    one, other = agent.begin(robot), agent.begin(robot)
    for picture, backwards, command in zip(seen, seen[::-1], alone, strict=True):
        answered, one = _act(agent, what, picture, one)
        _, other = _act(agent, what, backwards, other)
        same = np.array_equal(answered, command)
        claim(same, f"{what} is disturbed by another episode under way; keep all it learns in its memory")


def _claim_nothing_in_place(agent: Agent, what: str, robot: Robot, seen: Sequence[Picture]) -> None:
    memory = agent.begin(robot)
    for picture in seen:
        before = copy.deepcopy(memory)
        first, later = _act(agent, what, picture, memory)
        later = copy.deepcopy(later)
        second, _ = _act(agent, what, picture, memory)
        third, _ = _act(agent, what, picture, before)
        same = np.array_equal(first, second) and np.array_equal(first, third)
        claim(same, f"{what} changes its memory in place; make a new one")
        memory = later
