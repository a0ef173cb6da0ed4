"""What a VESC was sent is read as speed and wheel angle, by the gains of the car's own vesc.yaml."""

import bags
import numpy as np
import pytest
from one_line import complaint_of

from proxytune.errors import LogError
from proxytune.importing import Wanted
from proxytune.importing.topics import read_bag

SPEED, ANGLE = np.array([0.0, 1.0, 2.0, 2.0, -0.5]), np.array([0.0, 0.1, 0.1, -0.3, 0.2])
ISSUED = 1.7e9 + np.arange(5) * 0.1
POSES = [(0.1 * row, 0.0, 0.0) for row in range(60)]
TIMES = 1.7e9 + np.arange(60) * 0.01
GAINS = {
    "speed_to_erpm_gain": 4614.0,
    "speed_to_erpm_offset": 20.0,
    "steering_angle_to_servo_gain": -1.2135,
    "steering_angle_to_servo_offset": 0.5304,
}


def write_gains(path, indent="", **changes):
    stated = {**GAINS, **changes}
    lines = [f"{indent}{name}: {value}  # as tuned" for name, value in stated.items() if value is not None]
    path.write_text("\n".join(["/**:", "  ros__parameters:"] * bool(indent) + lines), encoding="utf-8")
    return path


def sent(prefix="", servo_after_s=0.0003, motor=ISSUED, servo=ISSUED):
    """Messages to motor and servo, each on a topic of its own; the servo's come a little later."""
    erpm = GAINS["speed_to_erpm_gain"] * SPEED + GAINS["speed_to_erpm_offset"]
    places = GAINS["steering_angle_to_servo_gain"] * ANGLE + GAINS["steering_angle_to_servo_offset"]
    to = (("motor/speed", motor, erpm), ("servo/position", servo + servo_after_s, places))
    return [
        (f"{prefix}/commands/{topic}", "std_msgs/msg/Float64", time, {"data": value})
        for topic, times, values in to
        for time, value in zip(times, values, strict=True)
    ]


def read(tmp_path, *messages, gains, storage="mcap", **wanted):
    all_of_them = sorted([*messages, *bags.pose_messages(TIMES, POSES)], key=lambda message: message[2])
    path = bags.write_messages(tmp_path / ("car.bag" if storage == "ros1" else "car"), storage, all_of_them)
    return read_bag(path, Wanted(vesc=gains, **wanted))


@pytest.mark.parametrize(("storage", "prefix", "indent"), [("ros1", "/vesc", ""), ("mcap", "", "    ")])
def test_motor_and_servo_are_read_as_the_speed_and_angle_that_were_asked_for(tmp_path, storage, prefix, indent):
    gains = write_gains(tmp_path / "vesc.yaml", indent)
    source = read(tmp_path, *sent(prefix), gains=gains, storage=storage)
    commands = source.drives[0].commands
    assert commands.kind == "speed_steering"
    assert commands.values == pytest.approx(np.column_stack((SPEED, ANGLE)), abs=1e-9)
    assert commands.times == pytest.approx(ISSUED + 0.0003, abs=1e-6)
    taken = {channel.name for channel in source.channels if channel.role == "commands"}
    assert taken == {f"{prefix}/commands/motor/speed", f"{prefix}/commands/servo/position"}
    assert any("speed is (erpm -20) / 4614" in note and str(gains) in note for note in source.notes)


def test_a_servo_that_is_sent_at_its_own_times_holds_between_them(tmp_path):
    commands = read(tmp_path, *sent(servo=ISSUED + 0.05), gains=write_gains(tmp_path / "vesc.yaml")).drives[0].commands
    assert commands.times == pytest.approx(
        1.7e9 + 0.0503 + np.array([0.0, 0.0497, 0.1, 0.1497, 0.2, 0.2497, 0.3, 0.3497, 0.4]), abs=1e-5
    )
    assert commands.values[:3] == pytest.approx(np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 0.1]]), abs=1e-9)


def test_an_ackermann_command_goes_first_without_gains_and_a_motor_without_a_servo_is_none(tmp_path):
    twists = bags.twist_messages(ISSUED, np.column_stack((SPEED, ANGLE)))
    assert read(tmp_path, *sent(), *twists, gains=None).drives[0].commands.kind == "twist"
    with pytest.raises(LogError, match="no topic has commands"):
        read(tmp_path / "again", *sent()[:5], gains=None)


@pytest.mark.parametrize(
    ("changes", "says"),
    [
        (None, "--vesc vesc.yaml"),
        ({"speed_to_erpm_gain": None}, "speed_to_erpm_gain is missing"),
        ({"steering_angle_to_servo_gain": 0.0}, "steering_angle_to_servo_gain is '0.0'"),
        ({"steering_angle_to_servo_offset": "half"}, "steering_angle_to_servo_offset is 'half'"),
        ({"speed_to_erpm_offset": ".nan"}, "speed_to_erpm_offset is '.nan'"),
    ],
)
def test_gains_that_are_not_there_are_asked_for_in_one_line(tmp_path, changes, says):
    gains = None if changes is None else write_gains(tmp_path / "vesc.yaml", **changes)
    assert says in complaint_of(lambda: read(tmp_path, *sent(), gains=gains))


def test_a_file_of_gains_that_is_none_is_refused_in_one_line(tmp_path):
    (tmp_path / "picture.yaml").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(LogError, match=r"picture.yaml: cannot be read as text"):
        read(tmp_path, *sent(), gains=tmp_path / "picture.yaml")
    with pytest.raises(LogError, match=r"none.yaml: no such file"):
        read_bag(tmp_path / "car", Wanted(vesc=tmp_path / "none.yaml"))
