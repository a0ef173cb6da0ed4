"""As much of ROS as the nodes that proxytune writes need, where it is not installed."""

import importlib.util
import sys
import types
from typing import ClassVar


class Twist:
    """A velocity."""

    def __init__(self):
        self.linear, self.angular = (types.SimpleNamespace(x=0.0, y=0.0, z=0.0) for _ in range(2))


class Stamped:
    """A velocity with a header."""

    def __init__(self):
        self.twist, self.header = Twist(), types.SimpleNamespace(stamp=None)


class Ackermann:
    """A speed and a steering angle with a header."""

    def __init__(self):
        self.header = types.SimpleNamespace(stamp=None)
        self.drive = types.SimpleNamespace(speed=0.0, steering_angle=0.0)


class Node:
    """Keeps what it tells, by topic; a test calls `heard` and `tick`."""

    parameters: ClassVar = {}

    def __init__(self, name):
        self.told = {}

    def declare_parameter(self, name, value):
        return types.SimpleNamespace(value=self.parameters.get(name, value))

    def create_publisher(self, kind, topic, depth):
        return types.SimpleNamespace(publish=self.told.setdefault(topic, []).append)

    def create_subscription(self, kind, topic, hear, depth):
        self.heard = hear

    def create_timer(self, period, tell):
        self.period, self.tick = period, tell

    def get_clock(self):
        return types.SimpleNamespace(now=lambda: types.SimpleNamespace(to_msg=lambda: "now"))


MODULES = {
    "rclpy": {},
    "rclpy.node": {"Node": Node},
    "geometry_msgs": {},
    "geometry_msgs.msg": {"Twist": Twist, "TwistStamped": Stamped},
    "ackermann_msgs": {},
    "ackermann_msgs.msg": {"AckermannDriveStamped": Ackermann},
    "std_msgs": {},
    "std_msgs.msg": {"Float64MultiArray": types.SimpleNamespace},
}


def load_node(path, monkeypatch, **parameters):
    """The module of a node, which is told these parameters."""
    for name, content in MODULES.items():
        monkeypatch.setitem(sys.modules, name, types.ModuleType(name))
        vars(sys.modules[name]).update(content)
    monkeypatch.setattr(Node, "parameters", parameters)
    spec = importlib.util.spec_from_file_location(path.stem, path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module
