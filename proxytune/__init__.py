"""Find out how useful a robot simulator is, tune it to the robot, and learn what it still lacks.

    study        run_study, read_study, StudyReport
    scores       score, Metric, ScoreTable, read_scores
    search       SearchBox: ask for a θ, tell its score
    logs         diagnose, read_log, log_of, Log, Diagnosis
    driving      drive: one episode of a study's proxy
    to extend    DomainFamily, Episode, Agent, Effect, Parameter, Proposer, Learner, Measure
    errors       ProxytuneError, InputError, RunError

A name is loaded when it is first used, so that `import proxytune` costs nothing.
"""

from importlib import import_module, metadata
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from proxytune.api.asking import SearchBox
    from proxytune.api.driving import drive
    from proxytune.api.logs import diagnose, log_of
    from proxytune.api.studies import StudyReport
    from proxytune.api.studies import read as read_study
    from proxytune.api.studies import run as run_study
    from proxytune.api.tables import score
    from proxytune.diagnosis.result import Diagnosis
    from proxytune.domain import DomainFamily, Episode
    from proxytune.driving.agents import Agent
    from proxytune.effects import Effect
    from proxytune.errors import InputError, ProxytuneError, RunError
    from proxytune.learning.learner import Learner
    from proxytune.logs import Log, read_log
    from proxytune.scores import Metric, ScoreTable, read_scores
    from proxytune.search.proposer import Proposer
    from proxytune.space import Parameter
    from proxytune.usefulness.measure import Measure

__all__ = [
    "Agent",
    "Diagnosis",
    "DomainFamily",
    "Effect",
    "Episode",
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
    "read_log",
    "read_scores",
    "read_study",
    "run_study",
    "score",
]

_HOMES = {
    "Agent": "driving.agents",
    "Diagnosis": "diagnosis.result",
    "DomainFamily": "domain",
    "Effect": "effects",
    "Episode": "domain",
    "InputError": "errors",
    "Learner": "learning.learner",
    "Log": "logs",
    "Measure": "usefulness.measure",
    "Metric": "scores",
    "Parameter": "space",
    "Proposer": "search.proposer",
    "ProxytuneError": "errors",
    "RunError": "errors",
    "ScoreTable": "scores",
    "SearchBox": "api.asking",
    "StudyReport": "api.studies",
    "diagnose": "api.logs",
    "drive": "api.driving",
    "log_of": "api.logs",
    "read_log": "logs",
    "read_scores": "scores",
    "read_study": "api.studies:read",
    "run_study": "api.studies:run",
    "score": "api.tables",
}


def __getattr__(name: str) -> Any:
    if name == "__version__":
        return metadata.version("proxytune")
    if name not in _HOMES:
        raise AttributeError(f"module 'proxytune' has no attribute {name!r}")
    home, _, attribute = _HOMES[name].partition(":")
    return getattr(import_module(f"proxytune.{home}"), attribute or name)


def __dir__() -> list[str]:
    return __all__
