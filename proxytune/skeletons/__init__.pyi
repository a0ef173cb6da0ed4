from .given_urdf import robot_from_urdf as robot_from_urdf
from .writing import (
    Skeleton as Skeleton,
    family_skeleton as family_skeleton,
    robot_skeleton as robot_skeleton,
    study_skeleton as study_skeleton,
)
