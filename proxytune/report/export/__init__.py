"""Domain instances written for other simulators and for the robot: URDF, MJCF and ROS parameters.

A figure that the robot does not state is an InputError.
"""
