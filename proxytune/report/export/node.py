"""A ROS 2 node that stands before the driver and bends commands as was found: `cmd_vel`, or a car's Ackermann drive."""

from collections.abc import Sequence
from pprint import pformat
from string import Template

from proxytune.driving import REQUIRED
from proxytune.effects import Stage, effect_of, is_learnt
from proxytune.report.export.instance import FILTER, Instance, header

RATE_HZ = 60.0
"""How often the node tells the driver a velocity; it is also the tick of proxytune's own plants."""
NODE = Template('''\
#!/usr/bin/env python3
"""Bend velocity commands as proxytune found that the robot does: between cmd_vel and the simulated driver.

$head

Run, with proxytune installed in the Python that ROS uses (3.11 or newer):
    python3 THIS_FILE --ros-args -r cmd_vel_in:=/cmd_vel -r cmd_vel_out:=/diff_drive/cmd_vel -p use_sim_time:=true
Messages are Twist, or with `-p stamped:=true` TwistStamped. After `timeout` [s] of silence the robot is told to stop.
"""

import rclpy
from geometry_msgs.msg import Twist, TwistStamped
from rclpy.node import Node

from proxytune import CommandFilter

THETA = $theta
FIGURES = $figures
HAS = $has  # what the simulator has already
RATE_HZ = $rate


class CommandVelocityFilter(Node):
    """Hears cmd_vel_in, tells cmd_vel_out."""

    def __init__(self):
        super().__init__("cmd_vel_filter")
        self.kind = TwistStamped if self.declare_parameter("stamped", False).value else Twist
        self.timeout = self.declare_parameter("timeout", 0.5).value
        self.filter = CommandFilter(THETA, figures=FIGURES, has=HAS, rate_hz=RATE_HZ)
        self.wanted, self.silent = (0.0, 0.0), 0.0
        self.publisher = self.create_publisher(self.kind, "cmd_vel_out", 10)
        self.create_subscription(self.kind, "cmd_vel_in", self.hear, 10)
        self.create_timer(1.0 / RATE_HZ, self.tell)

    def hear(self, message):
        """Keep the newest command."""
        twist = message.twist if self.kind is TwistStamped else message
        self.wanted, self.silent = (twist.linear.x, twist.angular.z), 0.0

    def tell(self):
        """Give the driver what the robot makes of it."""
        self.silent += 1.0 / RATE_HZ
        message = self.kind()
        twist = message.twist if self.kind is TwistStamped else message
        if self.kind is TwistStamped:
            message.header.stamp = self.get_clock().now().to_msg()
        wanted = self.wanted if self.silent <= self.timeout else (0.0, 0.0)
        twist.linear.x, twist.linear.y, twist.angular.z = self.filter.step(wanted)
        self.publisher.publish(message)


def main():
    """Run until it is stopped."""
    rclpy.init()
    rclpy.spin(CommandVelocityFilter())


if __name__ == "__main__":
    main()
''')
CAR_NODE = Template('''\
#!/usr/bin/env python3
"""Bend a car's commands as proxytune found that it does: between what drives and the simulated car.

$head

Run, with proxytune installed in the Python that ROS uses (3.11 or newer):
    python3 THIS_FILE --ros-args -r drive_in:=/drive -r drive_out:=/simulator/drive -p use_sim_time:=true
Messages are AckermannDriveStamped. After `timeout` [s] of silence the car is told to stop.
"""

import rclpy
from ackermann_msgs.msg import AckermannDriveStamped
from rclpy.node import Node

from proxytune import CommandFilter

THETA = $theta
FIGURES = $figures
HAS = $has  # what the simulator has already
RATE_HZ = $rate


class AckermannFilter(Node):
    """Hears drive_in, tells drive_out."""

    def __init__(self):
        super().__init__("ackermann_filter")
        self.timeout = self.declare_parameter("timeout", 0.5).value
        self.filter = CommandFilter(
            THETA, figures=FIGURES, has=HAS, rate_hz=RATE_HZ, command="speed_steering", reverse=$reverse
        )
        self.speed, self.angle, self.silent = 0.0, 0.0, 0.0
        self.publisher = self.create_publisher(AckermannDriveStamped, "drive_out", 10)
        self.create_subscription(AckermannDriveStamped, "drive_in", self.hear, 10)
        self.create_timer(1.0 / RATE_HZ, self.tell)

    def hear(self, message):
        """Keep the newest command."""
        self.speed, self.angle, self.silent = message.drive.speed, message.drive.steering_angle, 0.0

    def tell(self):
        """Give the driver what the car makes of it."""
        self.silent += 1.0 / RATE_HZ
        message = AckermannDriveStamped()
        message.header.stamp = self.get_clock().now().to_msg()
        speed = self.speed if self.silent <= self.timeout else 0.0
        message.drive.speed, message.drive.steering_angle = self.filter.step((speed, self.angle))
        self.publisher.publish(message)


def main():
    """Run until it is stopped."""
    rclpy.init()
    rclpy.spin(AckermannFilter())


if __name__ == "__main__":
    main()
''')


def node_text(instance: Instance, has: Sequence[str] = ()) -> str:
    """The node as a Python file: all values in it, no other file needed."""
    names = REQUIRED[instance.robot.drive]
    kinds, passed = instance.robot.catalogue, (Stage.COMMAND, Stage.ACTUATION, Stage.MOTION)
    known = {
        name: value
        for name, value in sorted(instance.theta.items())
        if is_learnt(name) or kinds.effect(effect_of(name)).stage in passed
    }
    return (CAR_NODE if instance.steers else NODE).substitute(
        head="\n".join(header(instance, FILTER, has)).replace("\\", "/").replace('"""', "'''"),
        theta=pformat(known, sort_dicts=False),
        figures=pformat({name: float(instance.figure(name)) for name in names}, sort_dicts=False),
        has=repr(tuple(has)),
        rate=RATE_HZ,
        reverse=instance.robot.reverse,
    )
