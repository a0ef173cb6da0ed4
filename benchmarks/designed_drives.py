"""How much sooner a designed drive tells rivals apart than a manoeuvre of the library, and than lane following.

    python benchmarks/designed_drives.py [SEEDS [ROOM]]

A hidden robot of `hidden_cases.py`, which shares no code with proxytune, has a small effect. The first log is a minute
of lane following in twelve drives, to which the model with that effect is fitted; from it the next drive is designed.
Then the same robot drives a minute each of: lane following again; the manoeuvre that was picked before drives were
designed, the one of the library that parts the rivals best in the model, whatever floor it takes; the same among those
that keep to the room; and the designed drive, 20 s three times. Both models are fitted to each such minute, and the
difference of their log-likelihoods is the evidence for the effect that is there. `s to 15 nats` is how long one has to
drive for the evidence to be above 3 nats 98 times in 100, had every second its share of the mean over the seeds.
"""

import sys
import time
from itertools import islice
from pathlib import Path
from typing import NamedTuple

import numpy as np
from hidden_cases import LEVELS, RATE_HZ, Case, Drives, measured, true_poses

from proxytune.api.logs import recordable
from proxytune.diagnosis import AdoptedEffect, Findings, Limits, film
from proxytune.diagnosis.motion.clocks import cut_into_blocks
from proxytune.diagnosis.motion.drives import gather
from proxytune.diagnosis.motion.excitation import CLEAR_NATS, Rivals, course_of, design_drive
from proxytune.diagnosis.motion.fitting import Fit, fit
from proxytune.diagnosis.motion.innovations import huber, theta_at
from proxytune.diagnosis.motion.screening import Candidate, candidates
from proxytune.driving import read_robot
from proxytune.logs import Log, LogEpisode
from proxytune.study import read_study_settings

ROBOT = read_robot("duckiebot")
DECLARED = (("trim",), ("delay",))
START = {"trim": 0.0, "delay": 0.15}


class Question(NamedTuple):
    """What is hidden, and as what it could pass."""

    effect: str  # the catalogue's name of it
    rival: str  # that of the other; "" for what is declared alone
    hidden: tuple[str, dict[str, float]]  # the name and figures that `hidden_cases.py` has for it
    probe: tuple[float, ...]  # where the fit of the effect begins


QUESTIONS = (
    Question("dead_band", "stiction", ("dead_band", {"width": 0.03}), (0.04,)),
    Question("stiction", "dead_band", ("stiction", {"breakaway": 0.08, "release": 0.6}), (0.06, 0.35)),
    Question("lateral_slip", "marker_offset", ("lateral_slip", {"gain": 0.01}), (0.03,)),
    Question("motor_lag", "", ("motor_lag", {"time_constant": 0.22}), (0.24,)),
    Question("turn_slip", "yaw_scrub", ("turn_slip", {"gain": 0.02}), (0.05,)),
    Question("saturation", "driver_map", ("saturation", {"limit": 0.9}), (0.9,)),
)
"""Effects that are small: large ones are told by any drive."""


def form_of(effect: str) -> Candidate:
    """The plain form of an effect; of no effect one that changes nothing."""
    forms = {one.effect: one for one in candidates(ROBOT, START, ()) if not one.form}
    return forms[effect] if effect else Candidate("delay", "", (), {}, (), ())


def driven(question: Question, duties: np.ndarray, seed: int, noise: int) -> Log:
    """The log of a hidden robot for these duties (episodes, rows, 2); the noise is another each time."""
    random = np.random.default_rng([seed, 7])
    case = Case("hidden", (question.hidden,), "normal", 100 * seed + noise, float(random.normal(0.0, 0.03)), 0.12)
    starts = np.zeros((len(duties), 3))
    level = LEVELS["normal"]
    poses = measured(true_poses(case, Drives(duties, starts), level), case, level)
    times = np.arange(duties.shape[1]) / RATE_HZ
    episodes = (LogEpisode(f"{e}", times, duties[e], poses[e], None) for e in range(len(duties)))
    return Log("hidden", "duckiebot", "duty", float(RATE_HZ), {}, tuple(episodes))


def lane_commands(seconds: float, drives: int, seed: int) -> np.ndarray:
    """Duties (drives, rows, 2) with which the shipped expert keeps a Duckiebot in its lane."""
    study = Path(__file__).parent.parent / "studies" / "closing_the_loop"
    family = recordable(read_study_settings(study), study / "tuned.toml")
    rows = round(seconds * RATE_HZ)
    every = (one.episode.commands[:rows] for one in film(family, round(40 * seconds), seed))
    return np.stack(list(islice((commands for commands in every if len(commands) == rows), drives)))


