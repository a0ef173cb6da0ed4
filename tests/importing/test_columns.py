"""Units are taken as stated, else as a column's name ends, and doubted where the values say otherwise."""

import numpy as np
import pytest

from proxytune.errors import LogError
from proxytune.importing.columns import UNITS, contradiction, epoch_unit, own_unit, split_ending, split_unit


@pytest.mark.parametrize(
    ("unit", "value", "ours"),
    [
        ("ns", 1.5e9, 1.5),
        ("us", 2e6, 2.0),
        ("ms", 250.0, 0.25),
        ("cm", 30.0, 0.3),
        ("mm", 1500.0, 1.5),
        ("km", 0.2, 200.0),
        ("deg", 180.0, np.pi),
        ("km/h", 36.0, 10.0),
        ("mm/s", 250.0, 0.25),
        ("deg/s", 90.0, np.pi / 2),
        ("rpm", 60.0, 2 * np.pi),
        ("percent", -50.0, -0.5),
        ("pwm255", 255.0, 1.0),
    ],
)
def test_a_stated_unit_is_converted_to_ours(unit, value, ours):
    column, found = split_unit(f"a column:{unit}", UNITS[unit].quantity, ["a column"], "here")
    assert column == "a column"
    assert value * found.factor == pytest.approx(ours, rel=1e-12)


def test_the_package_s_own_units_change_nothing_and_a_column_may_have_a_colon_in_its_name():
    assert [own_unit(unit.quantity).factor for unit in UNITS.values()] == [1.0] * len(UNITS)
    assert split_unit("imu:x", "length", ["imu:x"], "here") == ("imu:x", None)
    assert split_unit("imu:x:mm", "length", ["imu:x"], "here") == ("imu:x", UNITS["mm"])


@pytest.mark.parametrize(
    ("name", "quantity", "stem", "unit"),
    [
        ("stamp_ns", "time", "stamp", "ns"),
        ("Pos X [mm]", "length", "pos_x", "mm"),
        ("yaw (deg)", "angle", "yaw", "deg"),
        ("v_m_s", "speed", "v", "m/s"),
        ("v_mm_s", "speed", "v", "mm/s"),
        ("left [%]", "duty", "left", "percent"),
        ("%time", "time", "time", None),
        ("x_ms", "length", "x_ms", None),
        ("mm", "length", "mm", None),
    ],
)
def test_a_name_s_ending_gives_a_unit_of_the_same_quantity_alone(name, quantity, stem, unit):
    assert split_ending(name, quantity) == (stem, UNITS[unit] if unit else None)


@pytest.mark.parametrize(
    ("text", "quantity", "says"),
    [
        ("x:furlong", "length", "here: unknown unit 'furlong'; known are: m, mm, cm, km"),
        ("x:deg", "length", "'deg' is no unit of length; known are: m, mm, cm, km"),
        ("q:deg", "number", "has no unit; leave out ':deg'"),
    ],
)
def test_a_unit_that_does_not_go_with_the_quantity_is_refused(text, quantity, says):
    with pytest.raises(LogError, match=f"{says}$"):
        split_unit(text, quantity, [text[0]], "here")


@pytest.mark.parametrize(("time", "unit"), [(1.7e18, "ns"), (1.7e15, "us"), (1.7e12, "ms"), (1.7e9, None), (5.0, None)])
def test_stamps_since_1970_show_their_unit_by_their_size(time, unit):
    assert epoch_unit(np.array([time, np.nan])) == (UNITS[unit] if unit else None)


@pytest.mark.parametrize(
    ("unit", "values", "reason"),
    [
        ("deg", [-3.1, 0.2, 3.1], "look like radians"),
        ("rad", [179.0, -179.5, -178.0], "jump by 360"),
        ("ns", [0.0, 0.05, 0.1], "5e-11 s apart"),
        ("s", [0.0, 50.0, 100.0], "50 s apart"),
        ("m", [0.0, 3790.0], "3790 m from end to end"),
        ("m/s", [0.0, -250.0], "250 m/s"),
        ("duty", [0.0, 255.0], "more than full duty"),
    ],
)
def test_values_that_contradict_a_unit_are_told(unit, values, reason):
    assert reason in contradiction(UNITS[unit], np.array(values))


@pytest.mark.parametrize(
    ("unit", "values"),
    [
        ("deg", [0.0, 0.0]),
        ("deg", [-179.0, 20.0]),
        ("rad", [-3.1, 3.1, 8.0, 30.0]),
        ("s", [1.7e9, 1.7e9 + 0.05]),
        ("s", [np.nan, 3.0]),
        ("m", [431_000.0, 431_090.0]),
        ("duty", [-1.0, 1.0]),
        ("m", [np.nan]),
    ],
)
def test_values_that_fit_a_unit_pass(unit, values):
    assert contradiction(UNITS[unit], np.array(values)) == ""
