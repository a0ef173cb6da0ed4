from .episodes import Closed as Closed
from .opening import open_loop as open_loop
from .run import (
    close_loop as close_loop,
    document_of as document_of,
    foot_of_loop as foot_of_loop,
    text_of as text_of,
    view_of as view_of,
)
