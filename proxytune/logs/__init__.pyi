from .cautions import log_cautions as log_cautions
from .frames import BROKEN as BROKEN, read_pictures as read_pictures
from .log import (
    CAR_COMMANDS as CAR_COMMANDS,
    COMMANDS as COMMANDS,
    ENABLED as ENABLED,
    WHEELS as WHEELS,
    Frames as Frames,
    Log as Log,
    LogEpisode as LogEpisode,
    Measured as Measured,
    check_kind as check_kind,
)
from .outliers import without_outliers as without_outliers
from .reading import read_commands as read_commands, read_log as read_log
from .repeats import rows_of_poses as rows_of_poses
from .rows import LARGEST as LARGEST
from .windows import join_windows as join_windows
