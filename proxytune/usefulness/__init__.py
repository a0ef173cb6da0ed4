"""How useful a proxy is as a predictor: measures on score tables and trajectories, with their uncertainty."""

from proxytune.usefulness.assessment import Assessment, assess
from proxytune.usefulness.catalogue import MEASURES, PODS
from proxytune.usefulness.chance import Chance, chance
from proxytune.usefulness.comparison import Comparison, compare, in_common
from proxytune.usefulness.correlation import Correlation, kendall_tau, srcc
from proxytune.usefulness.intervals import Intervals
from proxytune.usefulness.measure import Measure, Measured
from proxytune.usefulness.mmrv import Mmrv, mmrv
from proxytune.usefulness.noise import FloorKind, NoiseFloor, floor_of_repeats, noise_floor
from proxytune.usefulness.pod import Pod, pod_of_images, pod_of_poses
from proxytune.usefulness.ppv import Ppv, ppv
from proxytune.usefulness.prpv import FlippedPair, Prpv, prpv
from proxytune.usefulness.rates import Rate, SuccessRates
from proxytune.usefulness.resampling import PrpvInterval, bootstrap_prpv
from proxytune.usefulness.selection import Difference, Selection, select_proxy

__all__ = [
    "MEASURES",
    "PODS",
    "Assessment",
    "Chance",
    "Comparison",
    "Correlation",
    "Difference",
    "FlippedPair",
    "FloorKind",
    "Intervals",
    "Measure",
    "Measured",
    "Mmrv",
    "NoiseFloor",
    "Pod",
    "Ppv",
    "Prpv",
    "PrpvInterval",
    "Rate",
    "Selection",
    "SuccessRates",
    "assess",
    "bootstrap_prpv",
    "chance",
    "compare",
    "floor_of_repeats",
    "in_common",
    "kendall_tau",
    "mmrv",
    "noise_floor",
    "pod_of_images",
    "pod_of_poses",
    "ppv",
    "prpv",
    "select_proxy",
    "srcc",
]
