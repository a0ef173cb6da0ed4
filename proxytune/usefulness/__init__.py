"""How useful a proxy is as a predictor: measures on score tables and trajectories, with their uncertainty."""

from proxytune.usefulness.noise import NoiseFloor, noise_floor
from proxytune.usefulness.ppv import Ppv, ppv
from proxytune.usefulness.prpv import FlippedPair, Prpv, prpv
from proxytune.usefulness.resampling import PrpvInterval, bootstrap_prpv

__all__ = [
    "FlippedPair",
    "NoiseFloor",
    "Ppv",
    "Prpv",
    "PrpvInterval",
    "bootstrap_prpv",
    "noise_floor",
    "ppv",
    "prpv",
]
