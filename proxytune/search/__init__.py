"""A search for θ: it proposes, and never calls a simulator.

loop             the one search loop: propose a batch, have it evaluated, go on until something says stop
engine           what an engine says of itself, the quasi-random design, and the engines `random` and `sobol`
surrogate        a Gaussian process of the score, and the engine `gp`
likelihood       Gaussian processes of every output, and the likelihood of θ
posterior        the posterior of θ, its 95 % credible region, and the misfit
outcomes         the engines that learn from every output: `composite` and `outcomes`
knowledge        what trials say of θ: the answer, its region, information, importances
population       p(θ) over several robots of one kind
optuna_bridge    the engine `tpe`, and trials as other optimisers keep them
registry         the engines by name
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
