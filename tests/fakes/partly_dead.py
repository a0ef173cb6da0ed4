"""A domain family with one parameter that matters, one that moves no more than noise does, and a dead one."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from proxytune.domain import Episode
from proxytune.settings import Section
from proxytune.space import Parameter

NAMES = {"matters": -1.0, "noise_sized": 0.0, "dead": 0.0}


@dataclass(frozen=True)
class PartlyDead:
    """Agents of different strength; `noise_sized` reshuffles each episode as another seed would."""

    identity: str = "planted 1"

    @property
    def metrics(self) -> Mapping[str, str]:
        return {"distance": "m", "survival_time": "s"}

    @property
    def parameters(self) -> Mapping[str, Parameter]:
        return {name: Parameter(name=name, unit="", low=low, high=1.0, neutral=0.0) for name, low in NAMES.items()}

    @property
    def starts(self) -> int:
        return 5

    def check_agent(self, name: str) -> None:
        """Any will do."""

    def run(self, episode: Episode) -> Mapping[str, float]:
        theta = dict(episode.theta)
        number = int(episode.agent.removeprefix("agent"))
        shuffled = round(1000 * theta.get("noise_sized", 0.0))
        draw = np.random.default_rng([episode.seed, episode.start, number, shuffled]).normal(0.0, 0.3, 2)
        good = number * (1.0 - theta.get("matters", 0.0) ** 2)
        moved = 2.0 * abs(theta.get("matters", 0.0))
        return {"distance": float(good - moved + draw[0]), "survival_time": float(10.0 - number + draw[1])}


@dataclass(frozen=True)
class Ordered(PartlyDead):
    """Agents that the target ranks by number, and this family less and less so away from the middle of the box."""

    identity: str = "ordered 1"

    @property
    def parameters(self) -> Mapping[str, Parameter]:
        return {name: Parameter(name=name, unit="", low=0.0, high=1.0, neutral=0.5) for name in ("first", "second")}

    def run(self, episode: Episode) -> Mapping[str, float]:
        theta = dict(episode.theta)
        number = int(episode.agent.removeprefix("agent"))
        turned = 3.0 * np.hypot(theta["first"] - 0.4, theta["second"] - 0.55)
        good = number * np.cos(turned) + 3.0 * np.sin(turned) * np.sin(7.0 * number)
        draw = np.random.default_rng([episode.seed, episode.start, number]).normal(0.0, 0.5, 2)
        return {"distance": float(good + draw[0]), "survival_time": float(2.0 * good + draw[1])}


class OrderedFleet(Ordered):
    """Ordered, several episodes at once."""

    def run_many(self, episodes: Sequence[Episode]) -> list[Mapping[str, float]]:
        return [self.run(episode) for episode in episodes]


def made(kind: type[PartlyDead]) -> Callable[..., PartlyDead]:
    """The factory of such a family."""

    def make(section: Section, *, model: Path | None) -> PartlyDead:
        section.only(())
        return kind()

    return make


partly_dead, ordered, ordered_fleet = map(made, (PartlyDead, Ordered, OrderedFleet))


def ordered_study(make, called="cutting", **changes):
    """A study of eight agents whose order gets lost away from the best θ; `make` is make_study."""
    folder = make(
        called,
        parameters={"first": "[0, 1]", "second": "[0, 1]"},
        **{
            "family": '"partly_dead:ordered"',
            "agents": "[" + ", ".join(f'"agent{number}"' for number in range(8)) + "]",
            "budget": "14",
            "cut_off": "true",
            **changes,
        },
    )
    (folder / "target.csv").write_text(ORDERED)
    return folder


ORDERED = "agent,episode,distance,survival_time\n" + "".join(
    f"agent{number},{start},{number + 0.1 * start},{2 * number}\n" for number in range(8) for start in range(3)
)
"""The target of the ordered family."""
