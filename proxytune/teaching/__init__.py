"""A proxy's worth as a teacher: the learning experiment and the search for the best teacher.

points       the pieces of a learning experiment: samples, weights, scores
examining    which points are examined, batch by batch, by several processes
experiment   learning curves with and without each proxy, and what each is worth
search       the proxy of highest PLV, and its finalists taught anew
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
