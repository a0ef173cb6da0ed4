"""Running work: episodes and other pieces, in this process, several, or on a cluster, with progress.

fleets    Fleet, run_fleet, run_episode, run_together, can_run_together, RAISED, check_machine: outcomes
episodes  running, Watch, ENDED, ENDLESS: the fleets of many episodes, and what ends or hangs
workers   working, places, Rescue, IsolatedWorker, WorkerExit, TracedTask, limited, was_ended_in, OVERRUN: any work
cluster   on_cluster: the same on the machines of a Dask cluster
progress  Watcher, Silent, Bars, Lines, progress_bar: how far a command is
sending   work as it goes to other processes; for this room alone
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
