"""Our effects on actions, on their way into an environment."""

from collections.abc import Iterable
from typing import Any

import numpy as np

from proxytune.effects import Effect, Stage, stage_chain
from proxytune.environments.signals import WHEELS, rest_of, setting_of
from proxytune.environments.spaces import Spaces


class Actuators:
    """Command and actuation effects on Box actions, as shares of the largest one; zero stays zero.

    Of two actions, the first is the left wheel's and the second the right one's. Of any other number, each is filtered
    by itself, as a robot's two wheels that are commanded alike.
    """

    def __init__(self, effects: Iterable[Effect], spaces: Spaces, seed: int) -> None:
        chosen = tuple(effects)
        self._chains = [stage_chain(chosen, stage) for stage in (Stage.COMMAND, Stage.ACTUATION)]
        self._idle = not any(chain.effects for chain in self._chains)
        setting = setting_of(spaces, rest_of(Stage.COMMAND, spaces), seed)
        self._memories: list[Any] = [chain.begin(setting) for chain in self._chains]
        self._low, self._high = np.array(spaces.low), np.array(spaces.high)
        self._largest = np.maximum(np.abs(self._low), np.abs(self._high))
        self._largest[self._largest == 0.0] = 1.0

    def pass_on(self, action: Any) -> Any:
        """What reaches the environment of the next action; whole numbers are rounded to the nearest ones."""
        if self._idle:
            return action
        shares = np.asarray(action, dtype=float) / self._largest
        signal = shares[None] if len(shares) == WHEELS else np.repeat(shares[:, None, None], WHEELS, axis=-1)
        for number, chain in enumerate(self._chains):
            signal, self._memories[number] = chain.apply(np.clip(signal, -1.0, 1.0), self._memories[number])
        bent = signal[0] if len(shares) == WHEELS else signal[:, 0, 0]
        given = np.clip(bent * self._largest, self._low, self._high)
        kind = np.asarray(action).dtype
        return (np.rint(given) if np.issubdtype(kind, np.integer) else given).astype(kind)
