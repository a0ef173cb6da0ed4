"""Poses out of a chain of transforms: composed, and interpolated where they come at different times."""

from collections.abc import Collection

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation, Slerp

from proxytune.errors import LogError
from proxytune.importing.orientation import complaint, headings_and_tilts, no_rotation
from proxytune.importing.ros.stamps import choose_times
from proxytune.importing.ros.transforms import Transform, chain_of
from proxytune.importing.source import Floats, Poses


def read_chain(transforms: dict[str, Transform], name: str, stamps: str, where: str) -> tuple[Poses, tuple[str, ...]]:
    """Poses of a child in a parent, at the times of the transform between them that comes most often.

    Other moving transforms are interpolated to these times; poses outside of what they cover are left out.

    Args:
        transforms: All transforms of a bag.
        name: Parent and child, as in "map>base_link".
        stamps: Whose times count.
        where: The bag and topic, as a complaint names them.

    Raises:
        LogError: If no chain leads from the one to the other, nothing in it moves, or a transform is no rotation.
    """
    chain = chain_of(transforms, name, where)
    for transform in chain:
        _check(transform, where)
    choices = {each.name: choose_times(each.stamps, stamps, each.name) for each in chain if each.moves}
    times = {moving: of_it for moving, (of_it, _) in choices.items()}
    most = max(times.values(), key=len)
    common = most[_covered(most, times.values())]
    if not len(common):
        raise LogError(f"{where}: the transforms of {name} share no time; name another pair by --poses")
    place, turn = np.zeros((len(common), 3)), Rotation.identity(1)
    for transform in chain:
        step, rotation = _at(transform.values, times.get(transform.name), common)
        place, turn = place + turn.apply(step), turn * rotation
    said = (note for _, notes in choices.values() for note in notes)
    poses = Poses(common, place, *headings_and_tilts(turn.as_quat(), f"{where}: {name}"))
    return poses, (_note(name, chain, len(most) - len(common)), *said)


def _check(transform: Transform, where: str) -> None:
    """Refuse numbers that are not finite and quaternions that are no rotation."""
    finite = np.isfinite(transform.values).all(axis=1)
    if not finite.all():
        number = int(np.argmin(finite)) + 1
        raise LogError(f"{where}: transform {transform.name}: number {number} is not finite; name another by --poses")
    wrong = no_rotation(transform.values[:, 3:])
    if wrong.any():
        raise complaint(transform.values[:, 3:], wrong, f"{where}: transform {transform.name}")


def _note(name: str, chain: list[Transform], left_out: int) -> str:
    parent, _, child = name.partition(">")
    names = ", ".join(transform.name for transform in chain)
    outside = f"; {left_out} outside of what all of them cover are left out" if left_out else ""
    return f"Poses of {child} in {parent} are composed of {names}{outside}."


def _covered(times: Floats, others: Collection[Floats]) -> NDArray[np.bool_]:
    """Which times lie within all others."""
    first, last = max(other.min() for other in others), min(other.max() for other in others)
    covered: NDArray[np.bool_] = (times >= first) & (times <= last)
    return covered


def _at(values: Floats, times: Floats | None, wanted: Floats) -> tuple[Floats, Rotation]:
    """Places and rotations at wanted times: straight between two places, by the shortest turn between two rotations.

    Without times, a transform stands still.
    """
    if times is None:
        return values[:1, :3], Rotation.from_quat(values[:1, 3:])
    if np.array_equal(times, wanted):
        return values[:, :3], Rotation.from_quat(values[:, 3:])
    stamps, order = np.unique(times, return_index=True)
    places = np.stack([np.interp(wanted, stamps, column) for column in values[order, :3].T], axis=1)
    rotations = Rotation.from_quat(values[order, 3:])
    return places, Slerp(stamps, rotations)(wanted) if len(stamps) > 1 else rotations
