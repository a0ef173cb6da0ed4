from .agent import Agent as Agent, Command as Command, Picture as Picture
from .agents import AGENTS as AGENTS, NEEDS as NEEDS, load_agent as load_agent
from .bullet import BulletPlant as BulletPlant, has_pybullet as has_pybullet
from .cameras import GroundPlaneCamera as GroundPlaneCamera
from .episode import (
    COMMAND_FORM as COMMAND_FORM,
    METRICS as METRICS,
    TICK_HZ as TICK_HZ,
    Course as Course,
    Drive as Drive,
    Instance as Instance,
    Sight as Sight,
    command_of as command_of,
    measured as measured,
    score_trajectory as score_trajectory,
    start_pose as start_pose,
)
from .expert import Expert as Expert
from .family import (
    DOMAIN_KEYS as DOMAIN_KEYS,
    LaneFollowing as LaneFollowing,
    lane_following as lane_following,
    mounted_camera as mounted_camera,
)
from .fleet import Plants as Plants, Rollouts as Rollouts, drive as drive, follow as follow
from .lane import lane_length as lane_length, lane_point as lane_point, lane_pose as lane_pose, off_map as off_map
from .maps import map_names as map_names, read_map as read_map, shipped_map as shipped_map
from .optics import (
    CameraFigures as CameraFigures,
    floor_points as floor_points,
    ground_points as ground_points,
    orientation as orientation,
    rotation as rotation,
)
from .plants import (
    ACROSS as ACROSS,
    AXLES as AXLES,
    STEERS as STEERS,
    Body as Body,
    Drivetrain as Drivetrain,
    Plant as Plant,
    add_little_mass as add_little_mass,
    drivetrain as drivetrain,
    link_pose as link_pose,
    links_called as links_called,
    origin_of as origin_of,
    parse_urdf as parse_urdf,
    read_body as read_body,
    sound_urdf as sound_urdf,
    wheelbase_of as wheelbase_of,
)
from .road import Road as Road
from .road_picture import (
    COLOURS as COLOURS,
    LINES as LINES,
    Markings as Markings,
    Marks as Marks,
    draw_floor as draw_floor,
)
from .robot import (
    CAMERA as CAMERA,
    REQUIRED as REQUIRED,
    UNITS as UNITS,
    Robot as Robot,
    catalogue_of as catalogue_of,
    is_robot as is_robot,
    read_model_of as read_model_of,
    read_robot as read_robot,
    robot_from_geometry as robot_from_geometry,
    robot_home as robot_home,
    robot_names as robot_names,
)
