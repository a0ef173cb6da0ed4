"""What study.toml says, read strictly."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from proxytune.errors import InputError
from proxytune.learning.settings import TeachingSettings, read_teaching
from proxytune.scores import Metric
from proxytune.search.engines.registry import DEFAULT_ENGINE, SCORE_ENGINE
from proxytune.settings import Section, read_settings
from proxytune.space import Interval, Space
from proxytune.study.stop_rules import StopRules, positive, read_stop_rules

DEFAULT_FAMILY = "proxytune.driving.family:lane_following"
FILE_NAME = "study.toml"
FORMAT = 1
LEARNING = "plv"
"""The objective that is not a measure of scores but of learning."""
KEYS = (
    "format", "name", "family", "proxy", "target", "target_columns", "truth", "objective", "metrics", "agents",
    "starts", "budget", "initial", "batch", "engine", "seed", "jobs", "on_failure", "preflight", "confirm",
    "cut_off", "stop", "parameters", "domain", "teaching", "held_out", "episode_timeout_s",
)  # fmt: skip


@dataclass(frozen=True)
class StudySettings:
    """A study.toml.

    Attributes:
        path: The file.
        name: What the study is called.
        family: Where the domain family comes from, as "module:factory".
        proxy: A model.toml whose effects the proxy has, if any.
        target: The score table of the target; of several files the first.
        truth: A model.toml of what made the target, where that is known.
        objective: The measure that is made small or large: "prpv", "ppv", "plv", or one's own.
        metrics: How agents are compared.
        agents: Names of the agents, at least two, as tables and figures have them.
        starts: How many of the family's starting conditions, the first ones, each agent drives from.
        budget: How many trials.
        initial: How many of them come from the quasi-random design.
        batch: How many trials are proposed together, and their episodes run together.
        engine: Name of what proposes the others.
        seed: Seed of the episodes and of the search.
        jobs: How many processes run episodes.
        stop_on_failure: Whether a failing episode stops the study.
        preflight: Whether each parameter is first shown to matter.
        confirm: How often the best θ are driven again in fresh episodes when the search has ended.
        cut_off: Whether a trial ends once it cannot be among the best any more.
        stop: When it ends before its budget is spent.
        space: The search box, its parameters sorted by name.
        domain: The table that the family's factory reads.
        teaching: How a proxy's worth as a teacher is measured, if it is.
        aliases: What is loaded for an agent whose name in tables is another.
        more_targets: The other files of the target's score table.
        target_columns: What columns are called in the target's files where that is another name.
        episode_timeout_s: How long an episode may take before it counts as failed [s], if that is limited.
    """

    path: Path
    name: str
    family: str
    proxy: Path | None
    target: Path
    truth: Path | None
    objective: str
    metrics: tuple[Metric, ...]
    agents: tuple[str, ...]
    starts: int
    budget: int
    initial: int
    batch: int
    engine: str
    seed: int
    jobs: int
    stop_on_failure: bool
    preflight: bool
    confirm: int
    cut_off: bool
    stop: StopRules
    space: Space
    domain: Section
    teaching: TeachingSettings | None = None
    aliases: Mapping[str, str] = field(default_factory=dict)
    more_targets: tuple[Path, ...] = ()
    target_columns: Mapping[str, str] = field(default_factory=dict)
    episode_timeout_s: float | None = None

    @property
    def targets(self) -> tuple[Path, ...]:
        """The files that hold the target's scores."""
        return (self.target, *self.more_targets)

    @property
    def loaded_agents(self) -> tuple[str, ...]:
        """What is loaded for each agent."""
        return tuple(self.aliases.get(agent, agent) for agent in self.agents)

    @property
    def folder(self) -> Path:
        """The folder of the study."""
        return self.path.parent

    def error(self, key: str, problem: str) -> InputError:
        """The one-line complaint about a key that only the domain family could check."""
        return Section(self.path, "", {}).error(key, problem)


