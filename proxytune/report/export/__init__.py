"""Domain instances written for other simulators and for the robot: URDF, MJCF and ROS parameters."""
