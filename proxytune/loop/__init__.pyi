from .episodes import Closed as Closed
from .opening import Teller as Teller, open_loop as open_loop
from .run import LoopReport as LoopReport, run_loop as run_loop, text_of as text_of
