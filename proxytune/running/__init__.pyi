from .cluster import on_cluster as on_cluster
from .episodes import ENDED as ENDED, ENDLESS as ENDLESS, Watch as Watch, running as running
from .fleets import (
    RAISED as RAISED,
    Fleet as Fleet,
    can_run_together as can_run_together,
    check_machine as check_machine,
    run_episode as run_episode,
    run_fleet as run_fleet,
    run_together as run_together,
)
from .progress import (
    Bars as Bars,
    Lines as Lines,
    Silent as Silent,
    Watcher as Watcher,
    progress_bar as progress_bar,
    watching as watching,
)
from .workers import (
    OVERRUN as OVERRUN,
    IsolatedWorker as IsolatedWorker,
    Rescue as Rescue,
    TracedTask as TracedTask,
    WorkerExit as WorkerExit,
    limited as limited,
    places as places,
    was_ended_in as was_ended_in,
    working as working,
)
