"""The robots of the second generator: what is hidden in each, and which of the catalogue's names count as right."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from zlib import crc32

import numpy as np

Figures = Mapping[str, float | str]
Hidden = tuple[str, Figures]

PATCH: Figures = {"loss": 0.5, "x": 0.2, "y": -0.3, "radius": 0.8}

LEVELS = {"small": 0.5, "normal": 1.0}
SHAPES = ("heavy", "coloured")
NOISES = tuple(f"{level} {shape}" for level in LEVELS for shape in SHAPES)
"""How loud a log is, and whether the noise of its poses has heavy tails or a colour."""


@dataclass(frozen=True)
class Case:
    """A robot that one log is measured of.

    Attributes:
        name: What it is.
        effects: What is hidden: names in the tables of effects with their figures.
        noise: One of NOISES.
        seed: Seed of the drives and of everything random.
        trim: Its trim.
        delay: Its delay [s], a multiple of 5 ms.
        right: For every hidden effect, the catalogue's names that count as right.
        depends_on: What an effect outside of the catalogue depends on.
        integration: "exact" in steps of 2.5 ms, or "coarse": Euler's rule in steps of 5 ms.
    """

    name: str
    effects: tuple[Hidden, ...]
    noise: str
    seed: int
    trim: float
    delay: float
    right: tuple[tuple[str, ...], ...] = ()
    depends_on: str = ""
    integration: str = "exact"


def _case(
    number: int, name: str, effects: tuple[Hidden, ...], right: tuple[tuple[str, ...], ...] = (), depends_on: str = ""
) -> Case:
    """Seed, noise, trim and delay follow from the name; every other one is integrated coarsely."""
    name = f"second {name}"
    seed = crc32(name.encode())
    random = np.random.default_rng(seed)
    trim, delay = round(random.uniform(-0.1, 0.1), 4), 0.005 * int(random.integers(10, 45))
    noise = NOISES[int(random.integers(len(NOISES)))]
    return Case(name, effects, noise, seed, trim, delay, right, depends_on, ("exact", "coarse")[number % 2])


def _named(effect: Hidden) -> str:
    name, figures = effect
    return " ".join((name, *(f"{key} {value}" for key, value in figures.items())))


def _in_form(effects: Iterable[Hidden]) -> tuple[Case, ...]:
    return tuple(_case(n, _named(effect), (effect,), ((effect[0],),)) for n, effect in enumerate(effects))


IN_FORM: tuple[Case, ...] = _in_form(
    (
        *(("delay_jitter", {"spread": spread}) for spread in (0.12, 0.25)),
        *(("dropped_commands", {"probability": share}) for share in (0.2, 0.4)),
        *(("command_quantisation", {"step": step}) for step in (0.125, 0.22)),
        *(("slew_rate", {"rise": rise}) for rise in (0.5, 1.2)),
        *(("driver_map", {"offset": offset}) for offset in (0.08, 0.2)),
        *(("dead_band", {"width": width}) for width in (0.05, 0.1)),
        *(("dead_band", {"width": 0.1, "wheel": wheel}) for wheel in ("left", "right")),
        *(("stiction", {"breakaway": breakaway}) for breakaway in (0.12, 0.2)),
        ("stiction", {"breakaway": 0.18, "release": 0.75}),
        ("stiction", {"breakaway": 0.2, "wheel": "right"}),
        *(("saturation", {"limit": limit}) for limit in (0.65, 0.45)),
        ("saturation", {"limit": 0.5, "wheel": "left"}),
        *(("wheel_gain", {"left": gain, "right": gain}) for gain in (0.88, 1.12)),
        ("wheel_gain", {"left": 0.8}),
        *(("battery_sag", {"load": load}) for load in (0.15, 0.3)),
        ("battery_sag", {"fade": 0.4}),
        ("battery_sag", {"clock": 0.3}),
        *(("thermal_fade", {"loss": loss, "tau": tau}) for loss, tau in ((0.4, 4.0), (0.5, 10.0))),
        *(("motor_lag", {"tau": tau}) for tau in (0.08, 0.32, 0.5)),
        *(("motor_lag", {"tau": 0.4, "wheel": wheel}) for wheel in ("left", "right")),
        *(("backlash", {"gap": gap}) for gap in (0.35, 0.7)),
        ("backlash", {"gap": 0.8, "wheel": "left"}),
        *(("wheel_ripple", {"left": left, "right": right, "phase": 1.9}) for left, right in ((0.2, 0.12), (0.3, 0.0))),
        *(("yaw_scrub", {"baseline": baseline}) for baseline in (0.14, 0.19, 0.24)),
        *(("understeer", {"gain": gain}) for gain in (0.4, 0.9)),
        *(("yaw_lag", {"tau": tau}) for tau in (0.12, 0.3)),
        *(("turn_slip", {"loss": loss}) for loss in (0.06, 0.12)),
        *(("lateral_slip", {"slip": slip}) for slip in (0.05, -0.1)),
        ("cross_coupling", {"ahead": 0.015}),
        ("cross_coupling", {"turn": -0.5}),
        *(("floor_slope", {"x": x, "y": y}) for x, y in ((-0.015, 0.015), (0.0, 0.04))),
        ("floor_slope", {"x": 0.03, "y": 0.0, "push": 0.6}),
        *(("slippery_patch", {"loss": loss, "x": -0.3, "y": 0.3, "radius": 0.8}) for loss in (0.35, 0.6)),
        ("marker_offset", {"ahead": 0.04}),
        ("marker_offset", {"ahead": -0.015, "left": 0.02}),
        *(("heading_offset", {"degrees": degrees}) for degrees in (-2.0, 5.0)),
    )
)
"""Effects of the catalogue's own form, in sizes that matter."""

