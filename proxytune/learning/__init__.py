"""Learning from a proxy: demonstrations, learners, learning curves, and what a proxy is worth as a teacher (PLV).

settings     the [teaching] table of a study.toml
learner      the protocol of a learner
cloning      behaviour cloning: a small network
ridge        random features: a linear fit in closed form
lessons      samples of the expert, examinations, and what is kept of both
curve_model  a Gaussian process over learning curves, and draws from it
plv          PLV with its interval, and which examinations tell most of it
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
