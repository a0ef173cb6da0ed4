"""What a table's column may mean: the package's names, and those that others usually give."""

from collections.abc import Mapping
from types import MappingProxyType

from proxytune.logs import COMMANDS

PLACE = ("x", "y", "z")
QUATERNION = ("qx", "qy", "qz", "qw")
POSE = (*PLACE, "heading", *QUATERNION)
COMMAND_FIELDS = tuple(field for pair in COMMANDS.values() for field in pair)

EXAMPLE = "--columns time=stamp_ns:ns,x=pos_x_mm:mm,y=pos_y_mm:mm,heading=yaw_deg:deg,v=cmd_lin,omega=cmd_ang"
"""A column map, for complaints."""

QUANTITIES: Mapping[str, str] = MappingProxyType(
    {
        "time": "time",
        "episode": "number",
        **dict.fromkeys(PLACE, "length"),
        "heading": "angle",
        **dict.fromkeys(QUATERNION, "number"),
        "v": "speed",
        "omega": "turning speed",
        **dict.fromkeys(COMMANDS["duty"], "duty"),
        **dict.fromkeys(COMMANDS["wheel_speed"], "turning speed"),
    }
)
"""What each field measures; episodes and quaternions have no unit."""

TIMES = "t time times stamp stamps timestamp timestamps headerstamp unixtime elapsed elapsedtime sec secs seconds"
EPISODES = "episode run drive trial trajectory"
HEADINGS = "heading yaw theta psi θ ψ headingangle yawangle posetheta poseyaw poseheading"
PLACES = "# pos# #pos position# #position p# pose# posepos# poseposition# poseposeposition# translation# t# prsr#"
QUATERNIONS = "q# quat# quaternion# orientation# poseorientation# poseposeorientation# rotation# qrs#"
SPEEDS = (
    "v cmdv vcmd cmdlin cmdlinear cmdlinearx cmdvel cmdvelx cmdvellin cmdvellinear cmdvellinearx cmdspeed speedcmd "
    "linearx commandv vcommand commandspeed commandedspeed"
)
TURNING_SPEEDS = (
    "omega ω w cmdomega omegacmd cmdw wcmd cmdang cmdangular cmdangularz cmdvelang cmdvelangular cmdvelangularz "
    "cmdveltheta angularz cmdyawrate yawratecmd commandomega omegacommand commandyawrate commandedyawrate"
)
DUTIES = "# duty# #duty pwm# #pwm cmd# #cmd u# motor# #motor"
WHEEL_SPEEDS = "wheelcommand# #wheelcommand wheelcmd# #wheelcmd cmdwheel# wheelspeedcmd# omega#cmd cmdomega#"


def _filled(pattern: str, *parts: str) -> frozenset[str]:
    """The names of a pattern, # standing for any of the parts."""
    return frozenset(name for part in parts for name in pattern.replace("#", part).split())


USUAL: Mapping[str, frozenset[str]] = MappingProxyType(
    {
        "time": _filled(TIMES, ""),
        "episode": _filled(EPISODES, ""),
        **{axis: _filled(PLACES, axis) for axis in PLACE},
        "heading": _filled(HEADINGS, ""),
        **{field: _filled(QUATERNIONS, field[1]) for field in QUATERNION},
        "v": _filled(SPEEDS, ""),
        "omega": _filled(TURNING_SPEEDS, ""),
        "left": _filled(DUTIES, "left"),
        "right": _filled(DUTIES, "right"),
        "wheel_command_left": _filled(WHEEL_SPEEDS, "left"),
        "wheel_command_right": _filled(WHEEL_SPEEDS, "right"),
    }
)
"""Usual names of each field, without underscores and units."""