OTHER_FORM: tuple[Case, ...] = tuple(
    _case(n, _named((effect, figures)), ((effect, figures),), (right,))
    for n, (effect, figures, right) in enumerate(
        (
            ("polled_commands", {"period": 0.23}, ("delay_jitter", "dropped_commands")),
            ("exponential_jitter", {"mean": 0.06}, ("delay_jitter",)),
            ("broken_link", {"enter": 0.06, "leave": 0.25}, ("dropped_commands",)),
            ("square_levels", {"levels": 4}, ("command_quantisation",)),
            ("moving_average", {"rows": 12}, ("motor_lag", "slew_rate")),
            ("slow_start", {"rise": 1.2}, ("slew_rate",)),
            ("gated_driver", {"offset": 0.15, "least": 0.05}, ("driver_map",)),
            ("soft_dead_band", {"width": 0.15}, ("dead_band", "stiction")),
            ("rounded_saturation", {"limit": 0.6}, ("saturation",)),
            ("cells_that_drop_out", {"loss": 0.12, "every": 8.0}, ("battery_sag", "thermal_fade")),
            ("case_and_winding", {"loss": 0.5, "fast": 3.0, "slow": 20.0}, ("thermal_fade", "battery_sag")),
            ("rubber_backlash", {"gap": 0.8}, ("backlash",)),
            ("triangular_ripple", {"size": 0.3}, ("wheel_ripple",)),
            ("scrub_when_slow", {"share": 0.35}, ("yaw_scrub",)),
            ("understeer_with_square", {"gain": 2.5}, ("understeer",)),
            ("yaw_lag_of_second_order", {"tau": 0.25}, ("yaw_lag",)),
            ("turn_slip_with_root", {"loss": 0.12}, ("turn_slip",)),
            ("slip_angle", {"slip": 0.15, "most": 0.15}, ("lateral_slip",)),
            ("hilly_floor", {"x": 0.025, "y": -0.02}, ("floor_slope",)),
            ("oil_that_thins_out", {"loss": 0.6, "x": 0.2, "y": 0.2, "radius": 0.9}, ("slippery_patch",)),
            ("smoothed_poses", {"tau": 0.15}, ("motor_lag",)),
        )
    )
)
"""The same physics in another formula than the catalogue's."""

