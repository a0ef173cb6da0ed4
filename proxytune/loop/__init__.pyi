from .episodes import Closed as Closed
from .opening import open_loop as open_loop
from .run import (
    COLUMNS as COLUMNS,
    close_loop as close_loop,
    document_of as document_of,
    notes_of as notes_of,
    page_of as page_of,
    rows_of as rows_of,
    table_rows as table_rows,
)
