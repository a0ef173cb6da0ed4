"""Score tables: how well each agent did, episode by episode, and the metrics that judge it.

Whatever reads or writes here raises ScoresError, in one line with file, line and column.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
