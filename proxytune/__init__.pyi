from .api.asking import SearchBox as SearchBox
from .api.diagnosing import DiagnosisReport as DiagnosisReport, diagnose as diagnose
from .api.driving import DrivenEpisode as DrivenEpisode, drive as drive
from .api.families import FamiliesReport as FamiliesReport, read_families as read_families, run_families as run_families
from .api.logs import log_of as log_of
from .api.studies import StudyReport as StudyReport, read_study as read_study, run_study as run_study
from .api.tables import score as score
from .domain import DomainFamily as DomainFamily, Episode as Episode
from .driving import Agent as Agent
from .effects import Effect as Effect
from .errors import InputError as InputError, ProxytuneError as ProxytuneError, RunError as RunError
from .learning import Learner as Learner
from .logs import Log as Log, read_log as read_log
from .scores import Metric as Metric, ScoreTable as ScoreTable, read_scores as read_scores
from .search import Engine as Engine, Proposer as Proposer
from .space import Parameter as Parameter
from .usefulness import Assessment as Assessment, Measure as Measure

__version__: str
