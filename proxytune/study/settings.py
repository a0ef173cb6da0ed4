"""The settings of a study.toml, read strictly: every complaint has the file, the key and a remedy.

`read_study_settings` gives `StudySettings`. Where there is a table [families], each of them is the same study of
another simulator, with settings of its own. `unnoticed` names files of weights beside a study that its agents may read,
and whose changes nobody notices.
"""

import re
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from proxytune.errors import InputError, SettingsError
from proxytune.identity import files_beside, is_module
from proxytune.learning import TeachingSettings, read_teaching
from proxytune.scores import Metric
from proxytune.search import DEFAULT_ENGINE, SCORE_ENGINE
from proxytune.settings import Section, nearest, read_settings
from proxytune.space import Interval, Space
from proxytune.storage import FAMILIES, MADE as MADE


def metrics_of(read: Section) -> tuple[Metric, ...]:
    """The metrics that agents are compared by."""
    texts = read.texts("metrics")
    try:
        metrics = tuple(map(Metric.parse, texts))
    except InputError as problem:
        raise read.error("metrics", str(problem)) from None
    names = [metric.name for metric in metrics]
    if not names:
        raise read.error("metrics", 'is empty; give at least one, as in ["distance:max"]')
    if len(set(names)) < len(names):
        raise read.error("metrics", f"names a metric twice: {', '.join(names)}")
    return metrics


def targets_of(read: Section) -> tuple[str, ...]:
    """The file of the target's scores, or several; none of a bank."""
    if "target" not in read.values:
        return ()
    if not isinstance(read.values.get("target"), list):
        return (read.text("target"),)
    return read.texts("target") or (read.text("target"),)


def texts_of(table: Section) -> dict[str, str]:
    """The texts of a table, by key."""
    return {name: table.text(name) for name in table.values}


@dataclass(frozen=True)
class StopRules:
    """The rules that end a study before its budget is spent; None where one is not asked for."""

    wall_time_s: float | None = None  # how long its episodes take, all runs together [s]
    # the least that any θ has to be expected to improve the score, in standard deviations of the score's noise
    no_improvement: float | None = None


def positive(table: Section, key: str) -> float | None:
    """A number above 0; None where it is missing."""
    if key not in table.values:
        return None
    value = table.number(key)
    if value <= 0.0:
        raise table.error(key, f"must be above 0, got {value:g}; remove it to have no such rule")
    return value


SUFFIXES = (
    ".ckpt", ".h5", ".joblib", ".keras", ".npy", ".npz", ".onnx", ".pickle", ".pkl", ".pt", ".pth", ".safetensors",
    ".tflite",
)  # fmt: skip
"""Of files with weights."""
NAMED = 3
"""So many files are named at most."""


def unnoticed(folder: Path) -> tuple[str, ...]:
    """One line on files of weights beside a study that has modules of its own; none where there are none."""
    files = files_beside(folder)
    names = [path.relative_to(folder).as_posix() for path in files if path.suffix.lower() in SUFFIXES]
    names = [name for name in names if name.split("/")[0] not in MADE]
    if not names or not any(is_module(path) for path in files):
        return ()
    more = f" and {len(names) - NAMED} more" if len(names) > NAMED else ""
    remedy = "give agents whose weights change another name"
    return (f"{', '.join(names[:NAMED])}{more}: if agents read this, a change in it is not noticed; {remedy}",)


FAMILY_KEYS = ("family", "proxy", "domain", "parameters")
OF_ONE_FAMILY = ("domain", "proxy", "truth")
"""Keys of a study that say nothing to another domain family than its own."""
FEWEST = 2
NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9_-]{0,63}")


def study_around(folder: Path) -> Path | None:
    """The study.toml of which this folder is a family's; None if it is none."""
    home = folder if folder.name and folder.parent.name else folder.absolute()
    around = home.parent.parent / FILE_NAME
    own = (home / FILE_NAME).exists()
    return around if home.parent.name == FAMILIES and not own and around.is_file() else None


