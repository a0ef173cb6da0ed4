from .answer import (
    Confirmation as Confirmation,
    most_confirmation_episodes as most_confirmation_episodes,
    run_stages as run_stages,
)
from .bank import WITHIN as WITHIN, Bank as Bank, bank_of as bank_of, run_bank as run_bank
from .earlier import (
    BANK_FILE as BANK_FILE,
    earlier_trials as earlier_trials,
    learn as learn,
    write_table as write_table,
)
from .facts import (
    check_facts as check_facts,
    describe as describe,
    open_read_only as open_read_only,
    stored_run as stored_run,
    study_facts as study_facts,
)
from .families import (
    NOTICEABLE as NOTICEABLE,
    BestFamilies as BestFamilies,
    ComparedFamilies as ComparedFamilies,
    Lesson as Lesson,
    TunedFamily as TunedFamily,
    best_teaching_family as best_teaching_family,
    read_lessons as read_lessons,
    save_lessons as save_lessons,
    tuned_family as tuned_family,
)
from .family import (
    GIVEN as GIVEN,
    bare_family as bare_family,
    check_bounds as check_bounds,
    check_box as check_box,
    load_family as load_family,
    user_code as user_code,
)
from .opening import (
    PRPV as PRPV,
    Study as Study,
    cautions_of as cautions_of,
    family_catalogue as family_catalogue,
    measure_of as measure_of,
    open_bank as open_bank,
    open_settings as open_settings,
    open_study as open_study,
    read_target as read_target,
    theta_of_model as theta_of_model,
)
from .preflight import (
    Preflight as Preflight,
    most_preflight_episodes as most_preflight_episodes,
    run_preflight as run_preflight,
)
from .result import (
    Best as Best,
    StudyResult as StudyResult,
    history_of as history_of,
    rescored as rescored,
    result_of as result_of,
    with_metrics as with_metrics,
)
from .robots import FEW as FEW, Fleet as Fleet, learn_fleet as learn_fleet
from .run import (
    goal_of as goal_of,
    nothing_to_gain as nothing_to_gain,
    out_of_time as out_of_time,
    run_trials as run_trials,
)
from .settings import (
    DEFAULT_FAMILY as DEFAULT_FAMILY,
    FILE_NAME as FILE_NAME,
    LEARNING as LEARNING,
    MADE as MADE,
    WITHOUT_THETA as WITHOUT_THETA,
    StudySettings as StudySettings,
    read_study_settings as read_study_settings,
    settings_document as settings_document,
    study_around as study_around,
)
from .single_episode import (
    APART_M as APART_M,
    RecordedEpisode as RecordedEpisode,
    SideBySide as SideBySide,
    can_record as can_record,
    check_episode as check_episode,
    check_model as check_model,
    check_robot as check_robot,
    drive_side_by_side as drive_side_by_side,
    record_episode as record_episode,
)
from .study_run import (
    Evaluation as Evaluation,
    Spent as Spent,
    StudyRun as StudyRun,
    evaluate_outcomes as evaluate_outcomes,
    failure_of as failure_of,
    measure_agents as measure_agents,
    outputs_of as outputs_of,
    plan_episodes as plan_episodes,
    score_table as score_table,
    score_trials as score_trials,
    with_spending as with_spending,
)
