"""A domain family that is a formula: fast, seeded, picklable, and as faulty as a test asks for."""

import atexit
import ctypes
import os
import signal
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType

import numpy as np

from proxytune.domain import Episode
from proxytune.errors import EpisodeError, SettingsError
from proxytune.settings import Section, nearest, read_settings
from proxytune.space import Parameter

AGENTS = tuple(f"agent{number}" for number in range(6))
PARAMETERS = MappingProxyType(
    {
        "trim": Parameter(name="trim", unit="", low=-0.3, high=0.3, neutral=0.0),
        "delay": Parameter(name="delay", unit="s", low=0.0, high=0.3, neutral=0.0),
    }
)


def leave_later() -> None:
    """End with status 0 when Python ends, which is soon."""
    atexit.register(os._exit, 0)
    os.kill(os.getpid(), signal.SIGTERM)


ENDINGS: Mapping[str, Callable[[], object]] = {
    "dies": lambda: os._exit(9),
    "leaves": lambda: os._exit(0),
    "leaves in C": lambda: ctypes.CDLL(None).exit(0),
    "leaves later": leave_later,
    "prints": lambda: print("something", flush=True),
}
"""Faults that end the process, or say something."""


@dataclass(frozen=True)
class Wobbly:
    """Agents that like different values of trim and delay, and do worse the further off they are."""

    theta: tuple[tuple[str, float], ...] = ()  # the values of an instance where the episode does not name them
    sleep: float = 0.0  # seconds an episode takes
    faults: tuple[str, ...] = ()  # what goes wrong, as "agent:start:fault"; a start of * means every one
    journal: str = ""  # a file to which each simulated episode adds a line; empty for none
    version: str = "1"  # stands for the code's version
    nominal = MappingProxyType({})  # none: what tests count is trials

    @property
    def identity(self) -> str:
        return f"wobbly {self.version} {self.theta}"

    @property
    def metrics(self) -> Mapping[str, str]:
        return {"distance": "m", "survival_time": "s"}

    @property
    def parameters(self) -> Mapping[str, Parameter]:
        return PARAMETERS

    @property
    def starts(self) -> int:
        return 5

    def check_agent(self, name: str) -> None:
        if name not in AGENTS:
            raise SettingsError(f"no agent '{name}'; {nearest(name, AGENTS)}")

    def run(self, episode: Episode) -> Mapping[str, float]:
        if self.journal:
            with open(self.journal, "a") as journal:
                journal.write(f"{episode.agent} {episode.start} {episode.theta} {os.getpid()}\n")
        fault = next((f.split(":")[2] for f in self.faults if self._hits(f, episode)), "")
        seconds = self.sleep + 0.3 * (fault == "lingers")
        if seconds:  # a sleep of none gives the processor away
            time.sleep(seconds)
        if fault == "raises":
            raise EpisodeError(f"agent '{episode.agent}' raised ValueError at 1.20 s: it lost its way")
        if fault == "crashes":
            raise ZeroDivisionError("division\nby zero")
        ENDINGS.get(fault, int)()
        if fault == "full":
            raise OSError(28, "No space left on device")
        scores = formula({**dict(self.theta), **dict(episode.theta)}, episode)
        return {**scores, "distance": float("nan")} if fault == "nan" else scores

    @staticmethod
    def _hits(fault: str, episode: Episode) -> bool:
        agent, start, _ = fault.split(":")
        return agent == episode.agent and start in ("*", str(episode.start))


def formula(theta: Mapping[str, float], episode: Episode) -> dict[str, float]:
    """Distance and survival time, wobbling with the seed."""
    number = AGENTS.index(episode.agent)
    trim, delay = theta.get("trim", 0.0) / 0.3, theta.get("delay", 0.0) / 0.3
    wobble = np.random.default_rng([episode.seed, episode.start]).normal(0.0, 0.15, 2)
    far = abs(trim - np.sin(3.0 * number)) + abs(delay - (0.5 + 0.5 * np.cos(5.0 * number)))
    near = abs(trim + np.cos(2.0 * number)) + 0.3 * delay
    return {"distance": float(5.0 - far + wobble[0]), "survival_time": float(60.0 - 10.0 * near + wobble[1])}


def wobbly(section: Section, *, model: Path | None) -> Wobbly:
    """The family that a [domain] table describes; a model is a TOML file of θ values."""
    section.only(("sleep", "faults", "journal", "version"))
    held = read_settings(model).values if model else {}
    return Wobbly(
        tuple(sorted((name, float(value)) for name, value in held.items())),
        section.number("sleep", 0.0, low=0.0),
        section.texts("faults", ()),
        section.text("journal", ""),
        section.text("version", "1"),
    )


def broken_factory(section: Section, *, model: Path | None) -> Wobbly:
    """A factory with a bug."""
    raise KeyError("robot")


def not_a_family(section: Section, *, model: Path | None) -> dict[str, str]:
    """A factory of something else."""
    return {}


def domain_alone(section: Section) -> Wobbly:
    """A factory that a study cannot call: it knows of no model."""
    return wobbly(section, model=None)


def nothing_at_all() -> Wobbly:
    """A factory that takes nothing."""
    return Wobbly()
