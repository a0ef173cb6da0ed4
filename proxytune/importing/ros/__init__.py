"""ROS 1 and ROS 2 bags: which topics are commands, poses and pictures, and their messages as numbers."""

from proxytune.importing.bag import is_bag
from proxytune.importing.topics import read_bag

__all__ = ["is_bag", "read_bag"]
