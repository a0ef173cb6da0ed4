"""Meaning of effects and parameters in a clause each, and a finding in a sentence: names, sizes, worth.

What an effect does is the first clause of its docstring, a user's own effect's as well.
"""

import inspect
from collections.abc import Iterable, Mapping
from dataclasses import asdict
from types import MappingProxyType
from typing import Any

from proxytune.diagnosis import Estimate
from proxytune.effects import SHIPPED, Catalogue
from proxytune.errors import ExtensionError
from proxytune.report.wording import digits, fixed, listed, plain, short, span

SHARED_OUT = "the right wheel has {} more of it than both have on average, the left one as much less"
CLAUSES: Mapping[str, str] = MappingProxyType(
    {
        "delay_jitter": "each command is late by another time, up to {}",
        "dropped_commands": "a share of {} of the commands never arrives",
        "command_quantisation": "commands are rounded to multiples of {}",
        "delay": "commands arrive {} late",
        "slew_rate": "from rest to full duty takes {}",
        "driver_map": "wheels jump to a duty of {} as soon as they turn at all",
        "dead_band.width": "wheels stand still below a duty of {}",
        "dead_band.imbalance": SHARED_OUT,
        "stiction.breakaway": "a resting wheel needs a duty of {} to start",
        "stiction.imbalance": SHARED_OUT,
        "stiction.release": "a turning wheel goes on down to {} times that duty",
        "stiction.reversal": "a wheel that turns back rests in between, at {} of the way from release to breakaway",
        "saturation.limit": "wheels turn no faster than at a duty of {}",
        "saturation.imbalance": SHARED_OUT,
        "trim": "the right wheel is faster, the left one slower, by a share of {}",
        "wheel_gain.left": "the left wheel turns {} times as fast as nominal",
        "wheel_gain.right": "the right wheel turns {} times as fast as nominal",
        "battery_sag.load": "wheels lose a share of {} of their speed at full load",
        "battery_sag.fade": "wheels get slower by {} of driving at full duty",
        "battery_sag.fade_with_time": "wheels get slower by {}, driving or not",
        "thermal_fade.loss": "hot motors lose a share of {} of their speed",
        "thermal_fade.time_constant": "motors get hot within {}",
        "motor_lag.time_constant": "wheels follow their commands with a lag of {}",
        "motor_lag.imbalance": SHARED_OUT,
        "backlash.gap": "wheels turn through a gap of {} when they reverse",
        "backlash.imbalance": SHARED_OUT,
        "wheel_ripple.left_sine": "the left wheel's speed ripples once a turn, by a share of {} (sine)",
        "wheel_ripple.left_cosine": "the left wheel's speed ripples once a turn, by a share of {} (cosine)",
        "wheel_ripple.right_sine": "the right wheel's speed ripples once a turn, by a share of {} (sine)",
        "wheel_ripple.right_cosine": "the right wheel's speed ripples once a turn, by a share of {} (cosine)",
        "yaw_scrub": "the robot turns as if its wheels were {} apart",
        "understeer": "the faster it drives the less it turns, by the factor 1 + {} times the speed",
        "yaw_lag": "turning follows the wheels with a lag of {}",
        "turn_slip": "turning costs forward speed, a share of {} for each rad/s",
        "lateral_slip": "in bends the robot slides outwards, by {} times speed times turn rate",
        "cross_coupling.forward": "turning pushes the robot forwards, by {} times the square of the turn rate",
        "cross_coupling.turn": "driving turns the robot, by {} whichever way it goes",
        "floor_slope.x": "the floor slows the robot by {} on its way along x",
        "floor_slope.y": "the floor slows the robot by {} on its way along y",
        "floor_slope.push": "across the slope the robot slides by {} times that",
        "slippery_patch.loss": "in a patch of the floor the robot loses a share of {} of its motion",
        "slippery_patch.x": "the patch's middle is at x = {}",
        "slippery_patch.y": "the patch's middle is at y = {}",
        "slippery_patch.radius": "the patch's radius is {}",
        "marker_offset.forward": "the tracked point is {} ahead of the axle",
        "marker_offset.left": "the tracked point is {} left of the middle",
        "heading_offset": "measured headings are off by {}",
        "camera_pitch": "the camera looks down by {}",
        "camera_roll": "the camera is tilted by {}",
        "camera_yaw": "the camera looks {} to the left",
        "camera_height": "the camera is {} above the floor",
        "camera_forward": "the lens is {} ahead of the axle",
        "field_of_view": "the lens sees {} from top to bottom",
        "lens_distortion": "the lens bends straight lines, by a k1 of {}",
        "lens_centre.right": "the lens' axis meets the picture {} of its height right of the middle",
        "lens_centre.down": "the lens' axis meets the picture {} of its height below the middle",
        "pixel_aspect": "things look {} times as wide as they are",
        "blur": "pictures blur over {}",
        "rolling_shutter": "the top row is {} older than the bottom one",
        "camera_latency": "pictures arrive {} late",
        "defocus": "points are spots {} of the picture's height wide",
        "vignetting": "corners are darker by a share of {}",
        "exposure.gain": "pictures are {} times as bright",
        "exposure.gamma": "brightness is raised to the power of {}",
        "image_noise": "pixels scatter by {}",
        # Of cars
        "steering_quantisation": "steering is rounded to multiples of {}",
        "steering_delay": "steering arrives {} later than throttle",
        "steering_slew_rate": "from straight ahead to full lock takes {}",
        "steering_dead_band": "wheels stay straight below a steering of {}",
        "steering_saturation": "wheels turn no farther than {}",
        "steering_lag": "wheels follow the steering with a lag of {}",
        "steering_gain": "wheels turn {} times as far as nominal",
        "steering_backlash": "wheels stay until the linkage has gone through a play of {}",
        "steering_offset": "wheels are off by {} where they should be straight",
        "steering_curve.left": "full lock to the left is {}",
        "steering_curve.right": "full lock to the right is {}",
        "steering_curve.left_bend": "steering to the left is bent by {}",
        "steering_curve.right_bend": "steering to the right is bent by {}",
        "dead_band": "the motor does nothing below a throttle of {}",
        "saturation": "the motor turns no faster than at a throttle of {}",
        "wheel_gain": "the car is {} times as fast as nominal",
        "motor_lag": "the motor follows throttle with a lag of {}",
        "backlash": "the wheels turn through a gap of {} when they reverse",
        "steering_friction": "at full lock a share of {} of the speed is lost",
        "rolling.inertia": "the car's mass makes it follow its motor with a lag of {}",
        "rolling.freewheel": "without throttle it brakes the less the nearer {} is to 1",
        "rolling.friction": "rolling friction brakes it by {}",
        "rolling.drag": "it loses {} of its speed",
        "tyres.understeer": "the faster it drives the less it turns, by the factor 1 + {} times the speed squared",
        "tyres.slide": "its tyres hold up to a lateral acceleration of 1 by {}",
        "tyres.rear_slip": "its rear slides outwards, by a slip angle of {} times the lateral acceleration",
    }
)
"""By name in θ: what a value says; {} stands for the value with its unit and interval."""

