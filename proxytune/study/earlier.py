"""Earlier studies whose trials are known before the first one: what an agent does at θ depends on no target.

A source is the folder of a study, or the table of trials that a bank writes (`write_table`). It counts if it is of the
same domain family, settings, parameters and agents; where its code or versions are others, some of its episodes are
driven again and must come out alike. `learn` copies what counts into study.db before the first trial, and from then on
that is a fact (`earlier_trials`): a source may grow, move or go. Trials of another study seed share another placement,
which `Trial.placement` tells the search. A source of `low_fidelity` is of another, cheaper proxy, and need share no
more than agents, metrics, starts and parameters.
"""

import json
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from os.path import exists
from pathlib import Path
from typing import Any

import numpy as np

from proxytune.domain import Episode, Instance, instance_of
from proxytune.errors import InputError, StoreError
from proxytune.files import shipped, temporary_folder, write_whole
from proxytune.search import Trial
from proxytune.seeds import episode_seed
from proxytune.settings import is_finite, read_text
from proxytune.storage import FILE_NAME as DATABASE, Store
from proxytune.study.facts import COPIED, stored_facts, study_facts
from proxytune.study.opening import Study
from proxytune.study.preflight import PLACEMENT, placement_variance
from proxytune.study.settings import LEARNING, StudySettings, read_study_settings
from proxytune.study.study_run import Spent, StudyRun, compose_of

AGAIN = 12
"""So many episodes of a source are driven again where its code or versions are others."""
TOLERANCE = 1e-3
"""Of its value, in which a metric of them may differ."""
DIGITS = 5
"""Of each score in a table of trials."""
LARGEST = 1e12
"""No θ or score is further from 0 than this; squares and sums of such are still numbers."""
FULL, LOW = COPIED
BANK_FILE = "bank.json"
FORMAT = 1

Scores = Mapping[tuple[str, int], Mapping[str, float]]
"""Metrics by agent and start."""


@dataclass(frozen=True)
class Source:
    """An earlier study."""

    path: Path
    facts: Mapping[str, Any]  # what its trials depend on
    trials: Mapping[Instance, Scores]  # scores of each domain instance, failed episodes left out
    placement: Mapping[str, Mapping[str, float]] = field(default_factory=dict)  # variance by it, which a table knows


def learn(run: StudyRun) -> tuple[str, ...]:
    """Copy what earlier studies know into the store, unless it has been.

    Returns:
        One line on each cheaper proxy that was copied: what its domain has otherwise; and one on a design that known
        trials take the place of.

    Raises:
        InputError: If one of them is not there, or is none of this domain, with its name.
        StoreError: If its database is damaged.
    """
    settings, known, notes = run.settings, run.store.facts(), list[str]()
    for key, names in settings.sources.items():
        if COPIED[key] not in known:
            sources = [read_source(settings, name, key) for name in names]
            _keep(run, sources, key)
            for source in sources if key == LOW else ():
                told = ", ".join(_otherwise(run, source)) or "its code or its robot is another"
                notes.append(f"{LOW}: {source.path}: {told}")
            if key == FULL and settings.budget:
                count = len(earlier_trials(run))
                spared = f"all {settings.initial}" if count >= settings.initial else f"{count} of {settings.initial}"
                notes.append(f"initial: {spared} trials of the design are left out, as {FULL} knows {count}")
    return tuple(notes)


def _otherwise(run: StudyRun, source: Source, *keys: str) -> list[str]:
    """What a source has otherwise of these facts, or of all that describe the domain: a phrase each."""
    theirs, ours = source.facts, study_facts(run.study)
    chosen = keys or [key for key in {**theirs, **ours} if key == "family" or key.startswith("domain.")]
    pairs = [(key, theirs.get(key) or "not given", ours.get(key) or "not given") for key in chosen]
    return [f"{key} is {there} there and {here} here" for key, there, here in pairs if there != here]


@contextmanager
def table_alone(study: Study) -> Iterator[StudyRun]:
    """A bank of which nothing but its table is there, as a run that knows its trials; nothing is driven."""
    settings = replace(study.settings, learn_from=(BANK_FILE,))
    with temporary_folder() as folder, Store.open(folder) as store:
        run, source = StudyRun(replace(study, settings=settings), store), read_source(settings, BANK_FILE)
        _keep(run, [source], again=False)
        store.save_fact(PLACEMENT, dict(source.placement))
        yield run


