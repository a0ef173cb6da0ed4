"""How useful a proxy is as a predictor: measures on score tables and trajectories, with their uncertainty.

Whatever compares raises ScoresError where tables do not fit each other, InputError for a metric or weight that is none.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
