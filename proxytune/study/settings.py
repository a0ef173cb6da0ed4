"""What study.toml says, read strictly."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from proxytune.errors import InputError
from proxytune.learning.settings import TeachingSettings, read_teaching
from proxytune.scores import Metric
from proxytune.search.engines.registry import DEFAULT_ENGINE, SCORE_ENGINE
from proxytune.settings import Section, nearest, read_settings
from proxytune.space import Interval, Space
from proxytune.storage.own_files import FAMILIES
from proxytune.study.families.reading import family_tables, study_around
from proxytune.study.sides import agents_of, aliases_of, metrics_of, targets_of, texts_of
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
    FAMILIES,
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
        families: The same study of each of several domain families, by their names; empty of a study of one.
        family_name: Which of several it is of; empty if there is but one.
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
    families: Mapping[str, "StudySettings"] = field(default_factory=dict)
    family_name: str = ""

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
        """The folder of study.toml, where the user's modules lie."""
        return self.path.parent

    @property
    def home(self) -> Path:
        """The folder of what running it makes: of one of several families a folder of its own."""
        return self.folder / FAMILIES / self.family_name if self.family_name else self.folder

    def error(self, key: str, problem: str) -> InputError:
        """The one-line complaint about a key that only the domain family could check."""
        where = f"{FAMILIES}.{self.family_name}: " if self.family_name else ""
        return Section(self.path, where, {}).error(key, problem)

    def check_single(self) -> None:
        """Refuse a study of several families where one is needed.

        Raises:
            SettingsError: That says how to name one of them.
        """
        if self.families:
            one = self.home / FAMILIES / next(iter(self.families))
            raise self.error(FAMILIES, f"each of these is a study of its own, and one is needed; give one, as {one}")


def read_study_settings(path: Path) -> StudySettings:
    """Read a study.toml, given as the file or as its folder; of a folder families/NAME, as that family has it.

    Raises:
        SettingsError: With file, key and remedy.
    """
    around = study_around(path, FILE_NAME)
    if around is not None:
        study, name = read_study_settings(around), path.absolute().name
        if name not in study.families:
            raise study.error(FAMILIES, f"has no '{name}', as {path} is called; {nearest(name, study.families)}")
        return study.families[name]
    read = read_settings(path / FILE_NAME if path.is_dir() else path)
    study = _settings(read)
    tables = family_tables(read, study.family, study.name)
    if tables:
        _check_comparable(study)
    return replace(study, families={name: replace(_settings(one), family_name=name) for name, one in tables.items()})


def _check_comparable(study: StudySettings) -> None:
    """Refuse a study whose families could not be compared."""
    if study.objective == LEARNING:
        raise study.error("objective", f"'{LEARNING}' is not for {FAMILIES}: they are tuned by scores, and teach after")
    if study.stop.wall_time_s is None:
        raise study.error("stop.wall_time_s", f"is missing; it is the time that each of {FAMILIES} is tuned in [s]")
    if not study.confirm:
        raise study.error("confirm", f"is 0, and {FAMILIES} are compared by fresh episodes; make it 1 or more")


def _settings(read: Section) -> StudySettings:
    path = read.path
    read.only(KEYS)
    if read.whole("format", low=1) > FORMAT:
        raise read.error("format", f"this proxytune reads up to {FORMAT}; install a newer one")
    targets = tuple(read.file("target", name) for name in targets_of(read))
    return StudySettings(
        path=path,
        name=read.text("name", path.absolute().parent.name),
        family=read.text("family", DEFAULT_FAMILY),
        proxy=read.file("proxy") if "proxy" in read.values else None,
        target=targets[0],
        truth=read.file("truth") if "truth" in read.values else None,
        objective=read.text("objective", "prpv"),
        metrics=metrics_of(read),
        agents=agents_of(read),
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
        aliases=aliases_of(read),
        more_targets=targets[1:],
        target_columns=texts_of(read.section("target_columns")),
        episode_timeout_s=positive(read, "episode_timeout_s"),
    )


def _default_engine(read: Section) -> str:
    """Of learning value nothing is known but the score."""
    return SCORE_ENGINE if read.text("objective", "prpv") == LEARNING else DEFAULT_ENGINE


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
