from .catalogue import (
    CAR_CATALOGUE as CAR_CATALOGUE,
    CATALOGUE as CATALOGUE,
    DECLARED as DECLARED,
    DRIVES as DRIVES,
    MEMBERS as MEMBERS,
    PARAMETERS as PARAMETERS,
    SHIPPED as SHIPPED,
    Catalogue as Catalogue,
    effect_of as effect_of,
    effects_from as effects_from,
    parameter_hint as parameter_hint,
    problems as problems,
    theta_names as theta_names,
)
from .commanded import COMMAND_GROUPS as COMMAND_GROUPS, GROUPS as GROUPS, LearntCommands as LearntCommands
from .effect import (
    CHANNELS as CHANNELS,
    TURN as TURN,
    Cue as Cue,
    Draws as Draws,
    Effect as Effect,
    FilterContext as FilterContext,
    Form as Form,
    Lateness as Lateness,
    Means as Means,
    Memory as Memory,
    Panel as Panel,
    Signal as Signal,
    Stage as Stage,
    Trace as Trace,
    WheelCurve as WheelCurve,
)
from .features import (
    HEADING as HEADING,
    LEVEL as LEVEL,
    OF_PLACE as OF_PLACE,
    PLACE as PLACE,
    Knots as Knots,
    LearntCurve as LearntCurve,
)
from .image import Blur as Blur, RollingShutter as RollingShutter
from .learnt import (
    FittedRange as FittedRange,
    Learnt as Learnt,
    is_learnt as is_learnt,
    learnt_effect as learnt_effect,
    learnt_theta as learnt_theta,
    track_of as track_of,
)
from .model import (
    Chain as Chain,
    Model as Model,
    model_text as model_text,
    read_effects as read_effects,
    read_model as read_model,
    stage_chain as stage_chain,
)
from .motors import SMALLEST_LIMIT as SMALLEST_LIMIT
