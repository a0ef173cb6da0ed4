"""The Python interface: one function for each command, on files or DataFrames, with a report that shows itself.

    study        run_study, read_study: pre-flight, trials, confirmation
    tuning       tune: a study of a function or an environment, without a folder or TOML
    families     several simulators, each tuned in the same time
    robots       fleet: several robots of one kind
    curves       run_sweep, teach
    scores       score, log_of: tables as DataFrames
    diagnosis    diagnose
    logs         record_log
    transfer     import_log, measure, predict
    exporting    export; CommandFilter: a model before any simulator's step
    driving      drive; θ as people give it
    search_box   SearchBox: the optimiser alone

The command line is options, one of these functions, and text.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
