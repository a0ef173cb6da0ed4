"""Measured drives become arrays: increments, duties, and the robot that they are of."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from one_line import complaint_of
from planted import ROBOT, TRUTH, driven_log, planted_log

from proxytune.diagnosis import robot_of
from proxytune.diagnosis.motion import drives as gathering
from proxytune.diagnosis.motion.drives import Recent, cosine_and_sine, duties_of, gather, number_of, relative, sum_by
from proxytune.driving import read_robot
from proxytune.errors import LogError
from proxytune.importing import Facts, Wanted, open_log
from proxytune.logs import Log, LogEpisode


@pytest.mark.parametrize("reach", [1e-9, 1.0, 100.0])
def test_they_are_those_of_numpy_for_any_angle(reach):
    angle = np.random.default_rng(1).uniform(-reach, reach, (7, 500))
    np.testing.assert_allclose(cosine_and_sine(angle), (np.cos(angle), np.sin(angle)), rtol=0.0, atol=1e-14)


def test_right_angles_are_exact_ticks_at_least_60_per_second_and_sums_and_runs_by_labels_in_order():
    cosine, sine = cosine_and_sine(np.arange(-6, 7) * np.pi / 2.0)
    np.testing.assert_allclose(cosine + 1j * sine, 1j ** np.arange(-6, 7), rtol=0.0, atol=1e-14)
    assert [part.item() for part in cosine_and_sine(np.zeros(()))] == [1.0, 0.0]
    drives = gathered(episode([0.0, 0.1, 0.2]))
    assert (drives.tick_hz, drives.rate_hz) == (60.0, 20.0)
    slow = replace(log(episode([0.0, 0.1, 0.2])), rate_hz=7.0)
    assert gather(slow, ROBOT, slow.episodes).tick_hz == 63.0
    sums = sum_by(np.array([0, 2, -1, 2]), np.arange(8.0).reshape(4, 2), 3, np.array([2.0, 1.0, 5.0, -1.0]))
    np.testing.assert_array_equal(sums, [[0, 2], [0, 0], [-4, -4]])
    assert number_of(np.array([4, 4, 1, 7, 7])).tolist() == [0, 0, 1, 2, 2]


SPEED_PER_RAD = 0.0318 / 0.6


def episode(x, *, commands=None, wheels=None, name="a"):
    """A drive along x, 20 rows per second; None where there is no pose."""
    rows = len(x)
    place = np.array([np.nan if value is None else value for value in x], dtype=float)
    poses = np.stack((place, 0.0 * place, 0.0 * place), axis=1)
    commands = np.full((rows, 2), 0.5) if commands is None else np.array(commands, dtype=float)
    wheels = None if wheels is None else np.array(wheels, dtype=float)
    return LogEpisode(name, np.arange(rows) / 20.0, commands, poses, wheels)


def log(*episodes, command="duty"):
    return Log("yard", "duckiebot", command, 20.0, {}, episodes)


def gathered(*episodes, command="duty"):
    return gather(log(*episodes, command=command), ROBOT, episodes)


def rows_of(drives):
    return [(int(a), int(b)) for a, b in zip(drives.first // 3, drives.last // 3, strict=True)]


def test_poses_that_repeat_are_older_ones_and_a_robot_that_stands_shows_one_every_fifth_of_a_second():
    assert rows_of(gathered(episode([0.0, 0.1, 0.1, 0.2]))) == [(0, 1), (1, 3)]
    assert rows_of(gathered(episode([0.0] * 10))) == [(0, 4), (4, 8)]


def test_increments_are_linked_within_an_episode_span_missing_poses_and_break_where_left_out():
    assert rows_of(gathered(episode([0.0, *[None] * 19, 1.0, 1.1]))) == [(0, 20), (20, 21)]
    drives = gathered(episode([0.0, 0.1, *[None] * 20, 1.0, 1.1]))
    assert rows_of(drives) == [(0, 1), (22, 23)]
    assert drives.linked.tolist() == [False, False]
    drives = gathered(episode([0.0, 0.1, 0.2, 0.3, 0.4]), episode([0.0, 0.1, 0.2], name="b"))
    some = drives.only(np.array([True, True, False, True, False, True]))
    assert some.linked.tolist() == [False, True, False, False]
    assert some.block.tolist() == [0, 0, 0, 1]
    assert rows_of(some) == [(0, 1), (1, 2), (3, 4), (1, 2)]
    assert drives.only(drives.episode == 1).block.tolist() == [0, 0]
    drives = gathered(episode([0.0, 0.1, 0.2]), episode([5.0, 5.1, 5.2], name="b"))
    assert drives.linked.tolist() == [False, True, False, True]
    assert drives.episode.tolist() == [0, 0, 1, 1]
    assert drives.block.tolist() == [0, 0, 1, 1]
    drives = gathered(episode([None, None, None]), episode([0.0, 0.1, 0.2], name="b"))
    assert drives.episode.tolist() == [1, 1]
    seen = relative(np.array([1.0, 2.0, np.pi / 2]), np.array([0.5, 5.0, 3.0]))
    np.testing.assert_allclose(seen, [3.0, 0.5, 3.0 - np.pi / 2], atol=1e-12)


def test_episodes_of_different_length_and_headings_between_are_filled():
    long = episode([0.0, 0.1, 0.2], commands=[[0.1, 0.2]] * 3)
    duties = gathered(long, episode([0.0, 0.1], commands=[[0.3, 0.4], [0.5, 0.6]], name="b")).duties
    assert duties.shape == (2, 9, 2)
    np.testing.assert_array_equal(duties[1, ::3], [[0.3, 0.4], [0.5, 0.6], [0.5, 0.6]])
    one = episode([0.0, None, 0.2])
    poses = one.poses.copy()
    poses[[0, 2], 2] = (1.0, 2.0)
    np.testing.assert_allclose(gathered(replace(one, poses=poses)).headings[0, :7], 1.0 + np.arange(7) / 6.0)


def test_logs_without_two_poses_in_a_row_or_commands_are_refused_and_travel_is_the_way_without_noise():
    with pytest.raises(LogError, match="yard: no two measured poses"):
        gathered(episode([0.0, None, None]))
    with pytest.raises(LogError, match="yard: has no commands"):
        duties_of(log(command="none"), ROBOT, np.empty((3, 0)))
    random = np.random.default_rng(1)
    x = 0.01 * np.arange(400)
    noisy = gathered(episode(x + random.normal(0.0, 0.015, 400)))
    assert np.abs(np.diff(noisy.poses[:, :, 0])).sum() > 5.0
    assert noisy.travel[:, 0].sum() == pytest.approx(3.99, rel=0.03)
    np.testing.assert_allclose(gathered(episode(x)).travel[:, 0], 0.01, rtol=1e-9)


@pytest.mark.parametrize(
    ("command", "given", "duty"),
    [
        ("duty", (0.4, -0.7), (0.4, -0.7)),
        ("twist", (0.3, 1.0), ((0.3 - 0.08) / 0.6, (0.3 + 0.08) / 0.6)),
        ("twist", (-0.2, -0.5), ((-0.2 + 0.04) / 0.6, (-0.2 - 0.04) / 0.6)),
        ("wheel_speed", (10.0, -5.0), (10.0 * SPEED_PER_RAD, -5.0 * SPEED_PER_RAD)),
    ],
)
def test_every_kind_of_command_becomes_a_fraction_of_full_speed(command, given, duty):
    np.testing.assert_allclose(duties_of(log(command=command), ROBOT, np.array([given, given])), [duty, duty])


@pytest.mark.parametrize(("command", "given"), [("twist", (0.5, 2.0)), ("wheel_speed", (19.0, 0.0))])
def test_more_than_full_speed_is_refused_with_what_to_state(command, given):
    with pytest.raises(LogError, match=r"asks a wheel for .* m/s, more than .*full_speed_m_s"):
        duties_of(log(command=command), ROBOT, np.array([given]))


def test_wheel_speeds_are_used_where_all_episodes_have_them_without_a_gap():
    drives = gathered(episode([0.0, 0.1, 0.2], wheels=[[3.0, 4.0], [np.nan, np.nan], [5.0, 6.0]]))
    assert drives.wheels is None
    assert drives.rest[0, 0] == pytest.approx(3.0 * SPEED_PER_RAD)
    assert gathered(episode([0.0, 0.1], wheels=[[np.nan, np.nan], [5.0, 6.0]])).rest.tolist() == [[0.0, 0.0]]

    assert gathered(episode([0.0, 0.1], wheels=np.ones((2, 2))), episode([0.0, 0.1], name="b")).wheels is None

    still = episode([0.0, 0.1])
    turning = episode([0.0, 0.1], wheels=[[3.0, 4.0], [5.0, 6.0]])
    np.testing.assert_array_equal(gathered(still).rest, [[0.0, 0.0]])
    drives = gathered(turning)
    np.testing.assert_allclose(drives.rest, [[3.0 * SPEED_PER_RAD, 4.0 * SPEED_PER_RAD]])
    np.testing.assert_allclose(drives.wheels[0, 3:, 1], 6.0 * SPEED_PER_RAD)

    np.testing.assert_allclose(gathered(episode(0.01 * np.arange(40))).rest[0], 0.2 / ROBOT.figures["full_speed"])
    np.testing.assert_array_equal(gathered(episode(0.004 * np.arange(40) ** 2 / 40)).rest[0], 0.0)


def test_counts_of_encoders_in_a_table_tell_how_far_wheels_have_turned_and_whether_they_did_at_the_start(tmp_path):
    spinning = np.array([3.0, 4.0])  # faster than it drives: its wheels slip
    rows = [
        pd.DataFrame({"run": e.name, "time": e.times, "left": e.commands[:, 0], "right": e.commands[:, 1]})
        .assign(x=e.poses[:, 0], y=e.poses[:, 1], heading=e.poses[:, 2])
        .assign(
            **{
                f"{side}_ticks": np.round(e.times * speed * 4096.0 / (2.0 * np.pi))
                for side, speed in zip("lr", spinning, strict=True)
            }
        )
        for e in planted_log(TRUTH, episodes=2).episodes
    ]
    pd.concat(rows).to_csv(tmp_path / "drives.csv", index=False)
    columns = {"wheel_left": "l_ticks:ticks/4096", "wheel_right": "r_ticks:ticks/4096"}
    with open_log(tmp_path / "drives.csv", Wanted(columns=columns), Facts(robot="duckiebot")) as (imported, _):
        drives = gather(imported, ROBOT, imported.episodes)
    np.testing.assert_allclose(drives.rest, np.tile(spinning * SPEED_PER_RAD, (2, 1)), rtol=0.02)
    seconds = np.arange(drives.angles.shape[1]) / drives.tick_hz
    np.testing.assert_allclose(drives.angles, np.tile(seconds[:, None] * spinning, (2, 1, 1)), atol=0.05)


def at_own_times(issued, commands, rows=4, wheels=None):
    drive = replace(episode([0.1 * k for k in range(rows)], wheels=wheels), commands=np.array(commands, dtype=float))
    return gathered(replace(drive, issued=np.array(issued)))


def test_commands_are_held_from_their_own_times_also_from_before_the_first_sample():
    drives = at_own_times([0.025, 0.1], [[0.6, 0.3], [0.0, 0.2]])
    np.testing.assert_allclose(drives.duties[0, :8, 0], [0, 0.3, 0.6, 0.6, 0.6, 0.6, 0, 0], atol=1e-12)
    assert np.flatnonzero(drives.issued[0]).tolist() == [1, 6]
    assert drives.rate_hz == pytest.approx(1.0 / 0.075)

    drives = at_own_times([-1.4, -1.2, 0.05], [[0.9, 0.9], [0.6, 0.3], [0.0, 0.2]])
    np.testing.assert_allclose(drives.rest, [[0.6, 0.3]])
    np.testing.assert_allclose(drives.duties[0, :4, 1], [0.3, 0.3, 0.3, 0.2])
    assert np.flatnonzero(drives.issued[0]).tolist() == [3]

    rows = [[0.1, 0.2], [0.3, 0.1], [0.0, 0.0], [0.5, 0.5]]
    plain = gathered(episode([0.0, 0.1, 0.2, 0.3], commands=rows))
    own = at_own_times([0.0, 0.05, 0.1, 0.15], rows)
    np.testing.assert_allclose(own.duties, plain.duties, atol=1e-12)
    np.testing.assert_array_equal(own.issued, plain.issued)
    assert own.rate_hz == pytest.approx(plain.rate_hz)


def test_the_same_is_worked_out_once_and_what_was_asked_for_longest_ago_is_forgotten_first():
    recent, made, fill = Recent(), [], list(range(gathering.MOST))
    for key in (*fill, 0, gathering.MOST, 0, 1):
        assert recent.get(key, lambda key=key: made.append(key) or 10 * key) == 10 * key
    assert made == [*fill, gathering.MOST, 1]


OWN = {"wheel_radius": 0.05, "effective_baseline": 0.4}


@pytest.fixture(scope="module")
def vehicle():
    return planted_log({}, episodes=2, seconds=10.0, noise=None)


def with_commands(vehicle, kind, commands, geometry=OWN):
    episodes = tuple(replace(e, commands=np.array(commands, dtype=float)) for e in vehicle.episodes)
    return replace(vehicle, robot="tractor", command=kind, geometry=dict(geometry), episodes=episodes)


def test_a_robot_is_its_folder_s_the_named_one_or_the_log_s_geometry_and_its_speed_positive(vehicle):
    assert robot_of(vehicle) == read_robot("duckiebot")
    assert robot_of(vehicle, "husky") == read_robot("husky")
    assert robot_of(replace(vehicle, robot="tractor"), "duckiebot") == read_robot("duckiebot")
    own = replace(vehicle, robot="tractor", geometry={**OWN, "full_speed": 1.5})
    assert robot_of(own, "tractor") == robot_of(own)
    robot = robot_of(replace(vehicle, robot="tractor", geometry={**OWN, "full_speed": 1.5}))
    assert (robot.name, robot.theta, robot.urdf) == ("tractor", {}, None)
    assert dict(robot.figures) == {**OWN, "full_speed": 1.5, "motor_time_constant": 0.0, "control_rate": 20.0}
    assert robot_of(with_commands(vehicle, "duty", np.zeros((200, 2)))).figures["full_speed"] > 0.0


@pytest.mark.parametrize(
    ("geometry", "missing"),
    [
        ({}, "wheel_radius_m and baseline_m"),
        ({"wheel_radius": 0.05}, "baseline_m"),
        ({"effective_baseline": 0.4}, "wheel_radius_m"),
    ],
)
def test_an_unknown_robot_needs_its_geometry(vehicle, geometry, missing):
    with pytest.raises(LogError, match=f"robot 'tractor' is unknown .* does not state {missing};"):
        robot_of(replace(vehicle, robot="tractor", geometry=geometry))


@pytest.mark.parametrize(
    ("kind", "command", "fastest"),
    [("twist", (0.8, 1.0), 1.0), ("twist", (0.0, -3.0), 0.6), ("wheel_speed", (10.0, -23.0), 1.2)],
)
def test_full_speed_is_taken_from_the_fastest_command_and_no_command_is_beyond_it(vehicle, kind, command, fastest):
    told = with_commands(vehicle, kind, [command, (0.0, 0.0)])
    robot = robot_of(told)
    assert robot.figures["full_speed"] == pytest.approx(fastest)
    assert np.abs(duties_of(told, robot, told.episodes[0].commands)).max() <= 1.0 + 1e-9


@pytest.mark.parametrize("rows", [1200, 40])
def test_full_speed_of_duties_is_how_fast_it_drove(rows):
    at_once = {"delay": 0.0, "motor_lag.time_constant": 0.0}
    straight = driven_log(at_once, np.full((3, rows, 2), 0.5), np.zeros((3, 3)), noise=None)
    robot = robot_of(replace(straight, robot="tractor", geometry=dict(OWN)))
    assert robot.figures["full_speed"] == pytest.approx(0.6, rel=0.05)


CAR = read_robot("car")


def test_a_car_is_asked_for_no_more_than_its_full_speed_in_any_kind():
    """0.5 m/s at half lock: as shares, as speed and wheel angle, as speed and yaw rate."""
    angle, figures = np.radians(CAR.figures["wheel_angle"]) / 2.0, CAR.figures
    wanted = np.array([[0.5 / figures["full_speed"], 0.5]])
    turn = 0.5 * np.tan(angle) / figures["wheelbase"]
    for command, asked in (("ackermann", wanted[0]), ("speed_steering", (0.5, angle)), ("twist", (0.5, turn))):
        log = Log("log", "car", command, 20.0, {}, ())
        np.testing.assert_allclose(duties_of(log, CAR, np.array([asked])), wanted, err_msg=command)
    with pytest.raises(LogError, match="more than the full speed"):
        duties_of(Log("log", "car", "speed_steering", 20.0, {}, ()), CAR, np.array([[99.0, 0.0]]))


@pytest.mark.parametrize("early_s", [0.002, 0.05, 0.4])
def test_a_command_shortly_before_the_first_pose_has_not_been_in_force_for_ever(early_s):
    """A robot that answers with a lag stands at the first pose, or has just begun to move."""
    first = replace(episode(np.zeros(40)), issued=np.array([0.0, 1.0]), commands=np.array([[0.5, 0.5], [0.2, 0.2]]))
    on_time, early = gathered(first), gathered(replace(first, issued=np.array([-early_s, 1.0])))
    lead = early.lead
    assert on_time.lead == 0 < lead == 3 * int(np.ceil(early_s * 20.0 - 1e-9))
    np.testing.assert_array_equal(early.rest, 0.0)
    np.testing.assert_array_equal(early.first, on_time.first + lead)
    np.testing.assert_array_equal(early.headings[:, lead:], on_time.headings)
    np.testing.assert_allclose(early.duties[:, lead:], on_time.duties)
    np.testing.assert_allclose(early.duties[0, :lead, 0].sum() / 60.0, 0.5 * early_s)
    long_ago = gathered(replace(first, issued=np.array([-1.5, 1.0])))
    np.testing.assert_array_equal(long_ago.rest, [[0.5, 0.5]])
    assert long_ago.lead == 0


def test_a_car_that_is_met_in_motion_has_its_own_speed_and_the_steering_that_was_sent():
    x, car = 0.04 * np.arange(40), read_robot("car")
    moving = replace(episode(x), issued=np.array([-0.01]), commands=np.array([[0.3, 0.2]]))
    met = replace(log(moving, command="ackermann"), robot="car")
    np.testing.assert_allclose(gather(met, car, met.episodes).rest, [[0.8 / car.figures["full_speed"], 0.2]])
    still = replace(met, episodes=(replace(moving, poses=0.0 * moving.poses),))
    np.testing.assert_array_equal(gather(still, car, still.episodes).rest, [[0.0, 0.0]])


@pytest.mark.parametrize(("robot", "command"), [("car", "duty"), ("car", "wheel_speed"), ("duckiebot", "ackermann")])
def test_commands_of_the_other_kind_of_drive_are_refused_in_one_line(robot, command):
    told = complaint_of(duties_of, Log("log", robot, command, 20.0, {}, ()), read_robot(robot), np.zeros((2, 2)))
    assert f"commands of kind '{command}' are not for robot '{robot}'" in told


@pytest.mark.parametrize(("robot", "command", "ticks"), [("car", "ackermann", 1), ("duckiebot", "duty", 2)])
def test_a_rate_measured_just_below_that_of_ticks_takes_no_twice_as_many_of_a_car(robot, command, ticks):
    """Of robots on two wheels it does: their published results stay what they are."""
    rate_hz = 59.9998
    drive = replace(episode(np.linspace(0.0, 1.0, 60)), times=np.arange(60) / rate_hz)
    drives = gather(Log("yard", robot, command, rate_hz, {}, (drive,)), read_robot(robot), [drive])
    assert drives.tick_hz == pytest.approx(ticks * rate_hz)
    assert drives.last[-1] == 59 * ticks


def test_a_car_is_simulated_no_less_often_than_its_rate_falls_short_by_a_little():
    drive = replace(episode(np.linspace(0.0, 1.0, 60)), times=np.arange(60) / 50.0)
    assert gather(Log("yard", "car", "ackermann", 50.0, {}, (drive,)), CAR, [drive]).tick_hz == 100.0