def fits(question: Question, log: Log) -> tuple[Fit, Fit]:
    """The model with the effect, and the one with its rival, fitted to a log in full from the best of their probes."""
    drives = cut_into_blocks(gather(log, ROBOT, log.episodes))
    found = []
    for name, probes in ((question.effect, (question.probe,)), (question.rival, None)):
        form = form_of(name)
        theta, free = {**START, **form.fixed}, (*DECLARED, *form.free)
        starts = [theta_at(theta, form.free, np.array(probe)) for probe in probes or form.probes or ((),)]
        tried = [fit(drives, start, free) for start in starts]
        found.append(max(tried, key=lambda one: log_likelihood(one)))
    return found[0], found[1]


def log_likelihood(fitted: Fit) -> float:
    """Of the fitted innovations [nats]."""
    return -float(huber(fitted.innovations).sum() + fitted.whiten.log_determinant.sum())


def evidence(question: Question, log: Log) -> float:
    """For the effect, against its rival, a minute [nats]."""
    right, wrong = fits(question, log)
    seconds = sum(len(episode.times) for episode in log.episodes) / RATE_HZ
    return (log_likelihood(right) - log_likelihood(wrong)) * 60.0 / seconds


def picked(found: Findings, limits: Limits) -> np.ndarray | None:
    """The manoeuvre of the library that parts the rivals best within limits (rows, 2), or None."""
    course = course_of(found.model.drives, limits)
    library = course.library
    batch = course.imagine(library, found.model.theta)
    worth = Rivals(course, found.model, found.adopted[0]).worth(library)
    fitting = course.beyond(batch, found.model.noise.drive[2]) <= 0.0
    return library[int(np.argmax(np.where(fitting, worth, -1.0)))] if fitting.any() else None


WAYS = ("lane following", "manoeuvre, any floor", "manoeuvre in the room", "designed in the room")


def compare(
    question: Question, seed: int, room: tuple[float, float], lanes: np.ndarray
) -> tuple[list[float | None], str]:
    """Evidence a minute of each way to drive [nats], and what the design was."""
    first, _ = fits(question, driven(question, lanes, seed, 0))
    form = form_of(question.effect)
    names = tuple(name for coordinate in form.free for name in coordinate) + tuple(form.fixed)
    effect = AdoptedEffect(question.effect, "", names, form.free, 0.0, 0.01, (form_of(question.rival),))
    found = Findings(first, first, (effect,), (), (), ())
    began = time.process_time()
    drive = design_drive(found, limits=Limits(room), seed=seed)
    spent = time.process_time() - began
    within = picked(found, Limits(room, seconds=60.0))
    within = picked(found, Limits(room)) if within is None else within
    driven_of = [
        lanes,
        picked(found, Limits((1000.0, 1000.0), seconds=60.0)),
        within,
        drive and np.repeat(drive.commands[None], 3, axis=0),
    ]
    nats = []
    for number, duties in enumerate(driven_of):
        if duties is None:
            nats.append(None)
            continue
        each = duties if duties.ndim == 3 else duties[None]
        each = each if each.shape[1] * len(each) >= 1200 else np.repeat(each, 3, axis=0)
        nats.append(evidence(question, driven(question, each, seed, 1 + number)))
    told = f"{drive.name}, {drive.nats_per_minute:.0f} nats a minute expected, {spent:.1f} s" if drive else "no drive"
    return nats, told


def main() -> None:
    """Print a line for each question and seed, then the table."""
    seeds = int(sys.argv[1]) if len(sys.argv) > 1 else 5
    room = tuple(float(side) for side in (sys.argv[2] if len(sys.argv) > 2 else "4x3").split("x"))
    lanes = lane_commands(5.0, 12, 1)
    rows = []
    for question in QUESTIONS:
        every = []
        for seed in range(1, seeds + 1):
            nats, told = compare(question, seed, room, lanes)
            every.append(nats)
            shown = " ".join("–" if one is None else f"{one:.1f}" for one in nats)
            print(f"{question.effect} or {question.rival or 'delay'}, seed {seed}: {shown} ({told})", file=sys.stderr)
        rows.append((question, every))
    head = f"{'effect or rival':<28}" + "".join(f"{way:>32}" for way in WAYS)
    print(f"room {room[0]:g} x {room[1]:g} m, {seeds} seeds: mean nats a minute (least), seconds to 15 nats")
    print(head)
    for question, every in rows:
        cells = []
        for column in range(len(WAYS)):
            values = [one[column] for one in every if one[column] is not None]
            mean = float(np.mean(values)) if values else 0.0
            length = f"{60.0 * CLEAR_NATS / mean:.0f} s" if mean > 0.5 else "never"
            least = f" ({min(values):.0f})" if values else ""
            cells.append(f"{mean:.0f}{least}, {length}")
        print(f"{question.effect + ' or ' + (question.rival or 'delay'):<28}" + "".join(f"{one:>32}" for one in cells))


if __name__ == "__main__":
    if "--help" in sys.argv:
        print(__doc__)
        sys.exit()
    main()
