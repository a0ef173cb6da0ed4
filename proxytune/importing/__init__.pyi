from .reading import (
    as_log as as_log,
    open_log as open_log,
    read_source as read_source,
    with_named_pictures as with_named_pictures,
    write_log as write_log,
)
from .source import (
    Facts as Facts,
    Source as Source,
    Survey as Survey,
    Wanted as Wanted,
    finite as finite,
    read_geometry as read_geometry,
)
