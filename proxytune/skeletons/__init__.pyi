from .given_urdf import robot_from_urdf as robot_from_urdf
from .writing import Skeleton as Skeleton
from .writing import family_skeleton as family_skeleton
from .writing import robot_skeleton as robot_skeleton
from .writing import study_skeleton as study_skeleton
