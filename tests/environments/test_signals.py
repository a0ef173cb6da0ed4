"""Which effects can wrap which environment, and why the others cannot."""

import pytest
from one_line import complaint_of
from toy_families import CART, PENDULUM, SCREEN, family

from proxytune.effects import CATALOGUE, PARAMETERS, effect_of
from proxytune.errors import ExtensionError

pytest.importorskip("gymnasium")


ODD = 'environment = "toys:Odd"\nsteps = 3\n'
UNBOUNDED = CART + "[arguments]\nbounds = [-inf, inf]\n"
TIMELESS = CART.replace("rate_hz = 10.0", "")


@pytest.mark.parametrize(
    ("text", "name", "reason"),
    [
        (PENDULUM, "yaw_scrub", "it bends the motion of a robot's body; vary the environment's own physics"),
        (PENDULUM, "camera_pitch", "it mounts the camera that proxytune draws; the environment draws its own"),
        (PENDULUM, "trim", "it is made for two actions, a left and a right wheel; here are 1"),
        (PENDULUM, "dead_band.imbalance", "imbalance shares an effect out between two wheels; here are 1 actions"),
        (CART, "backlash.gap", "it needs a robot's full_speed, which an environment does not state"),
        (CART, "blur", "effects on images take uint8 pictures of shape (rows, columns, 3)"),
        (CART, "heading_offset", "the pose is not stated; add [domain.state] x = 0, y = 1, heading = 2"),
        (SCREEN, "delay", "the actions are Discrete(3); these effects take Box actions of shape (n,)"),
        (UNBOUNDED, "delay", "the actions have no bounds"),
        (TIMELESS, "delay", "it needs the time that a step takes; add rate_hz to [domain]"),
        (TIMELESS, "battery_sag.fade", "it needs the time that a step takes"),
        (ODD, "delay", "the actions are Dict("),
        (ODD, "blur", "the observations are Dict("),
        (CART, "learnt.level.left@1", "bends the motion of a robot's body"),
    ],
)
def test_what_cannot_wrap_an_environment_says_why(tmp_path, text, name, reason):
    known = family(tmp_path, text).parameters
    assert reason in complaint_of(known.get, name)
    assert name not in list(known)


def test_effects_wrap_an_environment_by_its_actions_and_rate_a_users_own_two_actions_alone(tmp_path):
    names = {effect_of(name) for name in family(tmp_path, TIMELESS).parameters}
    assert {"dead_band", "stiction", "saturation", "trim", "dropped_commands"} <= names
    expected = {name for name in PARAMETERS if CATALOGUE[effect_of(name)].stage in ("command", "actuation")}
    assert set(family(tmp_path, CART).parameters) == expected - {"backlash.gap", "backlash.imbalance"}
    known = family(tmp_path, PENDULUM).parameters
    assert list(known)[:2] == ["gravity", "mass"]
    assert (known["gravity"].low, known["gravity"].unit) == (8.0, "m/s²")
    assert len(known) == len(list(known))
    assert family(tmp_path, CART).parameters.get("dely") is None
    (tmp_path / "own.py").write_text(OWN)
    assert family(tmp_path, CART).parameters["own:Mine"].name == "trim"
    with pytest.raises(ExtensionError, match="made for two actions"):
        family(tmp_path, PENDULUM).parameters.get("own:Mine")


OWN = """
from proxytune.effects import Stage
from proxytune.effects.motors import Trim

class Mine(Trim):
    name = "mine"
"""
