"""The one door for code that is not proxytune's own: modules beside a study, installed modules, and plug-ins.

Whatever a user can add is named in one of two ways. `module:attribute` is looked for in the study's folder first, then
among the installed modules. A plain name is one of those shipped, or that of an installed plug-in: an entry point of
the group `proxytune` that is called `KIND.NAME`, as in

    [project.entry-points.proxytune]
    "effect.yaw_drift" = "my_package.effects:YawDrift"
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
