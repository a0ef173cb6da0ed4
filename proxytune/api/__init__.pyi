from .curves import SweepReport as SweepReport, TeachReport as TeachReport, run_sweep as run_sweep, teach as teach
from .diagnosis import DiagnosisReport as DiagnosisReport, diagnose as diagnose
from .driving import (
    DrivenEpisode as DrivenEpisode,
    choose_theta as choose_theta,
    drive as drive,
    read_theta as read_theta,
)
from .exporting import (
    TRIALS as TRIALS,
    CommandFilter as CommandFilter,
    ExportReport as ExportReport,
    export as export,
    robot_files as robot_files,
)
from .families import (
    FamiliesReport as FamiliesReport,
    read_families as read_families,
    run_families as run_families,
    run_opened_families as run_opened_families,
)
from .logs import Wanted as Wanted, record_log as record_log, recordable as recordable
from .robots import FleetReport as FleetReport, fleet as fleet
from .scores import ScoreReport as ScoreReport, log_of as log_of, score as score
from .search_box import SearchBox as SearchBox
from .study import (
    StudyReport as StudyReport,
    most_episodes as most_episodes,
    read_study as read_study,
    run_opened as run_opened,
    run_study as run_study,
)
from .transfer import (
    ImportReport as ImportReport,
    Measurement as Measurement,
    PicturePrediction as PicturePrediction,
    Prediction as Prediction,
    import_log as import_log,
    measure as measure,
    predict as predict,
)
from .tuning import tune as tune
