"""Find out how useful a robot simulator is, tune it to the robot, and learn what it still lacks.

    study        run_study, read_study, StudyReport
    simulators   run_families, read_families, FamiliesReport: several tuned in the same time
    scores       score, Assessment, Metric, ScoreTable, read_scores
    search       SearchBox: ask for a θ, tell its score
    logs         diagnose, DiagnosisReport, read_log, log_of, Log
    driving      drive, DrivenEpisode: one episode of a study's proxy
    to extend    DomainFamily, Episode, Parameter, Agent, Effect, Engine, Proposer, Learner, Measure
    errors       ProxytuneError, InputError, RunError

A name is loaded when it is first used, so that `import proxytune` costs nothing. docs/python.md shows all of them.
"""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from proxytune.api.asking import SearchBox
    from proxytune.api.diagnosing import DiagnosisReport, diagnose
    from proxytune.api.driving import DrivenEpisode, drive
    from proxytune.api.families import FamiliesReport, read_families, run_families
    from proxytune.api.logs import log_of
    from proxytune.api.studies import StudyReport, read_study, run_study
    from proxytune.api.tables import score
    from proxytune.domain import DomainFamily, Episode
    from proxytune.driving import Agent
    from proxytune.effects import Effect
    from proxytune.errors import InputError, ProxytuneError, RunError
    from proxytune.learning import Learner
    from proxytune.logs import Log, read_log
    from proxytune.scores import Metric, ScoreTable, read_scores
    from proxytune.search import Engine, Proposer
    from proxytune.space import Parameter
    from proxytune.usefulness import Assessment, Measure

__version__ = "0.1.0"

__all__ = [
    "Agent",
    "Assessment",
    "DiagnosisReport",
    "DomainFamily",
    "DrivenEpisode",
    "Effect",
    "Engine",
    "Episode",
    "FamiliesReport",
    "InputError",
    "Learner",
    "Log",
    "Measure",
    "Metric",
    "Parameter",
    "Proposer",
    "ProxytuneError",
    "RunError",
    "ScoreTable",
    "SearchBox",
    "StudyReport",
    "__version__",
    "diagnose",
    "drive",
    "log_of",
    "read_families",
    "read_log",
    "read_scores",
    "read_study",
    "run_families",
    "run_study",
    "score",
]

_HOMES = {
    "Agent": "driving.agents",
    "Assessment": "usefulness",
    "DiagnosisReport": "api.diagnosing",
    "DomainFamily": "domain",
    "DrivenEpisode": "api.driving",
    "Effect": "effects",
    "Engine": "search.engines.engine",
    "Episode": "domain",
    "FamiliesReport": "api.families",
    "InputError": "errors",
    "Learner": "learning.learner",
    "Log": "logs",
    "Measure": "usefulness",
    "Metric": "scores",
    "Parameter": "space",
    "Proposer": "search.proposer",
    "ProxytuneError": "errors",
    "RunError": "errors",
    "ScoreTable": "scores",
    "SearchBox": "api.asking",
    "StudyReport": "api.studies",
    "diagnose": "api.diagnosing",
    "drive": "api.driving",
    "log_of": "api.logs",
    "read_families": "api.families",
    "read_log": "logs",
    "read_scores": "scores",
    "read_study": "api.studies",
    "run_families": "api.families",
    "run_study": "api.studies",
    "score": "api.tables",
}

if not TYPE_CHECKING:  # A type checker would take any name for known.

    def __getattr__(name):
        from importlib import import_module

        if name in _HOMES:
            return getattr(import_module(f"proxytune.{_HOMES[name]}"), name)
        from proxytune.settings import nearest

        raise AttributeError(f"module 'proxytune' has no attribute '{name}'; {nearest(name, __all__)}")


def __dir__() -> list[str]:
    return __all__
