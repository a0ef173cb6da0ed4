"""Gymnasium both ways: lane following as an environment, and any environment as a domain family.

Importing this package registers `proxytune/LaneFollowing-v0` and `proxytune/CarLaneFollowing-v0`, the same with a car,
so that `gymnasium.make` knows them. Gymnasium itself can be told to:
`gymnasium.make("proxytune.environments:proxytune/LaneFollowing-v0")`.
"""

import lazy_loader

from proxytune.errors import ExtensionError, to_install

try:
    import gymnasium
except ModuleNotFoundError:
    raise ExtensionError(f"gymnasium is not installed; {to_install('gym')}") from None

LANE_FOLLOWING = "proxytune/LaneFollowing-v0"
CAR_LANE_FOLLOWING = "proxytune/CarLaneFollowing-v0"
_DOMAINS = {LANE_FOLLOWING: {}, CAR_LANE_FOLLOWING: {"robot": "car", "map": "car_loop"}}

for _id in _DOMAINS.keys() - gymnasium.registry.keys():
    gymnasium.register(_id, "proxytune.environments.lane_following:LaneFollowingEnv", kwargs=_DOMAINS[_id])

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