def family_tables(read: Section, family: str, name: str) -> dict[str, Section]:
    """The study.toml of each family by name, its table over the study's keys; [domain] is that one family's alone."""
    if FAMILIES not in read.values:
        return {}
    tables = read.section(FAMILIES)
    for one in tables.values:
        if not NAME.fullmatch(one):
            told = "is the name of a folder too; use up to 64 letters, digits, - and _, no other sign"
            raise tables.error(one, told)
    if len(tables.values) < FEWEST:
        told = f"comparing takes at least two families, got {len(tables.values)}"
        raise read.error(FAMILIES, f"{told}; add one, as in [families.planar]")
    lower = [one.lower() for one in tables.values]
    if len(set(lower)) < len(lower):
        raise read.error(FAMILIES, "two names differ in nothing but capitals, as folders' names cannot everywhere")
    return {one: _overlaid(read, tables.section(one), family, f"{name}_{one}") for one in tables.values}


def _overlaid(read: Section, table: Section, family: str, name: str) -> Section:
    table.only(FAMILY_KEYS)
    alike = table.text("family", family) == family
    kept = {key: value for key, value in read.values.items() if alike or key not in OF_ONE_FAMILY}
    own = {key: table.values[key] for key in ("family", "proxy", "parameters") if key in table.values}
    values = {**kept, **own, "domain": {**kept.get("domain", {}), **table.section("domain").values}, "name": name}
    return Section(read.path, f"{table.name.removesuffix('.')}: ", {k: v for k, v in values.items() if k != FAMILIES})


DEFAULT_FAMILY = "proxytune.driving.family:lane_following"
FILE_NAME = "study.toml"
FORMAT = 1
LEARNING = "plv"
"""The objective that is not a measure of scores but of learning."""
WITHOUT_THETA = f"study of '{LEARNING}', which tells its best teacher in report.html and no best θ"
"""What such a study is called by whoever asks it for its best θ."""
KEYS = (
    "format", "name", "family", "proxy", "target", "target_columns", "truth", "learn_from", "low_fidelity", "objective",
    "metrics", "agents", "starts", "budget", "initial", "batch", "engine", "seed", "jobs", "on_failure", "preflight",
    "confirm", "cut_off", "stop", "parameters", "domain", "teaching", "held_out", "episode_timeout_s",
    FAMILIES,
)  # fmt: skip


