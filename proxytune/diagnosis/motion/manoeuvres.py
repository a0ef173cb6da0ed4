"""The manoeuvre to drive next: the one in which two rivals would differ most."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from proxytune.diagnosis.motion.drives import Drives, Floats
from proxytune.diagnosis.motion.effect_size import trace_of
from proxytune.diagnosis.motion.evidence import AdoptedEffect, Findings
from proxytune.diagnosis.motion.fitting import Fit, evaluate
from proxytune.diagnosis.motion.screening import Candidate
from proxytune.driving import Robot

SECONDS = 60.0

REPEATS = 10
"""A manoeuvre is repeated so often to tell noise."""


@dataclass(frozen=True)
class Manoeuvre:
    """A drive that tells rivals apart, or noise from what is missing if it is driven several times.

    Attributes:
        name: What it is called.
        description: How to drive it.
        between: What it tells apart.
        nats_per_minute: How clearly a minute of it speaks, ½ min_m ‖P(d_a − m·d_b)‖²; None of noise.
        duties: The commands, one per row of the log's rate (rows, 2).
        times: How often to drive it from the same commands.
    """

    name: str
    description: str
    between: tuple[str, str]
    nats_per_minute: float | None
    duties: Floats
    times: int = 1


def _figure_eight(t: Floats) -> Floats:
    return _wheels(np.full_like(t, 0.6), 0.25 * np.sign(np.sin(2 * np.pi * t / 12.0)))


def _arcs(t: Floats) -> Floats:
    return _wheels(0.3 + 0.15 * np.floor(t / 15.0), 0.08 * (1.0 + np.floor(t / 5.0) % 3) * np.sign(7.5 - t % 15.0))


def _creeping(t: Floats) -> Floats:
    return _wheels(0.25 * np.sin(2 * np.pi * t / 20.0), np.zeros_like(t))


def _stop_and_go(t: Floats) -> Floats:
    return _wheels(0.5 * (t % 2.0 < 1.0), 0.1 * np.sign(np.sin(2 * np.pi * t / 8.0)) * (t % 2.0 < 1.0))


def _spins(t: Floats) -> Floats:
    return _wheels(np.zeros_like(t), (0.2 + 0.15 * (np.floor(t / 10.0) % 3)) * np.sign(np.sin(2 * np.pi * t / 5.0)))


def _reversals(t: Floats) -> Floats:
    return _wheels(
        (0.2 + 0.2 * (np.floor(t / 12.0) % 3)) * np.sign(np.sin(2 * np.pi * t / 3.0)), 0.05 * np.ones_like(t)
    )


def _full_speed(t: Floats) -> Floats:
    return _wheels(np.where(t % 10.0 < 7.0, 1.0, 0.3), 0.1 * np.sign(np.sin(2 * np.pi * t / 14.0)) * (t % 10.0 >= 7.0))


def _quick_steps(t: Floats) -> Floats:
    forward = 0.4 + 0.3 * np.sign(np.sin(2 * np.pi * t / 0.7))
    return _wheels(forward, 0.2 * np.sign(np.sin(2 * np.pi * t / 1.1)))


def _wheels(forward: Floats, turn: Floats) -> Floats:
    return np.asarray(np.clip(np.stack((forward - turn, forward + turn), axis=-1), -1.0, 1.0))


LIBRARY: tuple[tuple[str, str, Callable[[Floats], Floats]], ...] = (
    ("figure-eight", "figures of eight at a middling speed, six seconds a side", _figure_eight),
    ("arcs", "steady arcs of three radii at four speeds", _arcs),
    (
        "creeping",
        "straight, the command rising and falling slowly through zero, a quarter of full speed at most",
        _creeping,
    ),
    ("stop and go", "a second of driving, a second of rest, bending left and right in turn", _stop_and_go),
    ("spins", "turns on the spot, both ways, at three speeds", _spins),
    ("reversals", "forwards and backwards in turn every second and a half, at three speeds", _reversals),
    ("full speed", "long straights at full command, short slow bends between them", _full_speed),
    ("quick steps", "commands that jump about twice a second", _quick_steps),
)


BEND = 2.0
"""How far a car steers [full lock] where its wheels would differ by half of full speed."""

ROLLING = 0.4
"""Throttle of a car in manoeuvres that turn on the spot, which it cannot."""


def commands_of(shape: Callable[[Floats], Floats], times: Floats, robot: Robot) -> Floats:
    """The commands of a manoeuvre at some times (rows, 2): duties of two wheels, or a car's throttle and steering."""
    duties = shape(times)
    if robot.drive == "differential":
        return duties
    forward = duties.mean(axis=1)
    throttle = np.where(np.any(forward != 0.0), forward, ROLLING)
    return np.stack((throttle, np.clip(BEND * (duties[:, 1] - duties[:, 0]), -1.0, 1.0)), axis=-1)


