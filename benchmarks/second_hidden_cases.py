"""Measured logs of a Duckiebot with a hidden effect: another simulation than hidden_cases.py's; they share nothing.

The robot: messages → delay → duty → wheel speeds asked for, with trim → first-order motor (0.20 s) → forward speed and
yaw rate → pose, in steps of 2.5 ms that are integrated exactly (arcs of circles) or of 5 ms by Euler's rule. Driving
makes the pose walk at random; what is measured of it has heavy-tailed or coloured noise. Its commands are ten ways to
steer, none of them from manoeuvres.py, some driven twice.
"""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from typing import NamedTuple
from zlib import crc32

import numpy as np
from scipy.signal import lfilter
from second_hidden_robot import (
    ARRIVED,
    BASELINE,
    DUTY,
    FULL_SPEED,
    MOTOR,
    MOTOR_LAG,
    PLACES,
    ROW_S,
    SENT,
    TARGET,
    TRACKED,
    TWIST,
    WHEELS,
    Array,
    Run,
    Table,
    lagging,
)

from proxytune.logs import Log, LogEpisode

Figures = Mapping[str, float | str]
Hidden = tuple[str, Figures]

PATCH: Figures = {"loss": 0.5, "x": 0.2, "y": -0.3, "radius": 0.8}

LEVELS = {"small": 0.5, "normal": 1.0}
SHAPES = ("heavy", "coloured")
NOISES = tuple(f"{level} {shape}" for level in LEVELS for shape in SHAPES)
"""How loud a log is, and whether the noise of its poses has heavy tails or a colour."""

STEPS = {"exact": 20, "coarse": 10}
"""Steps per row of 50 ms."""

POSE_NOISE, COLOUR_S = (0.002, 0.002, 0.005), 0.15
"""Standard deviation of a measured pose [m], [m], [rad], and how long coloured noise remembers itself."""

PER_METRE, PER_RADIAN = (0.009, 0.002, 0.035), (0.001, 0.001, 0.02)
"""How far a pose has walked at random, forward, sideways and round, after a metre and after a radian: with √way."""

ROWS_PER_S = 20
FULL_TURN_RATE = 0.6 / 0.16
"""Yaw rate of a difference of 1 between the wheels [rad/s]."""

Random = np.random.Generator
Segment = Callable[[Random, int], Array]
"""Duties (rows, 2) of a stretch of a drive: left and right, cut to [−1, 1] afterwards."""


@dataclass(frozen=True)
class Case:
    """A robot that one log is measured of."""

    name: str  # what it is
    effects: tuple[Hidden, ...]  # what is hidden: names in the tables of effects with their figures
    noise: str  # one of NOISES
    seed: int  # seed of the drives and of everything random
    trim: float
    delay: float  # its delay [s], a multiple of 5 ms
    right: tuple[tuple[str, ...], ...] = ()  # for every hidden effect, the catalogue's names that count as right
    depends_on: str = ""  # what an effect outside of the catalogue depends on
    integration: str = "exact"  # "exact" in steps of 2.5 ms, or "coarse": Euler's rule in steps of 5 ms


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
            ("understeer_with_square", {"gain": 2.5}, ("understeer", "inertia")),
            ("yaw_lag_of_second_order", {"tau": 0.25}, ("yaw_lag",)),
            ("turn_slip_with_root", {"loss": 0.12}, ("turn_slip",)),
            ("slip_angle", {"slip": 0.15, "most": 0.15}, ("lateral_slip",)),
            ("hilly_floor", {"x": 0.025, "y": -0.02}, ("floor_slope",)),
            ("oil_that_thins_out", {"loss": 0.6, "x": 0.2, "y": 0.2, "radius": 0.9}, ("slippery_patch",)),
            ("smoothed_poses", {"tau": 0.15}, ("motor_lag", "inertia")),
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

NAMED_SINCE = {"second brake_before_reversing": "reversal_pause"}
"""Cases that were outside the catalogue until it had such an effect, with its name."""
OTHER_FORM += tuple(
    replace(case, right=((NAMED_SINCE[case.name],),), depends_on="") for case in OUTSIDE if case.name in NAMED_SINCE
)
OUTSIDE = tuple(case for case in OUTSIDE if case.name not in NAMED_SINCE)

