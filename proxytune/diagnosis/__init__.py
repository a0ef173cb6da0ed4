"""Closing the loop: from a log of measured drives and frames to the effects that a model lacks.

Two parts that know nothing of one another, and one answer:

    log_diagnosis   the diagnosis of a whole log, and a camera's pictures predicted: begin here
    answer          what both say: estimates, verdicts, and the rules that decide (an argument of `diagnose_log`)
    motion/         commands and poses: a Kalman filter in SE(2), forward selection of effects, prediction
    camera/         frames: edges of markings against the map, the fewest effects, brightness and sharpness
    stages          results on the way, kept so that a diagnosis that was killed goes on
    recording       logs of a simulated domain, driven and measured as a robot's would be
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