@dataclass(frozen=True)
class StudySettings:
    """A study.toml."""

    path: Path  # the file
    name: str  # what the study is called
    family: str  # where the domain family comes from, as "module:factory"
    proxy: Path | None  # a model.toml whose effects the proxy has, if any
    truth: Path | None  # a model.toml of what made the target, where that is known
    objective: str  # the measure that is made small or large: "prpv", "ppv", "plv", or one's own
    metrics: tuple[Metric, ...]  # how agents are compared
    agents: tuple[str, ...]  # names of the agents, at least two, as tables and figures have them
    starts: int  # how many of the family's starting conditions, the first ones, each agent drives from
    budget: int  # how many trials
    initial: int  # how many of them come from the quasi-random design
    batch: int  # how many trials are proposed together, and their episodes run together
    engine: str  # name of what proposes the others
    seed: int  # seed of the episodes and of the search
    jobs: int  # how many processes run episodes
    stop_on_failure: bool  # whether a failing episode stops the study
    preflight: bool  # whether each parameter is first shown to matter
    confirm: int  # how often the best θ are driven again in fresh episodes when the search has ended
    cut_off: bool  # whether a trial ends once it cannot be among the best any more
    stop: StopRules  # when it ends before its budget is spent
    space: Space  # the search box, its parameters sorted by name
    domain: Section  # the table that the family's factory reads
    teaching: TeachingSettings | None = None  # how a proxy's worth as a teacher is measured, if it is
    aliases: Mapping[str, str] = field(default_factory=dict)  # what is loaded for agents of another name
    targets: tuple[Path, ...] = ()  # files of the target's scores; none of a bank, which simulates for others
    learn_from: tuple[str, ...] = ()  # where trials are known from before the first, as study.toml has it
    low_fidelity: tuple[str, ...] = ()  # such of a cheaper proxy, to whose outputs differences are modelled
    target_columns: Mapping[str, str] = field(default_factory=dict)  # other names of columns in the target's files
    held_out: tuple[str, ...] = ()  # agents that no tuning sees, by which `loop` compares proxies, where it names them
    episode_timeout_s: float | None = None  # how long an episode may take before it counts as failed [s], if limited
    families: Mapping[str, "StudySettings"] = field(default_factory=dict)  # the same study by each of its families
    family_name: str = ""  # which of several it is of; empty if there is but one

    @property
    def target(self) -> Path:
        """The score table of the target; of several files the first; refused if there is none."""
        if not self.targets:
            told = "is missing, so this is a bank, which `study` runs and learn_from names; name a table of scores"
            raise self.error("target", told)
        return self.targets[0]

    @property
    def sources(self) -> dict[str, tuple[str, ...]]:
        """What names trials that are known before the first one, by its key; no key that names none."""
        named = {"learn_from": self.learn_from, "low_fidelity": self.low_fidelity}
        return {key: names for key, names in named.items() if names}

    @property
    def loaded_agents(self) -> tuple[str, ...]:
        """The name by which each agent is loaded."""
        return tuple(self.aliases.get(agent, agent) for agent in self.agents)

    @property
    def metric_names(self) -> tuple[str, ...]:
        """The names of the metrics, in their order."""
        return tuple(metric.name for metric in self.metrics)

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

    @contextmanager
    def complaints_about(self, key: str) -> Iterator[None]:
        """Have whatever InputError is raised meanwhile be a complaint about a key."""
        try:
            yield
        except InputError as problem:
            raise self.error(key, str(problem)) from None

    def check_single(self) -> None:
        """Refuse a study of several families where one is needed, and say how to name one of them."""
        if self.families:
            one = self.home / FAMILIES / next(iter(self.families))
            raise self.error(FAMILIES, f"each of these is a study of its own, and one is needed; give one, as {one}")

    def check_theta(self) -> None:
        """Refuse a study without a best θ, also where it has trials that narrowed its box by PRPV."""
        if self.objective == LEARNING:
            remedy = "where a θ is needed, give it itself, as in a model.toml"
            raise InputError(f"{self.home}: is a {WITHOUT_THETA}; {remedy}")


def read_study_settings(path: Path) -> StudySettings:
    """Read a study.toml, given as the file or as its folder; of a folder families/NAME, as that family has it.

    Raises:
        SettingsError: With file, key and remedy.
    """
    if (around := study_around(path)) is not None:
        study, name = read_study_settings(around), path.absolute().name
        if name not in study.families:
            raise study.error(FAMILIES, f"has no '{name}', as {path} is called; {nearest(name, study.families)}")
        return study.families[name]
    read = read_settings(path / FILE_NAME if path.is_dir() else path)
    study = _settings(read)
    tables = family_tables(read, study.family, study.name)
    _check_known(study)
    if tables:
        _check_comparable(study)
    return replace(study, families={name: replace(_settings(one), family_name=name) for name, one in tables.items()})


def _check_known(study: StudySettings) -> None:
    """Refuse a study that has nothing to learn from, or could not use it."""
    if not study.targets:
        if study.objective == LEARNING:
            raise study.error("objective", f"'{LEARNING}' needs a target, and this is a bank; name a target")
        for key in study.sources:
            raise study.error(key, "is for studies with a target, and this is a bank; name a target")
        if not study.preflight:
            raise study.error("preflight", "is off, and tells a bank what placement does; leave it on")
    if study.objective == LEARNING:
        for key in study.sources:
            raise study.error(key, f"has scores, and '{LEARNING}' is not searched by them; remove it")
    if not study.budget and not study.learn_from:
        nothing = "is 0, and nothing is known without a trial; name studies in learn_from, or make it 1 or more"
        raise study.error("budget", nothing)


