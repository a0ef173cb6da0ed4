from .cautions import log_cautions as log_cautions
from .frames import BROKEN as BROKEN, read_pictures as read_pictures
from .log import COMMANDS as COMMANDS, Frames as Frames, Log as Log, LogEpisode as LogEpisode, Measured as Measured
from .reading import read_log as read_log
