"""Effects: what bends commands, motion and pictures on their way, as causal filters with a neutral value."""

from proxytune.effects.catalogue import (
    CATALOGUE,
    DECLARED,
    PARAMETERS,
    SHIPPED,
    Catalogue,
    effect_of,
    effects_from,
    theta_names,
)
from proxytune.effects.chain import Chain, stage_chain
from proxytune.effects.effect import CHANNELS, Effect, Setting, Signal, Stage
from proxytune.effects.model import Model, model_text, read_effects, read_model
from proxytune.effects.trace import Cue, Form, Means, Panel, Trace, WheelCurve

__all__ = [
    "CATALOGUE",
    "CHANNELS",
    "DECLARED",
    "PARAMETERS",
    "SHIPPED",
    "Catalogue",
    "Chain",
    "Cue",
    "Effect",
    "Form",
    "Means",
    "Model",
    "Panel",
    "Setting",
    "Signal",
    "Stage",
    "Trace",
    "WheelCurve",
    "effect_of",
    "effects_from",
    "model_text",
    "read_effects",
    "read_model",
    "stage_chain",
    "theta_names",
]
