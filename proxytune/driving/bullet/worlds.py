"""PyBullet worlds that nobody looks at: emptied and used again, since a new one takes as long as a second's driving."""

import pybullet

_empty: list[int] = []


def open_world() -> int:
    """A world with nothing in it; physics are the same, to the bit, in a new one and in one that was left."""
    return _empty.pop() if _empty else int(pybullet.connect(pybullet.DIRECT))


def leave_world(world: int) -> None:
    """Empty a world for whoever opens one next; once is enough, twice does no harm."""
    if world not in _empty:
        pybullet.resetSimulation(physicsClientId=world)
        _empty.append(world)
