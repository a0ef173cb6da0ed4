"""POD, the proxy observation discrepancy: how unlike two domains answer the same commands."""

from dataclasses import dataclass
from typing import ClassVar, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from proxytune.errors import InputError
from proxytune.scores import Array

Reduction = Literal["mean", "sum"]


@dataclass(frozen=True)
class Pod:
    """A proxy observation discrepancy.

    Attributes:
        value: Mean or sum over time of the discrepancy of the observations, 0 or more.
        unit: Its unit.
        kind: What was observed, "pose" or "image".
        norm: How two observations were compared.
        reduction: Whether the discrepancies were averaged or added over time.
        discrepancies: The discrepancy at each time, shape (…, time).
    """

    value: float
    unit: str
    kind: Literal["pose", "image"]
    norm: str
    reduction: Reduction
    discrepancies: Array
    better: ClassVar[str] = "lower"

    @property
    def range(self) -> tuple[float, float | None]:
        """Smallest and largest possible value; None where there is no bound."""
        if self.kind == "pose":
            return 0.0, None
        return 0.0, 1.0 if self.reduction == "mean" else float(self.discrepancies.size)

    @property
    def observations(self) -> int:
        """How many pairs of observations were compared."""
        return self.discrepancies.size


def pod_of_poses(
    *, proxy: ArrayLike, target: ArrayLike, reduction: Reduction = "mean", metres_per_radian: float = 0.0
) -> Pod:
    """Compare poses under the same commands, eq. (1) of the paper: ‖(Δx, Δy, a·Δheading)‖₂ at each time.

    Args:
        proxy: Poses in the proxy, shape (…, time, 3): x [m], y [m], heading [rad].
        target: Poses on the target at the same times, same shape.
        reduction: Average over time, or add up as in the paper.
        metres_per_radian: The weight a of the heading; 0 compares positions alone. Headings differ by π at most.

    Raises:
        InputError: If the shapes differ or are none of poses, or a value is missing.
    """
    one, other = _pair(proxy, target)
    if one.ndim < 2 or one.shape[-1] != 3:
        raise InputError(f"poses are arrays of shape (…, time, 3): x, y, heading; got {one.shape}")
    difference = one - other
    turned = np.angle(np.exp(1j * difference[..., 2]))
    discrepancies = np.sqrt(difference[..., 0] ** 2 + difference[..., 1] ** 2 + (metres_per_radian * turned) ** 2)
    norm = (
        f"Euclidean norm of (x, y, {metres_per_radian:g} m/rad · heading)" if metres_per_radian else "distance (x, y)"
    )
    return Pod(_reduce(discrepancies, reduction), "m", "pose", norm, reduction, discrepancies)


def pod_of_images(*, proxy: ArrayLike, target: ArrayLike, reduction: Reduction = "mean") -> Pod:
    """Compare camera images under the same commands, eq. (1): root mean square over pixels and channels at each time.

    That is the Euclidean norm of the paper divided by the square root of the number of pixels, as a fraction of
    full scale, so that it does not depend on the resolution.

    Args:
        proxy: Images in the proxy, shape (time, height, width) or (time, height, width, channels): whole numbers of
            0 to 255 or fractions of 0 to 1.
        target: Images on the target at the same times, same shape and type.
        reduction: Average over time, or add up as in the paper.

    Raises:
        InputError: If shapes or types differ or are none of images, or a value is missing or beyond full scale.
    """
    if (np.asarray(proxy).dtype.kind in "iu") != (np.asarray(target).dtype.kind in "iu"):
        raise InputError("images of proxy and target must both be whole numbers (0 to 255) or both fractions (0 to 1)")
    full_scale = 255.0 if np.asarray(proxy).dtype.kind in "iu" else 1.0
    one, other = _pair(proxy, target)
    if one.ndim not in (3, 4):
        raise InputError(f"images are arrays of shape (time, height, width) or with channels last; got {one.shape}")
    if min(one.min(), other.min()) < 0 or max(one.max(), other.max()) > full_scale:
        raise InputError(f"images must be within 0 and {full_scale:g}")
    squares = ((one - other) / full_scale) ** 2
    discrepancies = np.sqrt(squares.reshape(len(squares), -1).mean(axis=1))
    norm = "root mean square over pixels and channels"
    return Pod(_reduce(discrepancies, reduction), "of full scale", "image", norm, reduction, discrepancies)


def _pair(proxy: ArrayLike, target: ArrayLike) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    one, other = np.asarray(proxy, dtype=np.float64), np.asarray(target, dtype=np.float64)
    if one.shape != other.shape:
        raise InputError(f"proxy and target must be observed at the same times: shapes {one.shape} and {other.shape}")
    if one.size == 0:
        raise InputError("there is no observation to compare")
    if not (np.isfinite(one).all() and np.isfinite(other).all()):
        raise InputError("an observation is missing (NaN); leave out times at which either domain was not observed")
    return one, other


def _reduce(discrepancies: Array, reduction: Reduction) -> float:
    return float(discrepancies.mean() if reduction == "mean" else discrepancies.sum())
