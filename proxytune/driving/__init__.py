"""Differential-drive robots that follow a lane by what their camera sees: one domain family.

robot             robots as their robot.toml describes them
plants, bullet    what moves: the drivetrain, kinematics on a plane, and the URDF in PyBullet
road, lane, maps  a map's road, its lanes as geometry, and maps from their files
road_picture      the floor as a picture, and where its markings lie
optics, cameras   where pixels look, and pictures of the floor while the robot drives
loops, compiled   the two inner loops, of pixels and of lanes, by NumPy and by Numba
agent, agents     what an agent is, and those that come with the package
perception        what these make out in pictures, of many robots at once
expert            the expert that learners imitate, and drivers that replay or do as they learnt
episode           one episode, and what it is worth
fleet             episodes driven side by side, to the same bits
family            all of it as a study's domain family
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
