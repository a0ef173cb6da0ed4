"""A study ready to run: its settings, its domain family, the target's scores, its objective and its engine.

`open_study` puts together a `Study`, all that a trial is a function of apart from θ. The target's scores come from one
file or several: agents without any are left out (`with_scores`), and so are episodes from other starts where the
study's own are all there (`read_target`). The objective is a measure of how far proxy and target agree on the agents'
mean scores, PRPV unless study.toml says otherwise; what others bring as a measure is tried before any episode is run.
"""

import functools
import itertools
import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from numbers import Real
from pathlib import Path
from typing import Any

import numpy as np

from proxytune.arrays import Floats
from proxytune.domain import DomainFamily
from proxytune.effects import Catalogue, read_model
from proxytune.errors import ExtensionError, InputError, ScoresError
from proxytune.extensions import ask, load, plugins
from proxytune.scores import Metric, ScoreTable, read_scores
from proxytune.search import ENGINE_NAMES, GAUSSIAN_PROCESS, Engine, engine_of, why_not_engine
from proxytune.settings import nearest
from proxytune.space import Theta
from proxytune.study.family import given_family, load_family, user_code
from proxytune.study.settings import LEARNING, StudySettings, read_study_settings, unnoticed
from proxytune.usefulness import MEASURES, Measure, compare, start_of, starts_of


def with_scores(settings: StudySettings) -> tuple[StudySettings, tuple[str, ...]]:
    """The study of those agents that the target has scores of, and who is left out on either side, in a line each."""
    scored = _read(settings, settings.metric_names).agents
    there = tuple(agent for agent in settings.agents if agent in scored)
    missing = [agent for agent in settings.agents if agent not in scored]
    beyond = [agent for agent in scored if agent not in (*settings.agents, *settings.held_out)]
    if len(there) < 2:
        files = ", ".join(map(str, settings.targets))
        raise InputError(f"{files}: has no scores of {', '.join(missing)}; {_remedy(missing, beyond)}")
    lines = [f"the target has no scores of {', '.join(missing)}: left out"] if missing else []
    lines += [f"the target has scores of {', '.join(beyond)}, no agents of this study: left out"] if beyond else []
    return replace(settings, agents=there), tuple(lines)


def _remedy(missing: Sequence[str], beyond: Sequence[str]) -> str:
    if not beyond:
        return "add them, or take them out of the study"
    if len(missing) == 1:
        return nearest(missing[0], beyond)
    one = f"{beyond[0]} = '{missing[0]}'"
    return f"its agents are {', '.join(beyond)[:80]}; give yours these names by a table [agents] in study.toml: {one}"


def read_target(settings: StudySettings, family: DomainFamily) -> tuple[ScoreTable, tuple[str, ...]]:
    """The target's scores of the study's agents, from the study's own starts where it has all of these.

    What else it has of them is left out then, which a line says. An InputError if a metric or a number is lacking.
    """

    def has_in_full(metric: str) -> bool:
        try:
            _read(settings, [metric])
        except ScoresError:
            return False
        return True

    compared = settings.metric_names
    # What a search can learn from at no cost
    others = [name for name in family.metrics if name not in compared and has_in_full(name)]
    chosen = _read(settings, [*compared, *others]).arrange(agents=settings.agents)
    driven = [label for column, label in enumerate(chosen.episodes) if chosen.driven[:, column].any()]
    wanted = {str(start) for start in range(settings.starts)}
    own = [label for label in driven if start_of(label) in wanted]
    if set(starts_of(own)) != wanted:
        return chosen.arrange(agents=settings.agents, episodes=driven), ()
    beyond = [label for label in driven if label not in own]
    line = (
        f"the target's episodes {own[0]} to {own[-1]} are taken for this study's starts, and {len(beyond)} of others "
        "are left out; raise starts to use them, or label episodes otherwise if they are no starts"
    )
    return chosen.arrange(agents=settings.agents, episodes=own), (line,) if beyond else ()


def _read(settings: StudySettings, metrics: Iterable[str]) -> ScoreTable:
    return read_scores((settings.target, *settings.targets[1:]), metrics, columns=settings.target_columns)


