"""Signals that an effect could meet, and an effect's answer to them."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from proxytune.driving.robot import Robot
from proxytune.effects import CHANNELS, Effect, Setting, Signal, Stage
from proxytune.space import Parameter

ROBOT = "duckiebot"
"""Whose nominal figures an extension is told where a test names no robot."""
RATE_HZ = 60.0
HELD = 3
"""Samples over which a command holds."""
PICTURE = {"camera_columns": 4.0, "camera_rows": 3.0}
"""The size of the pictures that image effects are tried on: no two sides alike, so that none is taken for the other."""


def signal_at(stage: Stage, robot: Robot, seed: int, length: int = 90) -> Signal:
    """Held commands or motion, camera figures, or changing pictures, shape (length, channels)."""
    random = np.random.default_rng(seed)
    if stage is Stage.CAMERA:
        return np.repeat(robot.camera_figures().channels()[None], length, axis=0)
    if stage is Stage.IMAGE:
        channels = 3 * int(PICTURE["camera_columns"] * PICTURE["camera_rows"])
        return random.uniform(0.0, 255.0, (length, channels)).astype(np.float32)
    return np.repeat(random.uniform(-1.0, 1.0, (length // HELD, len(CHANNELS[stage]))), HELD, axis=0)


def everywhere() -> Signal:
    """Places [m] along both axes that reach beyond every patch, nearest first, to and fro, shape (places, 2)."""
    way = np.repeat(np.linspace(0.0, 21.0, 225), 2) * np.tile((1.0, -1.0), 225)
    along = np.stack((way, np.zeros_like(way)), axis=-1)
    return np.stack((along, along[:, ::-1]), axis=1).reshape(-1, 2)


PLACES = everywhere()


@dataclass(frozen=True)
class Candidate:
    """An effect class that is put to the test.

    Attributes:
        kind: Its class.
        robot: Whose nominal figures it is told.
        name: What θ calls the effect.
    """

    kind: type[Effect]
    robot: Robot
    name: str

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """Its parameters."""
        return self.kind.parameters

    @property
    def neutral(self) -> dict[str, float]:
        """The neutral values, by parameter."""
        return {parameter.name: parameter.neutral_value(self.robot.figures) for parameter in self.parameters}

    def at(self, values: Mapping[str, float]) -> Effect:
        """The effect with these values, all others neutral."""
        return self.kind(*{**self.neutral, **values}.values())

    def moved(self, parameter: Parameter, value: float) -> Effect:
        """The effect with one value moved; what only shapes an effect is moved in one that is there."""
        first = self.parameters[0]
        return self.at({**({first.name: _usual(first)} if parameter.shape else {}), parameter.name: value})

    def signal(self, seed: int, length: int = 90) -> Signal:
        """A signal of its stage."""
        return signal_at(self.kind.stage, self.robot, seed, length)

    def setting(self, rest: Signal, seed: int = 7) -> Setting:
        """What its filter is told; an effect of a place is shown one everywhere."""
        setting = Setting(RATE_HZ, rest, {**self.robot.figures, **PICTURE}, seed=seed)
        placed = self.kind.trace is not None and self.kind.trace.placed
        return replace(setting, places=PLACES, headings=np.zeros(len(PLACES))) if placed else setting

    def rest(self, signal: Signal) -> Signal:
        """What was there before a signal: pictures stand still, commands and motion rest."""
        seen = self.kind.stage in (Stage.IMAGE, Stage.CAMERA)
        return np.asarray(signal[0] if seen else np.zeros((*signal.shape[:-2], signal.shape[-1])))

    def filtered(self, effect: Effect, signal: Signal, cuts: Iterable[int] = (), seed: int = 7) -> Signal:
        """The signal (…, time, channels) filtered, in one go or in chunks."""
        memory: Any = effect.begin(self.setting(self.rest(signal), seed))
        chunks = []
        for chunk in np.split(signal, sorted(cuts), axis=-2):
            if chunk.shape[-2]:
                filtered, memory = effect.apply(chunk, memory)
                chunks.append(filtered)
        return np.concatenate(chunks, axis=-2)


def _usual(parameter: Parameter) -> float:
    """A value at which an effect is there."""
    probes = parameter.probes
    return probes[len(probes) // 2] if probes else 0.5 * (parameter.low + parameter.high)