WORSE = 2.0
"""From here on an error without an effect is told as so many times the one with it."""
MOST_FITTED = 4
"""So many declared parameters are told with their values in the first sentence; the table has all."""
HORIZON = "2"
"""The windows [s] whose error tells what an effect is worth, where there are such."""


def what_it_does(effect: str, catalogue: Catalogue = SHIPPED) -> str:
    """What an effect does, in a clause: the first of its docstring; empty where it has none."""
    said = (inspect.getdoc(catalogue.effect(effect)) or "").partition("\n\n")[0].replace("\n", " ").replace("`", "")
    clause = min((said.partition(end)[0] for end in (": ", "; ", ". ")), key=len).rstrip(".")
    return clause[:1].lower() + clause[1:]


def clause_of(name: str, said: str) -> str:
    """What a parameter's value says, by its name in θ; a user's own parameter is told by its name."""
    return CLAUSES[name].format(said) if name in CLAUSES else f"{plain(name)} {said}"


def finding(effect: Mapping[str, Any], catalogue: Catalogue = SHIPPED) -> str:
    """An effect that was added, as `diagnose --json` has it, in a clause with its size, and what it is worth.

    Args:
        effect: One of the document's effects.
        catalogue: Which knows the effect.
    """
    name, known = str(effect["name"]), effect.get("parameters") or {}
    try:
        own = dict(
            zip((one.name for one in catalogue.effect(name).parameters), catalogue.theta_names(name), strict=True)
        )
    except ExtensionError:
        own = {}
    sized = {key: one for key, one in known.items() if one["value"] is not None}
    said = [
        clause_of(own.get(key, key), _size(one))
        for key, one in sized.items()
        if key != "imbalance" or one["value"] != 0.0
    ]
    return f"{plain(name)}: {'; '.join([listed(said), *_worth(effect)])}" if said else plain(name)


def findings(effects: Iterable[Mapping[str, Any]], catalogue: Catalogue = SHIPPED) -> str:
    """All effects that were added, one after another; empty where none was."""
    said = [finding(effect, catalogue) for effect in effects]
    return "; ".join(said) if any(":" in one for one in said) else listed(said)


def fitted(names: Iterable[str], theta: Mapping[str, Estimate]) -> str:
    """Values that were fitted of what was declared, as ", with trim 0.043 (0.042 to 0.044)"; empty where none was.

    Args:
        names: Parameters that were declared, by name in θ.
        theta: What was fitted.
    """
    known = [name for name in names if name in theta and not name.endswith(".imbalance")]
    said = [f"{plain(name).replace('.', ' ')} {_size(asdict(theta[name]))}" for name in known[:MOST_FITTED]]
    said += [f"{len(known) - MOST_FITTED} more"] * (len(known) > MOST_FITTED)
    return f", with {listed(said)}" if said else ""


def _size(estimate: Mapping[str, Any]) -> str:
    """A value with unit and interval; a duty is told as the clause has it."""
    (low, high), unit = estimate["interval"], "" if estimate["unit"] == "duty" else f" {estimate['unit']}".rstrip()
    if low is None or high is None or not low < high:
        return f"{short(estimate['value'])}{unit}"
    places = max(0, digits((low, high)) - 1)
    return f"{fixed(estimate['value'], places)}{unit} ({span((low, high), places)})"


def _worth(effect: Mapping[str, Any]) -> list[str]:
    """What predictions are without it; nothing where that was not measured, or is nothing."""
    worth = {h: one for h, one in (effect.get("worth") or {}).items() if one["interval"][0] > 0.0}
    if not worth:
        return []
    horizon = HORIZON if HORIZON in worth else max(worth, key=lambda h: worth[h]["value"])
    value, (low, high) = worth[horizon]["value"], worth[horizon]["interval"]
    if 1.0 + value / 100.0 < WORSE:
        return [f"without it predictions over {horizon} s are {value:.0f} % worse ({low:.0f} to {high:.0f})"]
    times, least, most = (short(1.0 + one / 100.0, 2) for one in (value, low, high))
    return [f"without it predictions over {horizon} s are {times} times as far off ({least} to {most})"]