def next_manoeuvre(found: Findings, *, again: bool = False) -> Manoeuvre | None:
    """Choose the manoeuvre that tells the adopted effect with a rival from that rival best, None where nothing would.

    Args:
        found: What the search came to.
        again: Whether noise is to be told from what is missing too: it is then driven REPEATS times.
    """
    best = _best_offer(found)
    if best is None and again:
        name, text, shape = LIBRARY[0]
        duties = _duties_of(shape, found.model.drives)
        return Manoeuvre(name, text, ("noise", "what is missing"), None, duties, REPEATS)
    return replace(best, times=REPEATS) if best and again else best


def _best_offer(found: Findings) -> Manoeuvre | None:
    pairs = [(effect, rival) for effect in found.adopted for rival in effect.rivals]
    if not pairs:
        return None
    offers = [(_nats_apart(found.model, shape, *pairs[0]), name, text, shape) for name, text, shape in LIBRARY]
    clear, name, text, shape = max(offers, key=lambda offer: offer[0])
    if clear <= found.model.drives.rules.rival_nats:
        return None
    between = (pairs[0][0].effect, pairs[0][1].effect)
    return Manoeuvre(name, text, between, clear, _duties_of(shape, found.model.drives))


def _duties_of(shape: Callable[[Floats], Floats], drives: Drives) -> Floats:
    return commands_of(shape, np.arange(round(SECONDS * drives.rate_hz)) / drives.rate_hz, drives.robot)


def _nats_apart(model: Fit, shape: Callable[[Floats], Floats], effect: AdoptedEffect, rival: Candidate) -> float:
    """Evidence of a minute of a manoeuvre for an effect against its rival [nats]."""
    plain = {key: value for key, value in model.theta.items() if key not in effect.names}
    free = tuple(coordinate for coordinate in model.free if coordinate not in effect.free)
    driven = evaluate(imagine_drive(model.drives, _duties_of(shape, model.drives)), plain, free, model.noise)
    size = np.array([model.theta[coordinate[0]] for coordinate in effect.free])
    own = Candidate(effect.effect, effect.form, effect.free, {n: model.theta[n] for n in effect.names}, (), ())
    one, other = trace_of(driven, own, tuple(size)), trace_of(driven, rival, rival.probes[len(rival.probes) // 2])
    alike = other * (one @ other) / max(other @ other, 1e-12)
    return 0.5 * float(((one - alike) ** 2).sum()) * 60.0 / SECONDS


def imagine_drive(drives: Drives, duties: Floats) -> Drives:
    """Make up a drive that was never driven: one episode of duties (rows, 2), a pose at every row."""
    ticks = round(drives.tick_hz / drives.rate_hz)
    rows = len(duties)
    first = np.arange(rows - 1) * ticks
    speed = np.abs(duties).mean(axis=1)[:-1] * drives.robot.figures["full_speed"] / drives.rate_hz
    return replace(
        drives,
        duties=np.repeat(duties, ticks, axis=0)[None],
        issued=(np.arange(rows * ticks) % ticks == 0)[None],
        rest=np.zeros((1, 2)),
        headings=np.zeros((1, rows * ticks)),
        episode=np.zeros(rows - 1, dtype=int),
        first=first,
        last=first + ticks,
        poses=np.zeros((rows - 1, 2, 3)),
        linked=first > 0,
        block=np.zeros(rows - 1, dtype=int),
        travel=np.stack((speed, np.zeros_like(speed)), axis=1),
        wheels=None,
    )
