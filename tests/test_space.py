"""A box names its parameters in a fixed order and refuses bounds that cannot be searched."""

import pytest

from proxytune.errors import SettingsError
from proxytune.space import Interval, Parameter, Space

BOX = Space((Interval("trim", -0.3, 0.3), Interval("delay", 0.0, 0.3, "s")))


def test_a_point_keeps_its_values_through_names_and_back():
    theta = BOX.theta((0.1, 0.2))
    assert theta == {"trim": 0.1, "delay": 0.2}
    assert BOX.values(dict(reversed(theta.items()))) == (0.1, 0.2)


@pytest.mark.parametrize("bounds", [(1.0, 0.0), (1.0, 1.0), (float("nan"), 1.0), (0.0, float("inf"))])
def test_bounds_that_cannot_be_searched_are_refused_by_name(bounds):
    with pytest.raises(SettingsError, match="trim: "):
        Interval("trim", *bounds)


def test_values_are_clipped_to_bounds_and_neutral_ones_may_be_the_robots_own():
    parameter = Parameter(name="camera_height", unit="m", low=0.05, high=0.2, neutral="camera_height")
    assert parameter.neutral_value({"camera_height": 0.108}) == 0.108
    assert Parameter(name="trim", unit="", low=-1.0, high=1.0, neutral=0.0).neutral_value({}) == 0.0
    parameter = Parameter(name="trim", unit="", low=-1.0, high=0.5, neutral=0.0)
    assert [parameter.clipped(value) for value in (-2.0, 0.25, 2.0)] == [-1.0, 0.25, 0.5]