OfMeans = Callable[[Floats, Floats, Sequence[Metric]], Floats]
"""A measure of mean scores in the proxy (…, agents, metrics) and on the target (agents, metrics): shape (…)."""


@dataclass(frozen=True)
class Objective:
    """A measure as the objective of a study: as study.toml and as people call it, and whether more is better."""

    name: str
    label: str
    maximise: bool
    of_means: OfMeans

    @property
    def sign(self) -> float:
        """The factor that makes the measure something to be made small, and back."""
        return -1.0 if self.maximise else 1.0

    def measure(self, *, proxy: ScoreTable, target: ScoreTable, metrics: Sequence[Metric]) -> dict[str, float | None]:
        """PRPV, PPV and this measure of a proxy, by name; None where one is undefined."""
        means = compare(proxy=proxy, target=target, metrics=metrics).means
        kept = {self.name: self.of_means, **{name: one.of_means for name, one in KEPT.items()}}
        values = {name: float(of_means(*means, metrics)) for name, of_means in kept.items()}
        return {name: value if math.isfinite(value) else None for name, value in values.items()}


TRIED = (4, 3, 2)
"""Tables, agents and metrics that a user's own measure is tried on."""


def objective_of(settings: StudySettings) -> Objective:
    """The measure that the trials of a study are scored by; a study of learning value is narrowed by PRPV."""
    name = settings.objective
    if name == LEARNING:
        return PRPV
    if name in KEPT:
        return KEPT[name]
    with settings.complaints_about("objective"):
        if ":" not in name and name not in plugins("measure", KEPT):
            hint = nearest(name, (*KEPT, LEARNING))
            raise InputError(f"unknown measure '{name}' (your own is written module:attribute); {hint}")
        objective = _as_objective(name, measure_of(name, settings.folder))
    return objective


def measure_of(name: str, beside: Path | None = None) -> Measure:
    """The measure that is not shipped: `module:attribute`, this folder's first, or a plug-in's; else ExtensionError."""
    measure = load(name, kind="measure", beside=beside)
    if not isinstance(measure, Measure):
        raise ExtensionError(f"measure '{name}' is a {type(measure).__name__}; make it a proxytune.Measure")
    return measure


def _as_objective(name: str, measure: Measure) -> Objective:
    if measure.on_means is None or measure.per_metric:
        told = f"measure '{name}' is no single number of mean scores"
        raise ExtensionError(f"{told}: it needs on_means, without per_metric")
    of_means = measure.on_means
    if measure not in MEASURES:
        of_means = functools.partial(_of_users_measure, name, measure.on_means)
        # Tried as a search calls it: several proxies against one target, before any episode is run.
        means = np.random.default_rng(0).uniform(1.0, 2.0, TRIED)
        of_means(means, means[0], [Metric("one"), Metric("other", "min")])
    return Objective(name, measure.name, not measure.lower_is_better, of_means)


def _of_users_measure(name: str, on_means: OfMeans, proxy: Floats, target: Floats, metrics: Sequence[Metric]) -> Floats:
    """A measure of mean scores that is not ours: what it does wrong is told in one line."""
    where = f" for means {proxy.shape} against {target.shape}"
    # Copies, since PRPV and PPV are of the same means
    own = proxy.copy(), target.copy()
    values = ask(f"measure '{name}'", lambda: np.asarray(on_means(*own, metrics), dtype=float), where)
    if values.shape != proxy.shape[:-2]:
        told = f"measure '{name}' gives values {values.shape} of means {proxy.shape}"
        raise ExtensionError(f"{told}; give one for each table, {proxy.shape[:-2]}")
    return values


KEPT = {one.key: _as_objective(one.key, one) for one in MEASURES if one.on_means is not None and not one.per_metric}
"""PRPV and PPV: what may be an objective by name, and is kept with every trial."""
PRPV = KEPT["prpv"]


@dataclass(frozen=True)
class Study:
    """All that a trial is a function of, apart from θ."""

    settings: StudySettings  # what study.toml says
    family: DomainFamily  # the proxy's domain family
    # the target's scores of the study's agents, in the study's order: the metrics by which they are compared, then
    # every other one that the family has too
    target: ScoreTable
    identity: str  # what determines the result of an episode in the proxy, apart from the episode
    truth: Theta | None = None  # the θ that made the target, where study.toml names its model; no trial depends on it
    cautions: tuple[str, ...] = ()  # what of study.toml or of the target's table is left out, in one line each
    objective: Objective = PRPV  # the measure that its trials make small or large
    engine: Engine = GAUSSIAN_PROCESS  # what proposes its trials after the design
    code: str = ""  # a digest of what the user's own code means; failures of other code are not remembered


