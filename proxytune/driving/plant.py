"""What a plant is: the thing that moves."""

from types import TracebackType
from typing import Protocol, Self

from proxytune.effects import Signal


class Plant(Protocol):
    """One robot on a floor, from its starting pose on; a context manager, closed when the episode ends."""

    def move(self, twists: Signal) -> tuple[Signal, bool]:
        """Follow twists (time, 3), each for one tick.

        Returns:
            The poses after each tick, (time, 3): x [m], y [m] of the middle of the axle, heading [rad, unwrapped];
            and whether the robot has hit something or fallen over.
        """
        ...

    def __enter__(self) -> Self: ...

    def __exit__(
        self, kind: type[BaseException] | None, problem: BaseException | None, trace: TracebackType | None
    ) -> None: ...
