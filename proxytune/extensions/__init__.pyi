from .beside import (
    Heeding as Heeding,
    Interrupted as Interrupted,
    Packed as Packed,
    folders as folders,
    import_beside as import_beside,
    interrupt as interrupt,
    is_ours as is_ours,
    is_users as is_users,
    open_folders as open_folders,
    pack as pack,
    running_none as running_none,
    unpack as unpack,
)
from .door import (
    ask as ask,
    describe as describe,
    load as load,
    one_line as one_line,
    place_of as place_of,
    plugins as plugins,
    require as require,
)