def _keep(run: StudyRun, sources: Sequence[Source], key: str = FULL, *, again: bool = True) -> None:
    settings, box = run.settings, run.settings.space.intervals
    places, rows, names = {settings.seed: 0}, [], sorted(_metrics(run))
    for source in sources:
        _check_like(run, source, key)
        if key == FULL:
            _check_same(run, source, again=again)
        place = places.setdefault(source.facts["seed"], len(places))
        inside = [theta for theta in source.trials if all(b.low <= dict(theta)[b.name] <= b.high for b in box)]
        if not inside:
            why = "has no trial in the box of [parameters]; widen it, or remove this"
            raise _refused(settings, key, source.path, why)
        for theta in inside:
            means = _means(source.trials[theta], settings, names)
            rows.append([place, list(settings.space.values(dict(theta))), means])
    unique = {json.dumps(row[:2]): row for row in rows}
    told = {"metrics": names, "agents": list(settings.agents), "trials": list(unique.values())}
    run.store.save_fact(COPIED[key], {**told, "sources": [str(source.path) for source in sources]})


def earlier_trials(run: StudyRun) -> tuple[Trial, ...]:
    """The trials of earlier studies, as copied; those whose agents were not all driven have a score of what is likely.

    Raises:
        StoreError: If they are not as we write them.
    """
    if not run.settings.learn_from:
        return ()
    copied, table = _copied(run, FULL), run.study.target
    outputs = np.array([trial.outcome for trial in copied])
    with np.errstate(invalid="ignore"):
        middle = np.nansum(outputs, axis=0) / (~np.isnan(outputs)).sum(axis=0)
    middle = np.where(np.isnan(middle), table.means.ravel(), middle)
    scores = compose_of(run.study)(np.where(np.isnan(outputs), middle, outputs)).tolist()
    return tuple(replace(trial, score=score) for trial, score in zip(copied, scores, strict=True))


def known_trials(run: StudyRun) -> tuple[Trial, ...]:
    """All that is known before the first trial: of earlier studies, and of a cheaper proxy, which has no score here."""
    cheap = _copied(run, LOW) if run.settings.low_fidelity else []
    return (*earlier_trials(run), *(replace(trial, low_fidelity=True) for trial in cheap))


def _copied(run: StudyRun, key: str) -> list[Trial]:
    """The trials that the store holds for a key, with the outputs of this study's agents and metrics."""
    table, fact = run.study.target, COPIED[key]
    if (learnt := run.store.facts().get(fact)) is None:
        raise StoreError(f"{run.store.path}: has nothing of {key} yet; run the study first")
    try:
        rows = [learnt["agents"].index(agent) for agent in table.agents]
        metrics = [learnt["metrics"].index(name) if name in learnt["metrics"] else -1 for name in table.metrics]
        shape = (len(learnt["trials"]), len(learnt["agents"]), len(learnt["metrics"]))
        values = np.array([means for _, _, means in learnt["trials"]], dtype=float).reshape(shape)
        placed = [(int(place), tuple(map(float, theta))) for place, theta, _ in learnt["trials"]]
    except (KeyError, TypeError, ValueError, AttributeError):
        raise StoreError(f"{run.store.path}: '{fact}' is not as proxytune writes it; restore a copy") from None
    values = np.concatenate([values, np.full((*shape[:2], 1), np.nan)], axis=2)[:, rows][:, :, metrics]
    pairs = zip(placed, values.reshape(len(values), -1).tolist(), strict=True)
    return [Trial(theta, None, tuple(row), placement=place) for (place, theta), row in pairs]


def read_source(settings: StudySettings, name: str, key: str = FULL) -> Source:
    """A study or table of trials that a key names, from this study's folder on; or a study that is shipped."""
    path = settings.folder / name
    path = shipped("studies") / name if not exists(path) and exists(shipped("studies") / name) else path
    if not exists(path):
        raise _refused(settings, key, path, "no such study or table of trials; check the path")
    if path.is_dir() and not any((path / part).exists() for part in ("study.toml", DATABASE, BANK_FILE)):
        raise _refused(settings, key, path, "is a folder without study.toml; name a study or a table of trials")
    for home, learns in _chain(path):
        if home.resolve() == settings.folder.resolve():
            told = "learns from this study in turn" if learns else "is this very study"
            raise _refused(settings, key, path, f"{told}; remove it")
    if path.is_dir() and (path / DATABASE).exists():
        return _of_study(path)
    table = path / BANK_FILE if path.is_dir() else path
    if not table.exists():
        told = f"has neither {DATABASE} nor {BANK_FILE}; run it first: python -m proxytune study {path}"
        raise _refused(settings, key, path, told)
    try:
        return _of_table(table)
    except ValueError:
        told = "is no table of trials as proxytune writes it; name a study, or restore a copy"
        raise _refused(settings, key, path, told) from None


