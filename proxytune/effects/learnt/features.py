"""What a learnt effect looks at: groups of causal features of the motion that is asked for."""

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from proxytune.effects.effect import Signal
from proxytune.effects.learnt.bases import (
    Asked,
    Knots,
    after_reversal,
    backwards,
    body_after_reversal,
    grid,
    hats,
    level,
    played,
    sign,
    slowing,
    started,
    stopping,
    waves,
)


class Channel(NamedTuple):
    """Where a group's curves go: to the body's `forward`, `sideways` or `yaw`, or to the `left` or `right` wheel."""

    to: str
    unit: str
    basis: Callable[[Asked, Knots], Signal]


class Group(NamedTuple):
    """Curves over one signal.

    Attributes:
        title: What people call the signal.
        unit: The unit of the knots.
        channels: What the curves add, by name.
        low: The lowest knot that makes sense, or None where knots may be negative.
    """

    title: str
    unit: str
    channels: Mapping[str, Channel]
    low: float | None = None


def _of_wheels(unit: str, basis: Callable[[Asked, Knots, int], Signal]) -> dict[str, Channel]:
    """One channel a wheel."""
    return {
        "left": Channel("left", unit, lambda a, k: basis(a, k, 0)),
        "right": Channel("right", unit, lambda a, k: basis(a, k, 1)),
    }


LEVEL = "level"
"""The one group that is no curve: beside others it takes back what fitted gains and trim have taken of theirs."""

HEADING = "heading"
"""The one group that looks at where the robot points."""

GROUPS: Mapping[str, Group] = MappingProxyType(
    {
        LEVEL: Group("level", "at all speeds", _of_wheels("of its speed", level), 1e-3),
        "wheel_speed": Group("wheel speed", "m/s", _of_wheels("m/s", lambda a, k, wheel: hats(a.wheels[wheel], k))),
        "turn_rate": Group(
            "turn rate",
            "rad/s",
            {
                "forward": Channel("forward", "of the speed", lambda a, k: hats(a.yaw, k) * a.forward[..., None]),
                "sideways": Channel("sideways", "of the speed", lambda a, k: hats(a.yaw, k) * a.forward[..., None]),
                "yaw": Channel("yaw", "rad/s", lambda a, k: hats(a.yaw, k)),
            },
        ),
        "speed_and_turn": Group(
            "speed and turn rate together",
            "m/s, rad/s",
            {
                "forward": Channel("forward", "m/s", grid),
                "sideways": Channel("sideways", "m/s", grid),
                "yaw": Channel("yaw", "rad/s", grid),
            },
        ),
        "transients": Group(
            "changes of wheel speed",
            "s",
            {
                **_of_wheels("of the change", lambda a, k, wheel: a.bands[wheel]),
                "left_slowing": Channel("left", "of the change", lambda a, k: slowing(a, k, 0)),
                "right_slowing": Channel("right", "of the change", lambda a, k: slowing(a, k, 1)),
                "left_stopping": Channel("left", "of the change", lambda a, k: stopping(a, k, 0)),
                "right_stopping": Channel("right", "of the change", lambda a, k: stopping(a, k, 1)),
            },
            1e-3,
        ),
        "ringing": Group(
            "swings after changes of wheel speed",
            "Hz",
            {
                **_of_wheels("of the change", lambda a, k, wheel: a.rings[wheel].real),
                "left_later": Channel("left", "of the change", lambda a, k: a.rings[0].imag),
                "right_later": Channel("right", "of the change", lambda a, k: a.rings[1].imag),
            },
            1e-3,
        ),
        "play": Group("way in which wheel speed changes", "m/s", _of_wheels("of the play", played), 1e-3),
        "start": Group(
            "time since it stood",
            "s",
            {
                **_of_wheels("of its speed", lambda a, k, wheel: a.wheels[wheel][..., None] * started(a, k, wheel)),
                "left_push": Channel("left", "m/s", lambda a, k: sign(a, 0) * started(a, k, 0)),
                "right_push": Channel("right", "m/s", lambda a, k: sign(a, 1) * started(a, k, 1)),
            },
            1e-3,
        ),
        "reversal": Group(
            "way since reversal",
            "m",
            {
                **_of_wheels("of its speed", after_reversal),
                "forward": Channel("forward", "of the speed", body_after_reversal),
                "veer": Channel("yaw", "rad/m", body_after_reversal),
            },
            1e-3,
        ),
        "direction": Group(
            "direction of travel",
            "sign",
            {
                "forward": Channel("forward", "of the speed", lambda a, k: backwards(a, k) * a.forward[..., None]),
                "yaw": Channel("yaw", "of the yaw rate", lambda a, k: backwards(a, k) * a.yaw[..., None]),
                "veer": Channel("yaw", "rad/m", lambda a, k: backwards(a, k) * a.forward[..., None]),
            },
        ),
        "time": Group(
            "time in the episode",
            "s",
            _of_wheels("of its speed", lambda a, k, wheel: hats(a.seconds, k) * a.wheels[wheel][..., None]),
            1e-3,
        ),
        "use": Group(
            "cumulated use",
            "min at full speed",
            _of_wheels("of its speed", lambda a, k, wheel: hats(a.use, k) * a.wheels[wheel][..., None]),
            1e-6,
        ),
        "load": Group(
            "recent load",
            "s",
            _of_wheels("of its speed", lambda a, k, wheel: a.loads * a.wheels[wheel][..., None]),
            1e-3,
        ),
        HEADING: Group(
            "heading",
            "turns a turn",
            {
                "forward_cos": Channel("forward", "m/s", waves(np.cos)),
                "forward_sin": Channel("forward", "m/s", waves(np.sin)),
                "sideways_cos": Channel("sideways", "m/s", waves(np.cos)),
                "sideways_sin": Channel("sideways", "m/s", waves(np.sin)),
                "veer_cos": Channel("yaw", "rad/m", lambda a, k: waves(np.cos)(a, k) * np.abs(a.forward)[..., None]),
                "veer_sin": Channel("yaw", "rad/m", lambda a, k: waves(np.sin)(a, k) * np.abs(a.forward)[..., None]),
                "yaw_cos": Channel("yaw", "of the yaw rate", lambda a, k: waves(np.cos)(a, k) * a.yaw[..., None]),
                "yaw_sin": Channel("yaw", "of the yaw rate", lambda a, k: waves(np.sin)(a, k) * a.yaw[..., None]),
            },
            1.0,
        ),
    }
)
"""Every group that a learnt effect can have. Where the robot is and how its wheels are turned are no groups: a study's
proxy starts elsewhere than the drives did, and its wheels at another angle."""
