from .engine import (
    Engine as Engine,
    Look as Look,
    design_point as design_point,
    from_unit as from_unit,
    to_unit as to_unit,
    unit_points as unit_points,
)
from .knowledge import (
    Expected as Expected,
    Importance as Importance,
    Information as Information,
    Knowledge as Knowledge,
    expect_of as expect_of,
    importances as importances,
    learn_theta as learn_theta,
)
from .loop import (
    BatchPoints as BatchPoints,
    Compose as Compose,
    Goal as Goal,
    Proposer as Proposer,
    Search as Search,
    Trial as Trial,
    Values as Values,
    batch_at as batch_at,
    propose_batch as propose_batch,
    with_failures_as_worst as with_failures_as_worst,
)
from .optuna_bridge import (
    History as History,
    PastTrial as PastTrial,
    optimize_result as optimize_result,
    write_optuna as write_optuna,
    write_skopt as write_skopt,
)
from .outcomes import expected_gain as expected_gain
from .population import Population as Population, population_of as population_of, summary_of as summary_of
from .registry import (
    DEFAULT_ENGINE as DEFAULT_ENGINE,
    ENGINE_NAMES as ENGINE_NAMES,
    ENGINES as ENGINES,
    SCORE_ENGINE as SCORE_ENGINE,
    code_of as code_of,
    engine_code as engine_code,
    engine_of as engine_of,
    is_installed as is_installed,
    make_proposer as make_proposer,
    why_not as why_not,
    why_not_engine as why_not_engine,
)
from .surrogate import (
    GAUSSIAN_PROCESS as GAUSSIAN_PROCESS,
    Surrogate as Surrogate,
    expected_improvement as expected_improvement,
    fit_surrogate as fit_surrogate,
    unit_array as unit_array,
)
