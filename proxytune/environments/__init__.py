"""Gymnasium both ways: lane following as an environment, and any environment as a domain family.

Importing this package registers `proxytune/LaneFollowing-v0`, so that `gymnasium.make` knows it. Gymnasium itself can
be told to: `gymnasium.make("proxytune.environments:proxytune/LaneFollowing-v0")`.
"""

import lazy_loader

from proxytune.errors import ExtensionError, to_install

try:
    import gymnasium
except ModuleNotFoundError:
    raise ExtensionError(f"gymnasium is not installed; {to_install('gym')}") from None

LANE_FOLLOWING = "proxytune/LaneFollowing-v0"

if LANE_FOLLOWING not in gymnasium.registry:
    gymnasium.register(LANE_FOLLOWING, entry_point="proxytune.environments.lane_following:LaneFollowingEnv")

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
