from .examining import count_examinations as count_examinations
from .experiment import (
    Experiment as Experiment,
    Observations as Observations,
    Predictivity as Predictivity,
    RankAgreement as RankAgreement,
    TeacherResult as TeacherResult,
    check_proxies as check_proxies,
    classrooms as classrooms,
    load_setup as load_setup,
    observe as observe,
    predictivity as predictivity,
    run_experiment as run_experiment,
    teach_families as teach_families,
    teaching_settings as teaching_settings,
)
from .points import search_space as search_space
from .search import (
    PlvSearch as PlvSearch,
    PlvStudy as PlvStudy,
    PlvTrial as PlvTrial,
    best_teacher as best_teacher,
    caution_of_threshold as caution_of_threshold,
    most_examinations as most_examinations,
    plv_or_worst as plv_or_worst,
    saves_more as saves_more,
    why_unknown as why_unknown,
)
