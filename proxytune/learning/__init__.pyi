from .curve_model import POSTERIOR_DRAWS as POSTERIOR_DRAWS, Curve as Curve, places as places
from .learner import Learner as Learner, Weights as Weights, policy_of as policy_of
from .lessons import (
    Arrays as Arrays,
    Cache as Cache,
    Costs as Costs,
    Distribution as Distribution,
    collect_samples as collect_samples,
    describe as describe,
    digest as digest,
    examine as examine,
    learner_identity as learner_identity,
    mix_samples as mix_samples,
)
from .plv import (
    LEVELS as LEVELS,
    Convergence as Convergence,
    Estimate as Estimate,
    Examination as Examination,
    SampleNeeds as SampleNeeds,
    Scores as Scores,
    Spending as Spending,
    Teaching as Teaching,
    curves_of as curves_of,
    difference as difference,
    estimate as estimate,
    first_examinations as first_examinations,
    mean_score as mean_score,
    next_examinations as next_examinations,
    sample_needs as sample_needs,
    teaching as teaching,
)
from .settings import (
    EXPERT as EXPERT,
    LEARNER as LEARNER,
    NONE as NONE,
    TeachingSettings as TeachingSettings,
    read_teaching as read_teaching,
)
