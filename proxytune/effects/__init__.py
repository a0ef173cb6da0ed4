"""Effects: what bends commands, motion and pictures on their way, as causal filters with a neutral value."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
