"""Our effects on observations, on their way out of an environment."""

from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from proxytune.effects import Chain, Effect, Signal, Stage, stage_chain
from proxytune.environments.signals import setting_of
from proxytune.environments.spaces import Spaces


class Sensors:
    """Image effects on pictures, or measurement effects on a pose within the observation."""

    def __init__(self, effects: Iterable[Effect], spaces: Spaces, state: tuple[int, ...] | None, seed: int) -> None:
        chosen = tuple(effects)
        self._spaces, self._seed = spaces, seed
        self._image = stage_chain(chosen, Stage.IMAGE)
        self._measurement = stage_chain(chosen, Stage.MEASUREMENT)
        self._places = list(state or ())
        self._memory: Any = None

    def show(self, observation: Any) -> Any:
        """What the agent sees of the next observation."""
        if self._image.effects:
            signal = np.asarray(observation).reshape(1, -1)
            developed = self._filtered(self._image, signal.astype(np.float32))
            return np.clip(np.rint(developed), 0, 255).astype(np.uint8).reshape(np.shape(observation))
        if self._measurement.effects:
            measured = np.array(observation)
            measured[self._places] = self._filtered(self._measurement, measured[None, self._places].astype(float))[0]
            return measured
        return observation

    def _filtered(self, chain: Chain, signal: Signal) -> NDArray[Any]:
        if self._memory is None:
            self._memory = chain.begin(setting_of(self._spaces, signal[0], self._seed))
        bent, self._memory = chain.apply(signal, self._memory)
        return bent
