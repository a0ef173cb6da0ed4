"""POD compares what two domains answer to the same commands."""

import numpy as np
import pytest

from proxytune.errors import InputError
from proxytune.usefulness import pod_of_images, pod_of_poses

STILL = np.zeros((4, 3))
APART = STILL + np.array([3.0, 4.0, 0.0])


def test_poses_apart_by_three_and_four_are_five_apart():
    result = pod_of_poses(proxy=APART, target=STILL)
    assert (result.value, result.unit, result.observations) == (5.0, "m", 4)
    assert pod_of_poses(proxy=APART, target=STILL, reduction="sum").value == 20.0


def test_a_heading_counts_only_with_its_weight_and_goes_round():
    turned = STILL + np.array([0.0, 0.0, 2 * np.pi - 0.5])
    assert pod_of_poses(proxy=turned, target=STILL).value == 0.0
    result = pod_of_poses(proxy=turned, target=STILL, metres_per_radian=0.1)
    assert result.value == pytest.approx(0.05)
    assert "0.1 m/rad" in result.norm


def test_images_differ_by_a_fraction_of_full_scale_whatever_their_type_and_size():
    dark, bright = np.zeros((2, 3, 4, 3), dtype=np.uint8), np.full((2, 3, 4, 3), 51, dtype=np.uint8)
    assert pod_of_images(proxy=bright, target=dark).value == pytest.approx(0.2)
    assert pod_of_images(proxy=bright / 255, target=dark / 255).value == pytest.approx(0.2)
    assert pod_of_images(proxy=bright[..., 0], target=dark[..., 0], reduction="sum").value == pytest.approx(0.4)


def test_ranges_are_stated():
    image = np.zeros((2, 3, 4))
    assert pod_of_images(proxy=image + 1, target=image).range == (0.0, 1.0)
    assert pod_of_images(proxy=image + 1, target=image, reduction="sum").range == (0.0, 2.0)
    assert pod_of_poses(proxy=STILL, target=STILL).range == (0.0, None)


@pytest.mark.parametrize(
    ("measure", "proxy", "target", "complaint"),
    [
        (pod_of_poses, STILL, STILL[:2], "at the same times"),
        (pod_of_poses, STILL[:, :2], STILL[:, :2], "x, y, heading"),
        (pod_of_poses, STILL[:0], STILL[:0], "no observation"),
        (pod_of_poses, STILL * np.nan, STILL, "NaN"),
        (pod_of_images, STILL, STILL, "height, width"),
        (pod_of_images, np.zeros((1, 2, 2)), np.full((1, 2, 2), 200.0), "within 0 and 1"),
        (pod_of_images, np.zeros((1, 2, 2), np.uint8), np.zeros((1, 2, 2)), "must both be"),
    ],
)
def test_observations_that_cannot_be_compared_are_refused(measure, proxy, target, complaint):
    with pytest.raises(InputError, match=complaint):
        measure(proxy=proxy, target=target)
