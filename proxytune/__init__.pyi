from .api import (
    CommandFilter as CommandFilter,
    DiagnosisReport as DiagnosisReport,
    DrivenEpisode as DrivenEpisode,
    ExportReport as ExportReport,
    FamiliesReport as FamiliesReport,
    FleetReport as FleetReport,
    ImportReport as ImportReport,
    Measurement as Measurement,
    PicturePrediction as PicturePrediction,
    Prediction as Prediction,
    ScoreReport as ScoreReport,
    SearchBox as SearchBox,
    StudyReport as StudyReport,
    SweepReport as SweepReport,
    TeachReport as TeachReport,
    diagnose as diagnose,
    drive as drive,
    export as export,
    fleet as fleet,
    import_log as import_log,
    log_of as log_of,
    measure as measure,
    predict as predict,
    read_families as read_families,
    read_study as read_study,
    run_families as run_families,
    run_study as run_study,
    run_sweep as run_sweep,
    score as score,
    teach as teach,
    tune as tune,
)
from .domain import DomainFamily as DomainFamily, Episode as Episode
from .driving import Agent as Agent
from .effects import Effect as Effect
from .errors import InputError as InputError, ProxytuneError as ProxytuneError, RunError as RunError
from .learning import Learner as Learner
from .logs import Log as Log, read_log as read_log
from .loop import LoopReport as LoopReport, run_loop as run_loop
from .scores import Metric as Metric, ScoreTable as ScoreTable, read_scores as read_scores
from .search import Engine as Engine, Proposer as Proposer
from .space import Parameter as Parameter
from .usefulness import Assessment as Assessment, Measure as Measure

__version__: str
