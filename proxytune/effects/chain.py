"""Effects in a row: what one stage of a domain instance does to its signal."""

import zlib
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from typing import Any

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

    def newest(self, signal: Signal, memories: tuple[Memory, ...]) -> tuple[Signal, tuple[Memory, ...]]:
        """The last sample (…, channels) of what the next chunk of whole numbers becomes.

        An effect that makes it for less than the whole chunk has a method `newest` of its own.
        """
        newest = self._own("newest")
        if newest:
            sample, memory = newest(signal, memories[0])
            return sample, (memory,)
        filtered, memories = self.apply(signal, memories)
        return filtered[..., -1, :], memories

    def looked_at(self, chunk: int, memories: tuple[Memory, ...]) -> int:
        """How many samples, at the end of each chunk of so many, `newest` looks at if no other method is called."""
        looked_at = self._own("looked_at")
        if not self.effects:
            return 1
        return min(chunk, looked_at(memories[0])) if looked_at else chunk

    def _own(self, method: str) -> Callable[..., Any] | None:
        return getattr(self.effects[0], method, None) if len(self.effects) == 1 else None


def stage_chain(effects: Iterable[Effect], stage: Stage) -> Chain:
    """The effects of one stage, in the order given."""
    return Chain(tuple(effect for effect in effects if effect.stage is stage))
