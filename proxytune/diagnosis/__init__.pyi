from .answer import RULES as RULES, Estimate as Estimate, Rules as Rules
from .camera.diagnose import camera_effects as camera_effects
from .camera.edges import Edges as Edges, effects_of as effects_of
from .camera.error import (
    CameraDiagnosis as CameraDiagnosis,
    CameraEffect as CameraEffect,
    Comparison as Comparison,
    LaidLine as LaidLine,
    LaidMap as LaidMap,
    PictureError as PictureError,
)
from .camera.fitting import CameraFit as CameraFit
from .camera.light import Blemish as Blemish
from .camera.model import project as project
from .camera.selection import LEAST_NATS as LEAST_NATS, ResidualField as ResidualField, rank_subsets as rank_subsets
from .log_diagnosis import (
    LogDiagnosis as LogDiagnosis,
    diagnose_log as diagnose_log,
    frames_of as frames_of,
    predict_pictures as predict_pictures,
)
from .motion.clocks import Clocks as Clocks, Offset as Offset, on_one_clock as on_one_clock
from .motion.diagnose import Diagnosis as Diagnosis, HorizonError as HorizonError, main_error as main_error
from .motion.discrepancy import Learning as Learning, MatchedEffect as MatchedEffect
from .motion.drives import (
    Drives as Drives,
    Floats as Floats,
    Whole as Whole,
    commands_as as commands_as,
    robot_of as robot_of,
)
from .motion.effect_size import EffectSize as EffectSize, RobotClusters as RobotClusters
from .motion.evidence import AdoptedEffect as AdoptedEffect, Findings as Findings
from .motion.excitation import LIMITS as LIMITS, Limits as Limits, NextDrive as NextDrive
from .motion.fitting import Fit as Fit
from .motion.innovations import (
    HUBER as HUBER,
    RANDOM_EFFECTS as RANDOM_EFFECTS,
    disturbed_increments as disturbed_increments,
    drawn_wheel_speeds as drawn_wheel_speeds,
    increments as increments,
    span as span,
    theta_at as theta_at,
    wheel_speeds as wheel_speeds,
)
from .motion.prediction import (
    Agreement as Agreement,
    Ratio as Ratio,
    Rmse as Rmse,
    agreement as agreement,
    cut as cut,
    pose_errors as pose_errors,
    predict as predict,
)
from .motion.screening import MOTION_EFFECTS as MOTION_EFFECTS, motion_effects as motion_effects
from .motion.signals import SignalCurve as SignalCurve, refit_beside_curve as refit_beside_curve
from .recording import (
    PICTURES as PICTURES,
    FilmedDrive as FilmedDrive,
    film as film,
    frames_text as frames_text,
    log_text as log_text,
    record as record,
    samples_text as samples_text,
)
from .stages import forget_stages as forget_stages