PAIRS: tuple[Case, ...] = tuple(
    _case(n, f"{first[0]} and {second[0]}", (first, second), ((first[0],), (second[0],)))
    for n, (first, second) in enumerate(
        (
            (("dead_band", {"width": 0.09}), ("yaw_scrub", {"baseline": 0.2})),
            (("motor_lag", {"tau": 0.4}), ("marker_offset", {"ahead": 0.04})),
            (("saturation", {"limit": 0.55}), ("lateral_slip", {"slip": 0.1})),
            (("battery_sag", {"fade": 0.4}), ("understeer", {"gain": 0.8})),
            (("floor_slope", {"x": 0.03, "y": 0.02}), ("motor_lag", {"tau": 0.08})),
            (("driver_map", {"offset": 0.15}), ("heading_offset", {"degrees": -5.0})),
            (("stiction", {"breakaway": 0.18}), ("wheel_ripple", {"left": 0.25, "right": 0.2, "phase": 0.5})),
            (("backlash", {"gap": 0.7}), ("turn_slip", {"loss": 0.12})),
            (("command_quantisation", {"step": 0.2}), ("yaw_lag", {"tau": 0.25})),
            (("slew_rate", {"rise": 1.0}), ("yaw_scrub", {"baseline": 0.13})),
            (("wheel_gain", {"left": 1.12, "right": 1.12}), ("slippery_patch", PATCH)),
            (("dead_band", {"width": 0.12, "wheel": "right"}), ("cross_coupling", {"ahead": 0.02})),
        )
    )
)
"""Two effects that leave different traces."""

OUTSIDE: tuple[Case, ...] = tuple(
    _case(n, effect, ((effect, figures),), depends_on=signal)
    for n, (effect, figures, signal) in enumerate(
        (
            ("watchdog", {"hold": 0.8}, "how long a message has not changed"),
            ("busy_computer", {"longer": 0.5}, "size of the messages"),
            ("sticky_throttle", {"play": 0.08}, "way in which the duty changes"),
            ("brake_before_reversing", {"pause": 0.5}, "time since a reversal"),
            ("kick_start", {"kick": 0.9, "pulse": 0.15}, "time since a start"),
            ("shared_current", {"limit": 0.7}, "sum of the duties"),
            ("biased_driver", {"bias": 0.05}, "nothing"),
            ("leaking_voltage", {"share": 0.2}, "duty of the other wheel"),
            ("warm_trim", {"gain": 0.25, "tau": 6.0}, "work of late"),
            ("breathing_supply", {"size": 0.25, "period": 8.0}, "time"),
            ("overshooting_motor", {"hz": 0.9, "damping": 0.25}, "transients"),
            ("coasting", {"tau": 0.9}, "time since the duty ended"),
            ("one_way_flat", {"loss": 0.6}, "wheel angle and its direction"),
            ("wheelspin", {"gain": 0.25}, "acceleration"),
            ("wearing_tyre", {"per_metre": 0.02}, "distance"),
            ("grip_limit", {"most": 0.15}, "forward speed times turn rate"),
            ("turn_limit", {"most": 0.9}, "turn rate"),
            ("weak_left_turns", {"factor": 0.8}, "sign of the turn rate"),
            ("caster_flip", {"kick": 4.0, "metres": 0.15}, "distance since a reversal"),
            ("tail_swing", {"gain": 0.1}, "acceleration"),
            ("gusts", {"speed": 0.04, "period": 9.0}, "time and heading"),
            ("banked_floor", {"gain": 0.7}, "position y"),
            ("turning_tilt", {"gain": 0.6}, "heading"),
            ("warped_tracker", {"size": 0.06, "metres": 0.3}, "position"),
            ("skewed_headings", {"size": 0.12}, "heading"),
            ("stretched_axis", {"factor": 0.85}, "heading"),
        )
    )
)
"""Effects that neither the catalogue nor the first generator has."""

CLEAN: tuple[Case, ...] = tuple(replace(_case(n + n // 4, f"clean {n}", ()), noise=NOISES[n % 4]) for n in range(16))
"""Nothing is hidden."""
