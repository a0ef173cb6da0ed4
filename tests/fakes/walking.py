"""A domain family that keeps places and commands, and has no camera: a robot of another simulator."""

from dataclasses import dataclass, fields
from pathlib import Path

import numpy as np
from wobbly import Wobbly, wobbly

from proxytune.domain import Episode, Recording
from proxytune.settings import Section


@dataclass(frozen=True)
class Walking(Wobbly):
    """Walks straight on for two seconds, the faster the more trim, and turns its head."""

    columns: str = "x y"

    def record(self, episode: Episode) -> Recording:
        time = np.arange(21) / 10.0
        speed = 0.2 + {**dict(self.theta), **dict(episode.theta)}.get("trim", 0.0)
        ways = {"x": speed * time, "y": 0.1 * np.sin(time), "short": time[:3], "z": time}
        poses = {"time": time, **{name: ways[name] for name in self.columns.split()}}
        return Recording(self.run(episode), poses, {"time": time[:-1], "head": np.cos(time[:-1])})


def walking(section: Section, *, model: Path | None) -> Walking:
    """The family that a [domain] table describes; it may name the columns that are kept."""
    kept = {name: value for name, value in section.values.items() if name != "columns"}
    base = wobbly(Section(section.path, "domain.", kept), model=model)
    return Walking(
        **{one.name: getattr(base, one.name) for one in fields(base)}, columns=section.text("columns", "x y")
    )
