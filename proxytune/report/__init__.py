"""Results for people: one view of each, as terminal text, page, JSON document, figures and files.

A subject (study, scores, sweep, teaching, families, diagnosis, episode) builds its tables, sentences and pictures once,
as `view` has them; `text` prints them and `html` writes the page. `export` writes robots for other simulators. Whatever
writes raises RunError where a file cannot be written.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