def _chain(path: Path) -> Iterator[tuple[Path, bool]]:
    """A source and all that it learns from in turn: each folder, and whether it is not the source itself."""
    seen, left = set[Path](), [path]
    while left:
        one = left.pop()
        if one.resolve() not in seen and one.is_dir():
            seen.add(one.resolve())
            yield one, len(seen) > 1
            settings = read_study_settings(one)
            left += [settings.folder / name for name in settings.learn_from]


def _of_study(path: Path) -> Source:
    settings = read_study_settings(path)
    settings.check_single()
    with Store.read(settings.home) as store:
        facts = stored_facts(store)
        done = [one for kind in store.searches() if kind != LEARNING for one in store.trials(kind)]
        seeds = {start: episode_seed(facts["seed"], start) for start in range(facts["starts"])} if done else {}
        trials: dict[Instance, Scores] = {}
        for trial in done:
            known = store.outcomes(facts["identity"], trial.theta).items()
            scored = {(e.agent, e.start): o.metrics for e, o in known if o.metrics and seeds.get(e.start) == e.seed}
            if scored and trial.state in ("finished", "cut"):
                trials[instance_of(trial.theta)] = scored
    return Source(path, facts, trials)


def _of_table(path: Path) -> Source:
    try:
        kept = json.loads(read_text(path))
        facts, metrics, agents = kept["facts"], kept["metrics"], kept["agents"]
        trials: dict[Instance, Scores] = {}
        whole = all(type(facts[key]) is int and facts[key] >= 0 for key in ("seed", "starts"))
        if kept["format"] != FORMAT or not whole or len({tuple(sorted(theta)) for theta, _ in kept["trials"]}) > 1:
            raise ValueError
        for theta, scores in kept["trials"]:
            cells = {(a, s): one for a, row in zip(agents, scores, strict=True) for s, one in enumerate(row) if one}
            found = {key: dict(zip(metrics, one, strict=True)) for key, one in cells.items()}
            values = [value for one in (theta, *found.values()) for value in one.values()]
            if not all(is_finite(value) and abs(value) < LARGEST for value in values):
                raise ValueError
            trials[instance_of(theta)] = found
        placement = {agent: dict(one) for agent, one in kept.get("placement", {}).items()}
        if not all(is_finite(v) and 0.0 <= v < LARGEST**2 for one in placement.values() for v in one.values()):
            raise ValueError
    except OSError as problem:
        raise StoreError(f"{path}: cannot be read ({problem.strerror}); check it") from None
    except (KeyError, TypeError, AttributeError, RecursionError) as problem:
        raise ValueError from problem
    return Source(path, facts, trials, placement)


def write_table(run: StudyRun) -> Path:
    """Write a study's trials as a table beside it, for other studies to learn from; else a StoreError."""
    source, path = _of_study(run.settings.home), run.settings.home / BANK_FILE
    metrics, agents = sorted(_metrics(run)), run.settings.agents

    def cell(scores: Mapping[str, float] | None) -> list[float] | None:
        return scores and [float(f"{scores[name]:.{DIGITS}g}") for name in metrics]  # type: ignore[return-value]

    rows = [
        [dict(theta), [[cell(scores.get((agent, s))) for s in range(run.settings.starts)] for agent in agents]]
        for theta, scores in source.trials.items()
    ]
    told, placed = run.study.target, placement_variance(run)
    pairs = zip(told.agents, [] if placed is None else placed.tolist(), strict=False)
    placement = {
        agent: {name: float(f"{v:.{DIGITS}g}") for name, v in zip(told.metrics, one, strict=True)}
        for agent, one in pairs
    }
    table = {"format": FORMAT, "facts": dict(source.facts), "metrics": metrics, "agents": list(agents), "trials": rows}
    table["placement"] = placement
    write_whole(path, json.dumps(table, separators=(",", ":"), allow_nan=False) + "\n", kind=StoreError)
    return path