def _check_comparable(study: StudySettings) -> None:
    needed = {"target": bool(study.targets), **dict.fromkeys(study.sources, False), "budget": bool(study.budget)}
    for key, has in needed.items():
        if not has:
            raise study.error(key, f"of a study of {FAMILIES}: needs a target, a budget, and trials of its own alone")
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
    targets, objective = tuple(read.file("target", name) for name in targets_of(read)), read.text("objective", "prpv")
    # The names in tables of what is loaded, where [agents] is a table.
    aliases = texts_of(read.section("agents")) if isinstance(read.values.get("agents"), dict) else {}
    agents = tuple(aliases) or read.texts("agents")
    if len(agents) < 2:
        raise read.error("agents", f"comparing takes at least two agents, got {len(agents)}")
    rules, low_fidelity = read.section("stop"), read.texts("low_fidelity", ())
    rules.only(("wall_time_s", "no_improvement"))
    return StudySettings(
        path=path,
        name=read.text("name", path.absolute().parent.name),
        family=read.text("family", DEFAULT_FAMILY),
        proxy=read.file("proxy") if "proxy" in read.values else None,
        truth=read.file("truth") if "truth" in read.values else None,
        objective=objective,
        metrics=metrics_of(read),
        agents=agents,
        starts=read.whole("starts", low=1),
        budget=read.whole("budget", high=100_000),
        # What a cheaper proxy tells takes the place of half a design.
        initial=read.whole("initial", 4 if low_fidelity else 8, low=1, high=100_000),
        batch=read.whole("batch", 1, low=1, high=100_000),
        # Of learning value nothing is known but the score.
        engine=read.text("engine", SCORE_ENGINE if objective == LEARNING else DEFAULT_ENGINE),
        seed=read.whole("seed", 1),
        jobs=read.whole("jobs", 1, low=1, high=1024),
        stop_on_failure=read.text("on_failure", "continue", choices=("continue", "stop")) == "stop",
        preflight=read.flag("preflight", True),
        confirm=read.whole("confirm", 1, high=1000),
        cut_off=read.flag("cut_off", True),
        stop=StopRules(positive(rules, "wall_time_s"), positive(rules, "no_improvement")),
        space=_space(read.section("parameters")),
        domain=read.section("domain"),
        teaching=read_teaching(read.section("teaching")),
        aliases=aliases,
        targets=targets,
        learn_from=read.texts("learn_from", ()),
        low_fidelity=low_fidelity,
        target_columns=texts_of(read.section("target_columns")),
        held_out=read.texts("held_out", ()),
        episode_timeout_s=positive(read, "episode_timeout_s"),
    )


def _space(parameters: Section) -> Space:
    if not parameters.values:
        raise Section(parameters.path, "", {}).error("parameters", "is missing; write NAME = [low, high] in it")
    pairs = {name: parameters.bounds(name) for name in sorted(parameters.values)}
    try:
        return Space(tuple(Interval(name, *pair) for name, pair in pairs.items()))
    except SettingsError as problem:
        raise SettingsError(f"{parameters.path}: {parameters.name}{problem}") from None


PLAIN = ("starts", "budget", "initial", "batch", "engine", "seed", "jobs", "episode_timeout_s")


def settings_document(settings: StudySettings) -> Mapping[str, Any]:
    """The settings as plain texts and numbers, for reports."""
    return {
        "path": str(settings.path),
        "family": settings.family,
        "proxy": str(settings.proxy) if settings.proxy else None,
        "learn_from": list(settings.learn_from),
        "low_fidelity": list(settings.low_fidelity),
        "objective": settings.objective,
        "metrics": [str(metric) for metric in settings.metrics],
        "agents": list(settings.agents),
        "aliases": dict(settings.aliases),
        **{key: getattr(settings, key) for key in PLAIN},
        "on_failure": "stop" if settings.stop_on_failure else "continue",
        "preflight": settings.preflight,
        "confirm": settings.confirm,
        "cut_off": settings.cut_off,
        "stop": {key: value for key, value in vars(settings.stop).items() if value is not None},
        "parameters": {i.name: [i.low, i.high] for i in settings.space.intervals},
    }
