"""A ROS 2 node that plays a designed drive: commands.csv beside it, told as velocities and as they stand."""

from pprint import pformat
from string import Template

import numpy as np

from proxytune.diagnosis import Diagnosis, commands_as
from proxytune.driving import Robot
from proxytune.logs import CAR_COMMANDS, COMMANDS

PLAYER = Template('''\
#!/usr/bin/env python3
"""Play commands.csv, the drive that proxytune designed, once, and stop.

Drive it $times times: from the middle of a free floor of $room m, facing along its length; log commands and poses.
Watch the robot, and stop this node (ctrl-C, which tells the robot to stop) where it comes near an edge.

Run (nothing else of proxytune is needed):
    python3 THIS_FILE --ros-args -r $topic:=/$topic$stamped
$topic hears $message; wheel_commands hears the columns $columns of commands.csv as they stand, as Float64MultiArray.
"""

import csv
from pathlib import Path

import rclpy
from $package import $kinds
from rclpy.node import Node
from std_msgs.msg import Float64MultiArray

COLUMNS = $names
TO_VELOCITY = $matrix  # $what, of each column
RATE_HZ = $rate


class Player(Node):
    """Tells a row of the table every 1 / RATE_HZ."""

    def __init__(self):
        super().__init__("proxytune_player")
        with open(Path(__file__).with_name("commands.csv"), encoding="utf-8", newline="") as table:
            self.rows = [tuple(float(row[name]) for name in COLUMNS) for row in csv.DictReader(table)]
        self.next, self.done = 0, False
$setup
        self.raw = self.create_publisher(Float64MultiArray, "wheel_commands", 10)
        self.create_timer(1.0 / RATE_HZ, self.play)

    def play(self):
        """Tell the next row; after the last one rest."""
        self.done = self.next >= len(self.rows)
        self.tell((0.0, 0.0) if self.done else self.rows[self.next])
        self.next += 1

    def tell(self, row):
        """Tell the robot one row."""
        first, second = (sum(share * one for share, one in zip(line, row)) for line in TO_VELOCITY)
$fill
        self.publisher.publish(message)
        self.raw.publish(Float64MultiArray(data=list(row)))


def main():
    """Play the table."""
    rclpy.init()
    player = Player()
    try:
        while rclpy.ok() and not player.done:
            rclpy.spin_once(player)
    except KeyboardInterrupt:
        pass
    finally:
        if rclpy.ok():
            player.tell((0.0, 0.0))
            rclpy.shutdown()


if __name__ == "__main__":
    main()
''')
TWIST = {
    "topic": "cmd_vel",
    "message": "Twist, or with `-p stamped:=true` TwistStamped",
    "stamped": " -p stamped:=true",
    "package": "geometry_msgs.msg",
    "kinds": "Twist, TwistStamped",
    "what": "speed [m/s] and yaw rate [rad/s]",
    "setup": """\
        self.kind = TwistStamped if self.declare_parameter("stamped", False).value else Twist
        self.publisher = self.create_publisher(self.kind, "cmd_vel", 10)""",
    "fill": """\
        message = self.kind()
        twist = message.twist if self.kind is TwistStamped else message
        if self.kind is TwistStamped:
            message.header.stamp = self.get_clock().now().to_msg()
        twist.linear.x, twist.angular.z = first, second""",
}
ACKERMANN = {
    "topic": "drive",
    "message": "AckermannDriveStamped",
    "stamped": "",
    "package": "ackermann_msgs.msg",
    "kinds": "AckermannDriveStamped",
    "what": "speed [m/s] and steering angle [rad]",
    "setup": """\
        self.publisher = self.create_publisher(AckermannDriveStamped, "drive", 10)""",
    "fill": """\
        message = AckermannDriveStamped()
        message.header.stamp = self.get_clock().now().to_msg()
        message.drive.speed, message.drive.steering_angle = first, second""",
}
"""What differs between robots that hear velocities and cars."""


def player_text(diagnosis: Diagnosis) -> str:
    """The node for the next drive of a diagnosis that has one, as a Python file."""
    drive, kind = diagnosis.next_drive, diagnosis.command
    assert drive is not None
    told = ACKERMANN if kind in CAR_COMMANDS else TWIST
    return PLAYER.substitute(
        told,
        times=drive.times,
        room=" × ".join(f"{side:.1f}" for side in drive.room),
        columns=" and ".join(COMMANDS[kind]),
        names=repr(COMMANDS[kind]),
        matrix=pformat(_to_velocity(kind, diagnosis.robot)),
        rate=round(drive.rate_hz, 6),
    )


def _to_velocity(kind: str, robot: Robot) -> tuple[tuple[float, ...], ...]:
    """How the columns of a kind of commands add up to a velocity: rows of the shares of both columns."""
    if kind == "twist":
        return ((1.0, 0.0), (0.0, 1.0))
    unit = np.eye(2)
    own = commands_as(kind, robot, unit)
    velocities = commands_as("speed_steering" if kind in CAR_COMMANDS else "twist", robot, unit)
    return tuple(tuple(float(f"{share:.9g}") for share in row) for row in (np.linalg.inv(own) @ velocities).T.tolist())


def commands_text(diagnosis: Diagnosis) -> str:
    """The next drive of a diagnosis that has one as a log's commands.csv, in the log's kind of commands."""
    drive = diagnosis.next_drive
    assert drive is not None
    rows = commands_as(diagnosis.command, diagnosis.robot, drive.commands).tolist()
    lines = [
        f"next,{number / drive.rate_hz:.4f},{first:.7g},{second:.7g}" for number, (first, second) in enumerate(rows)
    ]
    return "\n".join([",".join(("episode", "time", *COMMANDS[diagnosis.command])), *lines]) + "\n"