def _check_like(run: StudyRun, source: Source, used: str) -> None:
    """Refuse a source whose trials do not have the outputs of this study's, or not at points of its box."""
    settings, theirs, ours = run.settings, source.facts, study_facts(run.study)

    def refused(why: str) -> InputError:
        return _refused(settings, used, source.path, why)

    if not source.trials:
        raise refused("has no finished trial; run it first, or remove it")
    agents = {agent for scores in source.trials.values() for agent, _ in scores}
    if lacks := [agent for agent in settings.agents if agent not in agents]:
        raise refused(f"has not driven {', '.join(lacks)}; remove it")
    scored = {name for scores in source.trials.values() for one in scores.values() for name in one}
    if lacks := [name for name in settings.metric_names if name not in scored]:
        raise refused(f"has no scores of {', '.join(lacks)}; remove it")
    boxes = [sorted(name for name, _ in next(iter(source.trials))), sorted(settings.space.names)]
    if boxes[0] != boxes[1]:
        raise refused(f"its parameters are {', '.join(boxes[0])}, this study's {', '.join(boxes[1])}; remove it")
    if theirs["starts"] < settings.starts:
        told = f"has driven from {theirs['starts']} starts, and this study asks for {settings.starts}"
        raise refused(f"{told}; lower starts, or remove it")
    for told in _otherwise(run, source, *(f"agents.{agent}" for agent in settings.agents)):
        raise refused(f"{told}; remove it")
    if used == LOW and theirs.get("identity") == ours["identity"]:
        raise refused("is of this very proxy, so its trials count in full; name it in learn_from")


def _check_same(run: StudyRun, source: Source, *, again: bool) -> None:
    """Refuse a source of another domain: where code or versions differ, by what some of its episodes come to."""
    theirs, ours = source.facts, study_facts(run.study)
    if all(theirs.get(key) == ours.get(key) for key in ("identity", "versions")):
        return
    for told in _otherwise(run, source):
        raise _refused(run.settings, FULL, source.path, f"{told}; remove it")
    if again:
        _check_again(run, source)


def _check_again(run: StudyRun, source: Source) -> None:
    """Drive episodes of a source again, spread over its trials and agents, and refuse one that comes out otherwise."""
    cells = [(theta, *key) for theta, scores in source.trials.items() for key in sorted(scores)]
    mine = [cell for cell in cells if cell[1] in run.settings.agents and cell[2] < run.settings.starts]
    chosen = [mine[row] for row in np.unique(np.linspace(0, len(mine) - 1, AGAIN).round().astype(int))]
    seed = source.facts["seed"]
    planned = [Episode(theta, agent, start, episode_seed(seed, start)) for theta, agent, start in chosen]
    before = run.spent.episodes
    found = run.outcomes(planned, f"episodes of {source.path.name} again")
    run.spent += Spent(unused=run.spent.episodes - before)
    for (theta, agent, start), episode in zip(chosen, planned, strict=True):
        now = found[episode].metrics or {}
        for name, value in source.trials[theta][agent, start].items():
            again = now.get(name, float("inf")) if name in _metrics(run) else value
            if abs(again - value) > TOLERANCE * max(abs(value), TOLERANCE):
                told = f"its code or versions are others, and {agent} from start {start} has {name} {value:.4g} there"
                told = f"{told} and {again:.4g} here; run it again, or remove it"
                raise _refused(run.settings, FULL, source.path, told)


def _metrics(run: StudyRun) -> set[str]:
    return {*run.study.family.metrics, *run.settings.metric_names}


def _means(scores: Scores, settings: StudySettings, names: Sequence[str]) -> list[list[float | None]]:
    """Each agent's mean metrics over the study's starts; None where no episode tells."""

    def mean(agent: str, name: str) -> float | None:
        known = [scores[agent, s][name] for s in range(settings.starts) if name in scores.get((agent, s), {})]
        return float(np.mean(known)) if known else None

    return [[mean(agent, name) for name in names] for agent in settings.agents]


def _refused(settings: StudySettings, key: str, path: Path, why: str) -> InputError:
    return settings.error(key, f"{path}: {why}")
