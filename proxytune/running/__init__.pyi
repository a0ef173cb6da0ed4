from .apart import Apart as Apart, Lost as Lost
from .cluster import on_cluster as on_cluster
from .episodes import ENDED as ENDED, ENDLESS as ENDLESS, Watch as Watch, run_episode as run_episode, running as running
from .limits import OVERRUN as OVERRUN, Noted as Noted, limited as limited, was_ended_in as was_ended_in
from .machine import check_machine as check_machine
from .progress import Bars as Bars, Lines as Lines, Silent as Silent, Watcher as Watcher, progress_bar as progress_bar
from .workers import Rescue as Rescue, working as working
