from .frames import read_pictures as read_pictures
from .log import COMMANDS as COMMANDS
from .log import GEOMETRY as GEOMETRY
from .log import Frames as Frames
from .log import Log as Log
from .log import LogEpisode as LogEpisode
from .log import Measured as Measured
from .reading import read_log as read_log
