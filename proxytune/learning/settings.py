"""The settings of the [teaching] table of a study.toml, read strictly: every complaint has file, key and a remedy."""

import itertools
import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from proxytune.arrays import Floats
from proxytune.learning.lessons import Costs, Distribution, cost_saved, read_costs, split_samples
from proxytune.learning.plv import FIRST_COUNTS, FIRST_REPETITIONS, NONE, Published, read_published
from proxytune.settings import Section

DEFAULT_LEARNER = "proxytune.learning.cloning:BehaviourCloning"
KEYS = (
    "target", "learner", "proxy_samples", "target_samples", "seeds", "lesson_s",
    "level", "tolerance", "examinations", "budget", "narrow", "width", "proxies", "published", "published_in",
    "rehearsal", "proxy_lessons", "target_lessons", "costs",
)  # fmt: skip
EXPERT, LEARNER = "expert", "learner"
"""Who drives in lessons. Where a learner drives the expert tells what it would do."""
LATER = ("rehearsal", "proxy_lessons", "target_lessons")
"""Keys of what is taught that came later: facts name them only where they are set, so that what was kept stays."""
MOST_REHEARSAL = 0.99
"""Beyond it hardly anything of the target would be learnt."""


@dataclass(frozen=True)
class TeachingSettings:
    """The way in which a proxy's worth as a teacher is measured."""

    target: Path  # the target's model.toml, in which the learners are fine-tuned and examined
    learner: str  # who learns, as "module:attribute"
    proxy_samples: int  # samples that a proxy teaches
    target_samples: tuple[int, ...]  # the grid of numbers of target samples, rising from 0
    seeds: int  # how many times the whole is repeated; the most there may be of it where examinations are chosen
    lesson_s: float  # how long the expert drives from one start [s]
    level: float | None  # the score that counts as converged; None for what a learner without a proxy converges to
    tolerance: float  # how far below it still counts
    budget: int  # how many proxies a study of the objective "plv" tries
    narrow: bool  # whether such a study first finds by PRPV the θ that cannot be told from the best, and searches there
    # bounds of the widths of p(θ) that such a study searches, by parameter; without one, θ is fixed
    widths: Mapping[str, tuple[float, float]]
    proxies: Mapping[str, Distribution]  # what `teach` compares, by name: p(θ) of each
    # what others published of proxies of these names, or of learning without one
    published: Mapping[str, Published] = field(default_factory=dict)
    published_in: str = ""  # where, and what was different there
    # how many a learning curve takes, on average over all curves, where those that tell most are chosen; None
    # where every number of the grid is examined in every repetition
    examinations: int | None = None
    rehearsal: float = 0.0  # share of the proxy's samples among those of a fine-tuning, from 0 to below 1
    proxy_lessons: str = EXPERT  # who drives in the proxy, once something is learnt: EXPERT or LEARNER
    target_lessons: str = EXPERT  # the same in the target
    costs: Costs = field(default_factory=Costs)  # what a target sample costs

    @property
    def later_keys(self) -> Mapping[str, Any]:
        """The settings that differ from what was taught before there were keys for them, by key."""
        values = {name: getattr(self, name) for name in LATER}
        return {name: value for name, value in values.items() if value != getattr(TeachingSettings, name)}

    def expert_drives(self, *, with_proxy: bool) -> float:
        """Number of target samples from which on the learner drives itself; infinite where it never does."""
        if self.target_lessons == EXPERT:
            return math.inf
        return 0.0 if with_proxy else float(self.target_samples[1])

    def cost_saved(self, *, without: Floats | float, needed: Floats | float) -> Floats:
        """PLV in cost (eq. 6), from the target samples needed without a proxy and with it, of any shape."""
        alone = split_samples(without, self.expert_drives(with_proxy=False))
        helped = split_samples(needed, self.expert_drives(with_proxy=True))
        return cost_saved(self.costs, without=alone, with_proxy=helped)


def read_teaching(section: Section) -> TeachingSettings | None:
    """Read the table, None where there is none; a SettingsError tells file, key and remedy."""
    if not section.values:
        return None
    section.only(KEYS)
    target = section.file("target")
    if not target.is_file():
        raise section.error("target", f"no such file: {target}; give the target's model.toml")
    named = section.section("proxies")
    if NONE in named.values:
        raise named.error(NONE, "is what learning without a proxy is called; choose another name")
    proxies = {name: _distribution(named.section(name)) for name in named.values}
    value = section.values.get("narrow", False)
    if not isinstance(value, bool):
        raise section.error("narrow", f"must be true or false, got {value!r}")
    return TeachingSettings(
        target=target,
        learner=section.text("learner", DEFAULT_LEARNER),
        proxy_samples=section.whole("proxy_samples", 4000, low=1, high=1_000_000),
        target_samples=_grid(section),
        seeds=section.whole("seeds", 5, low=1, high=1000),
        lesson_s=section.number("lesson_s", 5.0, low=0.1, high=3600.0),
        level=section.number("level") if "level" in section.values else None,
        tolerance=section.number("tolerance", 5.0, low=0.0),
        # No fewer than are made before any is chosen
        examinations=section.whole("examinations", low=FIRST_COUNTS * FIRST_REPETITIONS, high=1_000_000)
        if "examinations" in section.values
        else None,
        budget=section.whole("budget", 12, low=1, high=100_000),
        narrow=value,
        widths=_widths(section.section("width")),
        proxies=proxies,
        published=read_published(section.section("published"), proxies),
        published_in=section.text("published_in", ""),
        rehearsal=section.number("rehearsal", 0.0, low=0.0, high=MOST_REHEARSAL),
        proxy_lessons=section.text("proxy_lessons", EXPERT, choices=(EXPERT, LEARNER)),
        target_lessons=section.text("target_lessons", EXPERT, choices=(EXPERT, LEARNER)),
        costs=read_costs(section.section("costs")),
    )


def _grid(section: Section) -> tuple[int, ...]:
    key = "target_samples"
    if key not in section.values:
        raise section.error(key, "is missing; give numbers of target samples, as in [0, 100, 200, 400, 800]")
    counts = section.values[key]
    if not isinstance(counts, list) or not all(type(count) is int and count >= 0 for count in counts):
        raise section.error(key, f"must be a list of whole numbers from 0 on, got {counts!r}")
    if counts[:1] != [0]:
        raise section.error(key, "must begin with 0: the score before any target sample; add it")
    if len(counts) < 2 or any(later <= earlier for earlier, later in itertools.pairwise(counts)):
        raise section.error(key, f"must rise, over two numbers at least, got {counts}")
    return tuple(counts)


def _widths(section: Section) -> Mapping[str, tuple[float, float]]:
    widths = {name: section.bounds(name) for name in section.values}
    for name, (low, _) in widths.items():
        if low < 0.0:
            raise section.error(name, f"a width is at least 0, got {low:g}")
    return widths


def _distribution(section: Section) -> Distribution:
    pairs = {}
    for name, value in section.values.items():
        single = isinstance(value, int | float) and not isinstance(value, bool)
        pairs[name] = (section.number(name),) * 2 if single else section.bounds(name)
    return Distribution(dict(sorted(pairs.items())))
