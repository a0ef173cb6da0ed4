"""Effects in a row: what one stage of a domain instance does to its signal."""

import zlib
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace

import numpy as np

from proxytune.effects.effect import Effect, Memory, Recalling, Setting, Signal, Stage


@dataclass(frozen=True)
class Chain:
    """The effects of one stage, applied in order; itself a causal filter."""

    effects: tuple[Effect, ...]

    def begin(self, setting: Setting) -> tuple[Memory, ...]:
        """Every effect's memory, each with a seed of its own."""
        memories = []
        for effect in self.effects:
            own = replace(setting, seed=zlib.crc32(effect.name.encode(), setting.seed))
            memories.append(effect.begin(own))
        return tuple(memories)

    def begin_amid(self, setting: Setting, whole: Setting, signal: Signal, row: Signal, sample: Signal) -> Memory:
        """The memories of windows that begin amid longer signals: what came before counts where an effect recalls it.

        Args:
            setting: Of the windows (W, …).
            whole: Of the longer signals.
            signal: Those signals from their start on (rows, time, channels).
            row: The row of each window (W,).
            sample: The sample of its row at which each window begins (W,).
        """
        memories = list(self.begin(setting))
        recalling = [number for number, effect in enumerate(self.effects) if isinstance(effect, Recalling)]
        for number, effect in enumerate(self.effects[: max(recalling, default=-1) + 1]):
            if isinstance(effect, Recalling):
                memories[number] = effect.recall(setting, signal, row, sample)
            signal, _ = effect.apply(signal, effect.begin(whole))
        return tuple(memories)

    def apply(self, signal: Signal, memories: tuple[Memory, ...]) -> tuple[Signal, tuple[Memory, ...]]:
        """Filter the next chunk through every effect."""
        after = []
        for effect, memory in zip(self.effects, memories, strict=True):
            signal, kept = effect.apply(signal, memory)
            after.append(kept)
        return signal, tuple(after)

    def mean_weights(self, rate_hz: float) -> Signal | None:
        """The weights of the last samples, the newest last, if all that the effects make is a mean of these.

        Another mean than `apply`'s may be rounded otherwise, unless samples are whole numbers of 8 bits.
        """
        if not self.effects:
            return np.ones(1, dtype=np.float32)
        own: Callable[[float], Signal] | None = getattr(self.effects[0], "mean_weights", None)
        return own(rate_hz) if own and len(self.effects) == 1 else None


def stage_chain(effects: Iterable[Effect], stage: Stage) -> Chain:
    """The effects of one stage, in the order given."""
    return Chain(tuple(effect for effect in effects if effect.stage is stage))
