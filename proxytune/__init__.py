"""Find out how useful a robot simulator is, tune it to the robot, and learn what it still lacks.

    study        run_study, read_study, StudyReport; tune: without a folder or TOML
    simulators   run_families, read_families, FamiliesReport: several tuned in the same time
    fleet        fleet, FleetReport: several robots of one kind
    sweep        run_sweep, SweepReport: usefulness along a parameter
    teaching     teach, TeachReport: what a proxy saves in training
    scores       score, ScoreReport, Assessment, Metric, ScoreTable, read_scores; measure, Measurement: a model's scores
    search       SearchBox: ask for a θ, tell its score
    logs         diagnose, DiagnosisReport, read_log, log_of, Log; import_log, ImportReport
    models       predict, Prediction, PicturePrediction; export, ExportReport; CommandFilter
    loop         run_loop, LoopReport: tune, diagnose, extend, tune again
    driving      drive, DrivenEpisode: one episode of a study's proxy
    to extend    DomainFamily, Episode, Parameter, Agent, Effect, Engine, Proposer, Learner, Measure
    errors       ProxytuneError, InputError, RunError

A name is loaded when it is first used, so that `import proxytune` costs nothing. docs/how-to/python.md shows all.
"""

import os
import sys

if sys.argv[:1] == ["-m"] and sys.orig_argv[-len(sys.argv)].removeprefix("-m") == "proxytune":
    # `python -m proxytune` looks for modules in the current folder first, where a stranger's study may lie
    _here, _home = (os.path.realpath(place) for place in (sys.path[0], os.path.join(os.path.dirname(__file__), "..")))
    if not sys.flags.safe_path and _here != _home:
        del sys.path[0]

import lazy_loader

__version__ = "0.1.0"

_load, _, __all__ = lazy_loader.attach_stub(__name__, __file__)
__all__ = sorted([*__all__, "__version__"])


def __getattr__(name: str) -> object:
    if name in __all__:
        return _load(name)
    from proxytune.settings import nearest

    raise AttributeError(f"module 'proxytune' has no attribute '{name}'; {nearest(name, __all__)}")


def __dir__() -> list[str]:
    return __all__