def read_study_settings(path: Path) -> StudySettings:
    """Read a study.toml, given as the file or as its folder.

    Raises:
        SettingsError: With file, key and remedy.
    """
    path = path / FILE_NAME if path.is_dir() else path
    read = read_settings(path)
    read.only(KEYS)
    if read.whole("format", low=1) > FORMAT:
        raise read.error("format", f"this proxytune reads up to {FORMAT}; install a newer one")
    return StudySettings(
        path=path,
        name=read.text("name", path.absolute().parent.name),
        family=read.text("family", DEFAULT_FAMILY),
        proxy=path.parent / read.text("proxy") if "proxy" in read.values else None,
        target=path.parent / _targets(read)[0],
        truth=path.parent / read.text("truth") if "truth" in read.values else None,
        objective=read.text("objective", "prpv"),
        metrics=_metrics(read),
        agents=_agents(read),
        starts=read.whole("starts", low=1),
        budget=read.whole("budget", low=1, high=100_000),
        initial=read.whole("initial", 8, low=1, high=100_000),
        batch=read.whole("batch", 1, low=1, high=100_000),
        engine=read.text("engine", _default_engine(read)),
        seed=read.whole("seed", 1),
        jobs=read.whole("jobs", 1, low=1, high=1024),
        stop_on_failure=read.text("on_failure", "continue", choices=("continue", "stop")) == "stop",
        preflight=read.flag("preflight", True),
        confirm=read.whole("confirm", 1, high=1000),
        cut_off=read.flag("cut_off", True),
        stop=read_stop_rules(read.section("stop")),
        space=_space(read.section("parameters")),
        domain=read.section("domain"),
        teaching=read_teaching(read.section("teaching")),
        aliases=_aliases(read),
        more_targets=tuple(path.parent / name for name in _targets(read)[1:]),
        target_columns=_texts(read.section("target_columns")),
        episode_timeout_s=positive(read, "episode_timeout_s"),
    )


def _default_engine(read: Section) -> str:
    """Of learning value nothing is known but the score."""
    return SCORE_ENGINE if read.text("objective", "prpv") == LEARNING else DEFAULT_ENGINE


def _metrics(read: Section) -> tuple[Metric, ...]:
    try:
        metrics = tuple(Metric.parse(text) for text in read.texts("metrics"))
    except InputError as problem:
        raise read.error("metrics", str(problem)) from None
    names = [metric.name for metric in metrics]
    if not names:
        raise read.error("metrics", 'is empty; give at least one, as in ["distance:max"]')
    if len(set(names)) < len(names):
        raise read.error("metrics", f"names a metric twice: {', '.join(names)}")
    return metrics


def _agents(read: Section) -> tuple[str, ...]:
    agents = tuple(_aliases(read)) or read.texts("agents")
    if len(agents) < 2:
        raise read.error("agents", f"comparing takes at least two agents, got {len(agents)}")
    return agents


def _targets(read: Section) -> tuple[str, ...]:
    """The file of the target's scores, or several."""
    if not isinstance(read.values.get("target"), list):
        return (read.text("target"),)
    return read.texts("target") or (read.text("target"),)


def _aliases(read: Section) -> dict[str, str]:
    """The table [agents], where it is one: name in tables to what is loaded."""
    return _texts(read.section("agents")) if isinstance(read.values.get("agents"), dict) else {}


def _texts(table: Section) -> dict[str, str]:
    return {name: table.text(name) for name in table.values}


def _space(parameters: Section) -> Space:
    if not parameters.values:
        raise Section(parameters.path, "", {}).error("parameters", "is missing; write NAME = [low, high] in it")
    return Space(tuple(Interval(name, *parameters.bounds(name)) for name in sorted(parameters.values)))


def as_document(settings: StudySettings) -> Mapping[str, Any]:
    """The settings as plain texts and numbers, for reports."""
    return {
        "path": str(settings.path),
        "family": settings.family,
        "proxy": str(settings.proxy) if settings.proxy else None,
        "objective": settings.objective,
        "metrics": [str(metric) for metric in settings.metrics],
        "agents": list(settings.agents),
        "aliases": dict(settings.aliases),
        "starts": settings.starts,
        "budget": settings.budget,
        "initial": settings.initial,
        "batch": settings.batch,
        "engine": settings.engine,
        "seed": settings.seed,
        "jobs": settings.jobs,
        "episode_timeout_s": settings.episode_timeout_s,
        "on_failure": "stop" if settings.stop_on_failure else "continue",
        "preflight": settings.preflight,
        "confirm": settings.confirm,
        "cut_off": settings.cut_off,
        "stop": {key: value for key, value in vars(settings.stop).items() if value is not None},
        "parameters": {i.name: [i.low, i.high] for i in settings.space.intervals},
    }
