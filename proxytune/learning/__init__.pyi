from .curve_model import POSTERIOR_DRAWS as POSTERIOR_DRAWS, LearningCurve as LearningCurve, doublings as doublings
from .learner import Learner as Learner, Weights as Weights, policy_of as policy_of
from .lessons import (
    NOT_KEPT as NOT_KEPT,
    Arrays as Arrays,
    Cache as Cache,
    Costs as Costs,
    Distribution as Distribution,
    collect_samples as collect_samples,
    describe_distribution as describe_distribution,
    examine_policy as examine_policy,
    facts_digest as facts_digest,
    learner_identity as learner_identity,
    mix_samples as mix_samples,
)
from .plv import (
    LEVELS as LEVELS,
    NONE as NONE,
    AdaptiveDesign as AdaptiveDesign,
    Convergence as Convergence,
    Examination as Examination,
    ExaminationScores as ExaminationScores,
    LearningEstimate as LearningEstimate,
    SampleNeeds as SampleNeeds,
    TeachingValue as TeachingValue,
    curves_of as curves_of,
    estimate_figure as estimate_figure,
    first_examinations as first_examinations,
    mean_score as mean_score,
    more_needed as more_needed,
    next_examinations as next_examinations,
    sample_needs as sample_needs,
    samples_needed as samples_needed,
    teaching_value as teaching_value,
)
from .settings import (
    EXPERT as EXPERT,
    LEARNER as LEARNER,
    TeachingSettings as TeachingSettings,
    read_teaching as read_teaching,
)