CLEAN: tuple[Case, ...] = tuple(replace(_case(n + n // 4, f"clean {n}", ()), noise=NOISES[n % 4]) for n in range(16))
"""Nothing is hidden."""


class Course(NamedTuple):
    """Duties (episodes, rows, 2) and starting poses (episodes, 3): x [m], y [m], heading [rad]."""

    duties: Array
    starts: Array


def plan(seed: int, episodes: int, rows: int) -> Course:
    """Drives of three to five segments each; every sixth repeats one before, set down by hand where that began."""
    random = np.random.default_rng([seed, 22])
    duties = np.stack([_drive(random, rows, number) for number in range(episodes)])
    starts = random.uniform((-0.8, -0.8, -np.pi), (0.8, 0.8, np.pi), (episodes, 3))
    for copy in range(5, episodes, 6):
        first = copy - int(random.integers(2, 5))
        duties[copy], starts[copy] = duties[first], starts[first] + random.normal(0.0, (0.01, 0.01, 0.02))
    return Course(duties, starts)


def _drive(random: Random, rows: int, number: int) -> Array:
    count = int(random.integers(3, 6))
    lengths = np.diff(np.rint(np.cumsum([0.0, *random.dirichlet(np.full(count, 8.0))]) * rows).astype(int))
    kinds = [SEGMENTS[(3 * number + place) % len(SEGMENTS)] for place in range(count)]
    return np.clip(np.concatenate([kind(random, int(n)) for kind, n in zip(kinds, lengths, strict=True)]), -1.0, 1.0)


def _both(ahead: Array, turn: Array) -> Array:
    return np.stack((ahead - turn, ahead + turn), axis=1)


def _seconds(rows: int) -> Array:
    return np.arange(rows) / ROWS_PER_S


def _held(random: Random, rows: int, least: int, most: int, draw: Callable[[int], Array]) -> Array:
    """Drawn values, each held for `least` to `most` rows."""
    lengths = random.integers(least, most + 1, rows // least + 1)
    return np.repeat(draw(len(lengths)), lengths)[:rows]


def binary_sequences(random: Random, rows: int) -> Array:
    """Sum and difference each jump between two values, at random rows."""
    middle, swing, turn = random.uniform(0.2, 0.5), random.uniform(0.1, 0.35), random.uniform(0.04, 0.3)
    bits = [_held(random, rows, 4, 24, lambda n: random.choice((-1.0, 1.0), n)) for _ in range(2)]
    return _both(middle + swing * bits[0], turn * bits[1])


def chirps(random: Random, rows: int) -> Array:
    """The difference, or the sum, swings ever faster, from 0.1 to 1.5 Hz."""
    time, last = _seconds(rows), max(rows, 1) / ROWS_PER_S
    wave = np.sin(2.0 * np.pi * (0.1 * time + 0.7 * time**2 / last) + random.uniform(0.0, 6.0))
    if random.random() < 0.5:
        return _both(
            random.uniform(0.1, 0.5) + random.uniform(0.2, 0.5) * wave, np.full(rows, random.normal(0.0, 0.05))
        )
    return _both(np.full(rows, random.uniform(0.2, 0.6)), random.uniform(0.1, 0.3) * wave)


def circles_both_ways(random: Random, rows: int) -> Array:
    """Eights of a whole circle to the left and a whole one to the right."""
    turn = random.uniform(0.12, 0.3)
    circle_s = 2.0 * np.pi / (2.0 * turn * FULL_TURN_RATE)
    side = np.where(_seconds(rows) // circle_s % 2 == 0, 1.0, -1.0) * random.choice((-1.0, 1.0))
    return _both(np.full(rows, random.uniform(0.25, 0.7)), turn * side)


def traffic(random: Random, rows: int) -> Array:
    """Stop and go: gentle or sudden starts, sudden stops, rests, some steering."""
    ahead = _held(random, rows, 16, 50, lambda n: random.uniform(0.2, 1.0, n) * (np.arange(n) % 2))
    gentle = lfilter([0.15], [1.0, -0.85], ahead)
    steer = _held(random, rows, 10, 30, lambda n: random.normal(0.0, 0.04, n))
    return _both(np.where(ahead > 0.0, gentle if random.random() < 0.5 else ahead, 0.0), np.where(ahead > 0, steer, 0))


def joystick(random: Random, rows: int) -> Array:
    """A hand on a stick: smooth random walks around the middle, let go now and then."""
    kicks = random.standard_normal((rows + 200, 2))
    smooth = lfilter([0.05], [1.0, -0.95], lfilter([0.08], [1.0, -0.92], kicks, axis=0), axis=0)[200:]
    stick = smooth / 0.125 * random.uniform((0.25, 0.1), (0.45, 0.2)) + (0.25, 0.0)
    stick *= _held(random, rows, 30, 90, lambda n: random.choice((0.0, 1.0), n, p=(0.15, 0.85)))[:, None]
    return _both(stick[:, 0], stick[:, 1])


def spirals(random: Random, rows: int) -> Array:
    """Ever tighter or wider, forward or back."""
    grown = np.linspace(0.0, 1.0, max(rows, 1))[:rows][:: random.choice((-1, 1))]
    ahead = random.uniform(0.3, 0.7) * random.choice((1.0, 1.0, -1.0))
    return _both(np.full(rows, ahead), random.choice((-1.0, 1.0)) * (0.03 + random.uniform(0.15, 0.35) * grown))


def turns_on_the_spot(random: Random, rows: int) -> Array:
    """Short drives, pauses and turns on the spot, in turns."""
    place = np.arange(rows // 10 + 1)
    held = random.integers(10, 30, len(place))
    ahead = np.where(place % 4 == 0, random.uniform(0.3, 0.9, len(place)), 0.0)
    turn = np.where(place % 4 == 2, random.uniform(0.1, 0.5, len(place)) * random.choice((-1.0, 1.0), len(place)), 0.0)
    return np.repeat(_both(ahead, turn), held, axis=0)[:rows]


def three_point_turns(random: Random, rows: int) -> Array:
    """Forward to one side, back to the other, again and again."""
    lengths = random.integers(14, 40, rows // 14 + 1)
    way = np.repeat(np.where(np.arange(len(lengths)) % 2 == 0, 1.0, -1.0), lengths)[:rows]
    return _both(way * random.uniform(0.25, 0.7), way * random.uniform(-0.2, 0.2))


def staircases(random: Random, rows: int) -> Array:
    """Each wheel climbs stairs of its own, from full duty back to full duty forward."""
    stairs = [np.repeat(np.linspace(-0.5, 1.0, 13), n) for n in random.integers(8, 30, 2)]
    return np.stack([np.resize(np.concatenate((stair, stair[::-1])), rows) for stair in stairs], axis=1)


def crawling(random: Random, rows: int) -> Array:
    """Small duties, up and down through zero."""
    phase = 2.0 * np.pi * np.outer(_seconds(rows), random.uniform(0.1, 0.3, 2)) + random.uniform(0.0, 6.0, 2)
    return random.uniform(0.12, 0.32, 2) * np.sin(phase)


SEGMENTS: tuple[Segment, ...] = (
    binary_sequences,
    traffic,
    crawling,
    joystick,
    circles_both_ways,
    three_point_turns,
    chirps,
    turns_on_the_spot,
    staircases,
    spirals,
)


def make_log(case: Case, *, episodes: int = 12, seconds: float = 60.0, noiseless: bool = False) -> Log:
    """What would have been measured of this robot, 20 rows per second, from rest."""
    course = plan(case.seed, episodes, round(seconds / ROW_S))
    level = 0.0 if noiseless else LEVELS[case.noise.split()[0]]
    poses = _passed(TRACKED, case, driven(case, course, level))
    return log_of(case.name, course, poses + level * noisy(case, poses.shape))


def log_of(name: str, course: Course, poses: Array) -> Log:
    """The log of a course: its duties, and poses (episodes, rows, 3) as they were measured."""
    times = np.arange(poses.shape[1]) * ROW_S
    pairs = enumerate(zip(course.duties, poses, strict=True))
    rows = (LogEpisode(f"{e:02d}", times, duties, own, None) for e, (duties, own) in pairs)
    return Log(name, "duckiebot", "duty", 1.0 / ROW_S, {}, tuple(rows))


def driven(case: Case, course: Course, level: float) -> Array:
    """Poses (E, rows, 3) of the middle of the axle, with `level` times the normal random walk."""
    twists, run = twists_of(case, course.duties)
    twists = twists + level * _walk(case, twists)
    places = [(PLACES[name], figures) for name, figures in case.effects if name in PLACES]
    per_row = STEPS[case.integration]
    if not places:
        return _path(twists, course.starts, run)[:, ::per_row]
    poses = np.empty((len(twists), twists.shape[1] + 1, 3))
    poses[:, 0] = course.starts
    for step in range(twists.shape[1]):
        pose, twist = poses[:, step], twists[:, step]
        for effect, figures in places:
            twist = effect(twist, pose, step * run.step_s, **figures)
        poses[:, step + 1] = _moved(pose, twist, run)
    return poses[:, ::per_row]


def twists_of(case: Case, messages: Array) -> tuple[Array, Run]:
    """Forward, sideways speed [m/s] and yaw rate [rad/s] (E, T, 3) that the wheels ask for, and the run."""
    exact, step_s = case.integration == "exact", ROW_S / STEPS[case.integration]
    duties = _in_force(case, messages, step_s, exact)
    run = Run(_random(case, "wheels"), step_s, exact, duties)
    asked = _passed(TARGET, case, _passed(DUTY, case, duties, run) * (1.0 - case.trim, 1.0 + case.trim), run)
    motors = [name for name, _ in case.effects if name in MOTOR]
    turning = _passed(MOTOR, case, asked, run) if motors else lagging(asked, MOTOR_LAG, run)
    left, right = np.moveaxis(_passed(WHEELS, case, turning, run), -1, 0) * FULL_SPEED
    twists = np.stack(((left + right) / 2.0, np.zeros_like(left), (right - left) / BASELINE), axis=-1)
    return _passed(TWIST, case, twists, run), run


def noisy(case: Case, shape: tuple[int, ...]) -> Array:
    """Normal noise of measured poses: Student's t with 5 degrees of freedom, or half of it coloured."""
    random = _random(case, "tracker")
    if case.noise.split()[1] == "heavy":
        return random.standard_t(5, shape) / np.sqrt(5.0 / 3.0) * POSE_NOISE
    kept = np.exp(-ROW_S / COLOUR_S)
    long = (shape[0], shape[1] + 100, shape[2])
    coloured = lfilter([np.sqrt(1.0 - kept**2)], [1.0, -kept], random.standard_normal(long), axis=1)[:, 100:]
    return np.sqrt(0.5) * (coloured + random.standard_normal(shape)) * POSE_NOISE


def _passed(table: Table, case: Case, signal: Array, *run: Run) -> Array:
    for name, figures in case.effects:
        if name in table:
            signal = table[name](signal, *run, **figures)
    return signal


def _random(case: Case, what: str) -> np.random.Generator:
    return np.random.default_rng([case.seed, crc32(what.encode()), 2])


def _in_force(case: Case, messages: Array, step_s: float, exact: bool) -> Array:
    """The duty in force in each step (E, T, 2): that of the newest message which has arrived by its beginning."""
    episodes, rows, _ = messages.shape
    run = Run(_random(case, "messages"), ROW_S, exact, messages)
    sent = np.concatenate((np.zeros((episodes, 1, 2)), _passed(SENT, case, messages, run)), axis=1)
    arrival = _passed(ARRIVED, case, np.tile(np.arange(rows) * ROW_S + case.delay, (episodes, 1)), run)
    starts = np.arange(round((rows - 1) * ROW_S / step_s)) * step_s + 1e-9
    number = np.stack([np.searchsorted(own, starts, side="right") for own in arrival])
    return np.take_along_axis(sent, number[..., None], axis=1)


def _walk(case: Case, twists: Array) -> Array:
    """Twists (E, T, 3) of a random walk, held over each row, that grows with the way and the turn of the row."""
    per_row = STEPS[case.integration]
    ways = np.abs(twists).reshape(len(twists), -1, per_row, 3).mean(axis=2) * ROW_S
    size = np.sqrt(ways[..., :1] * np.square(PER_METRE) + ways[..., 2:] * np.square(PER_RADIAN)) / ROW_S
    return np.repeat(size * _random(case, "walk").standard_normal(size.shape), per_row, axis=1)


def _path(twists: Array, starts: Array, run: Run) -> Array:
    """Poses (E, T + 1, 3): arcs of circles, or Euler's rule."""
    turns = twists[..., 2] * run.step_s
    headings = starts[:, None, 2] + np.cumsum(turns, axis=1)
    chord = np.sinc(turns / (2.0 * np.pi)) * np.exp(-0.5j * turns) if run.exact else np.exp(-1j * turns)
    moved = (twists[..., 0] + 1j * twists[..., 1]) * chord * np.exp(1j * headings) * run.step_s
    places = (starts[:, :1] + 1j * starts[:, 1:2]) + np.cumsum(moved, axis=1)
    later = np.stack((places.real, places.imag, headings), axis=-1)
    return np.concatenate((starts[:, None], later), axis=1)


def _moved(pose: Array, twist: Array, run: Run) -> Array:
    """The same for one step (E, 3), the chord of its arc to a ten-thousandth of a millionth."""
    forward, aside, turn = (twist * run.step_s).T
    middle = pose[:, 2] + turn / 2.0 if run.exact else pose[:, 2]
    chord = 1.0 - turn**2 / 24.0 if run.exact else 1.0
    east, north = np.cos(middle) * chord, np.sin(middle) * chord
    return pose + np.stack((forward * east - aside * north, forward * north + aside * east, turn), axis=1)