def open_study(path: Path) -> Study:
    """Read a study.toml, load its family and the target's scores; an InputError tells file, key and remedy."""
    return open_settings(read_study_settings(path))


def open_settings(settings: StudySettings, given: Any = None) -> Study:
    """Load a study's family, unless one is given, and the target's scores; raises as `open_study`, and at several."""
    settings.check_single()
    family = load_family(settings, settings.proxy) if given is None else given_family(settings, given)
    known, left_out = with_scores(settings)
    target, unused = read_target(known, family)
    cautions = (*left_out, *unused, *unnoticed(settings.folder), *cautions_of(family))
    objective = objective_of(settings)
    truth, engine, code = _truth(settings, family), _engine(settings), user_code(settings)
    return Study(known, family, target, family.identity, truth, cautions, objective, engine, code)


def open_bank(settings: StudySettings) -> Study:
    """Load the family of a bank, a study without a target, whose table of scores has zeros; raises as `open_study`."""
    family = load_family(settings, settings.proxy)
    names = dict.fromkeys((*settings.metric_names, *family.metrics))
    cells = itertools.product(settings.agents, range(settings.starts))
    table = ScoreTable.from_episodes({cell: dict.fromkeys(names, 0.0) for cell in cells})
    return Study(settings, family, table, family.identity, code=user_code(settings))


def cautions_of(family: DomainFamily) -> tuple[str, ...]:
    """Sentences on what is probably not meant in a family's robot or model, where it has any to say."""
    return tuple(getattr(family, "cautions", ()))


def _engine(settings: StudySettings) -> Engine:
    with settings.complaints_about("engine"):
        engine = engine_of(settings.engine, settings.folder)
    if not engine.in_studies:
        raise settings.error("engine", f"'{engine.name}' is for `compare` only; {nearest(engine.name, ENGINE_NAMES)}")
    if reason := why_not_engine(engine, composed=settings.objective != LEARNING):
        raise settings.error("engine", reason)
    if settings.low_fidelity and (engine.learns_from == "scores" or engine.name not in ENGINE_NAMES):
        told = f"engine '{engine.name}' cannot tell a cheaper proxy's trials from this one's; take 'outcomes'"
        raise settings.error("low_fidelity", told)
    return engine


def family_catalogue(family: DomainFamily, settings: StudySettings) -> Catalogue:
    """The effects that a study's family may have: those of its robot, a user's own from the study's folder."""
    own: Catalogue | None = getattr(family.parameters, "catalogue", None)
    return own or Catalogue(settings.folder.resolve())


def _truth(settings: StudySettings, family: DomainFamily) -> Theta | None:
    if settings.truth is None:
        return None
    if not settings.truth.is_file():
        raise settings.error("truth", f"no such file: {settings.truth}; check the path, or remove it")
    known = theta_of_model(family, settings, settings.truth, f"{settings.path}: truth")
    return {name: known[name] for name in settings.space.names if name in known}


def theta_of_model(family: DomainFamily, settings: StudySettings, model: Path, where: str) -> Theta:
    """θ of a model.toml, as the family's `truth` reads it; of one without it the effects that the file has.

    An InputError if neither reads it, which begins with where it was named.
    """
    if (own := getattr(family, "truth", None)) is not None:
        known = ask(f"truth of {settings.family}", lambda: dict(own(model)))
        if wrong := [name for name, value in known.items() if not isinstance(value, Real)]:
            raise InputError(f"{where}: truth of {settings.family} gives no number for '{wrong[0]}'; correct it")
        return known
    try:
        return read_model(model, family_catalogue(family, settings)).theta
    except InputError as problem:
        if hasattr(family.parameters, "catalogue"):
            raise
        lacks = f"{settings.family} has no method truth(model), so {model.name} can hold effects alone"
        raise InputError(f"{where}: {problem}; {lacks}; add one that gives θ") from None
