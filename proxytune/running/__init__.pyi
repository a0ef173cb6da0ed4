from .cluster import on_cluster as on_cluster
from .episodes import (
    ENDED as ENDED,
    ENDLESS as ENDLESS,
    Watch as Watch,
    check_machine as check_machine,
    run_episode as run_episode,
    running as running,
)
from .progress import Bars as Bars, Lines as Lines, Silent as Silent, Watcher as Watcher, progress_bar as progress_bar
from .workers import (
    OVERRUN as OVERRUN,
    IsolatedWorker as IsolatedWorker,
    Rescue as Rescue,
    TracedTask as TracedTask,
    WorkerExit as WorkerExit,
    limited as limited,
    was_ended_in as was_ended_in,
    working as working,
)
