"""A study without a folder or TOML: a function or an environment, a box of parameters, and the target's scores.

`tune` writes the study.toml that says all but the simulator, and runs it as `run_study` does; the simulator is at hand.
"""

import inspect
import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, nullcontext, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from proxytune.api.scores import column_table, of_rows, toml_text
from proxytune.api.search_box import box_space
from proxytune.api.study import StudyReport, run_quietly
from proxytune.domain import Episode, Outcome
from proxytune.errors import EpisodeError, InputError
from proxytune.files import temporary_folder
from proxytune.identity import digest, meaning_of_code
from proxytune.report import write_text
from proxytune.scores import Metric, ScoreTable, read_scores
from proxytune.settings import check_numbers, nearest
from proxytune.space import Parameter, Theta
from proxytune.study import FILE_NAME, GIVEN, Study, check_box, open_settings, plan_episodes, read_study_settings

Simulate = Callable[..., float | Mapping[str, float]]
HEAD = "# Written by proxytune.tune, which writes it anew at every call.\n"


@dataclass(frozen=True)
class GivenFamily:
    """A user's function as a domain family: called with θ and the agent, and start and seed where it has these."""

    simulate: Simulate
    parameters: Mapping[str, Parameter]
    metrics: Mapping[str, str]
    agents: tuple[str, ...]
    starts: int
    identity: str

    def check_agent(self, name: str) -> None:
        """Refuse an agent that has no policy."""
        if name not in self.agents:
            raise InputError(f"agent '{name}' is not given; {nearest(name, self.agents)}")

    def run(self, episode: Episode) -> Mapping[str, float]:
        """The scores of one episode."""
        known = {"start": episode.start, "seed": episode.seed}
        named = {name: value for name, value in known.items() if name in _arguments(self.simulate)}
        scores = self.simulate(dict(episode.theta), episode.agent, **named)
        if isinstance(scores, Mapping):
            return scores
        if len(self.metrics) > 1 or scores is None:
            raise EpisodeError(f"the simulator must answer with a dict of {', '.join(self.metrics)}, got {scores!r}")
        return dict.fromkeys(self.metrics, float(scores))


def tune(
    simulator: Simulate | str,
    box: Mapping[str, tuple[float, float]],
    scores: pd.DataFrame | str | Path,
    *,
    metrics: str | Sequence[str],
    agents: Mapping[str, Any] | None = None,
    folder: str | Path | None = None,
    known: pd.DataFrame | Iterable[Theta] = (),
    columns: Mapping[str, str] | None = None,
    starts: int | None = None,
    budget: int = 40,
    domain: Mapping[str, Any] | None = None,
    progress: bool = False,
    **keys: Any,
) -> StudyReport:
    """Find the θ at which a simulator ranks agents as the target does; no folder and no TOML are needed.

    Args:
        simulator: A function `simulate(theta, agent)`, or `simulate(theta, agent, start, seed)`, that answers with a
            score or a dict of metrics; with `agents` a Gymnasium environment: its name, or what makes it.
        box: Lowest and highest value of each parameter. An environment's are arguments of its constructor, attributes
            written with a point (`unwrapped.m`), and effects by their names in θ.
        scores: The target's: one row per agent and episode, as `score` takes them. Episode 0, 1, … is that start.
        metrics: How agents are compared, as in "distance:max".
        agents: Policies by name, each a function of an observation or with `predict`, or "random" or "zero".
        folder: Where trials are kept: called again with the same, it goes on from there; nowhere if not given.
        known: θ to try first; or a DataFrame of what was simulated before, by θ, agent and episode, that is not
            simulated again.
        columns: What columns are called in `scores`, as in {"agent": "policy"}.
        starts: How many starting conditions. If not given, as many as the target has episodes of an agent; one of a
            function that takes no start, and all of the target's episodes repeat it.
        budget: How many trials.
        domain: Other keys of an environment's `[domain]` table, as in {"steps": 200}.
        progress: Whether to show a bar.
        keys: Any other key of study.toml, as in seed=2, jobs=4, batch=4, engine="composite".

    Raises:
        InputError: If anything cannot be used, or the function's code has changed since trials were kept.
        RunError: If no trial works; all that was finished is kept.
    """
    space, compared = box_space(box), [metrics] if isinstance(metrics, str) else list(metrics)
    with temporary_folder() if folder is None else nullcontext(Path(folder)) as home, _written(home, scores) as target:
        table = read_scores(target, [Metric.parse(one).name for one in compared], columns=columns)
        _check_agents(simulator, agents)
        names = tuple(agents) if agents else table.agents
        simulate: Any = simulator
        if agents:  # Gymnasium is loaded for environments alone
            from proxytune.environments import played_environment

            simulate = played_environment(simulator, space, agents, domain or {}, home / FILE_NAME)
        if not callable(simulate):
            raise InputError(f"simulator: {simulate!r} is no function; an environment needs agents={{name: policy}}")
        _check_takes(simulate)
        counted = int(table.counts.max()) if "start" in _arguments(simulate) else 1
        if repeated := starts is None and counted < table.counts.max():
            target = home / "target.csv"
            write_text(target, _as_repeats(table).to_csv(index=False, lineterminator="\n"))
        stated = {
            "format": 1,
            "name": "tune" if folder is None else home.name,
            "family": GIVEN,
            "target": str(target.absolute()),
            "metrics": compared,
            "agents": list(names),
            "starts": counted if starts is None else starts,
            "budget": budget,
            **({"target_columns": dict(columns)} if columns and not repeated else {}),
            **keys,
            "parameters": {one.name: [one.low, one.high] for one in space.intervals},
        }
        write_text(home / FILE_NAME, HEAD + toml_text(stated, "tune"))
        settings = read_study_settings(home)
        if agents:  # whose effects may be unfit to wrap it; a constructor takes what the box says
            check_box(settings, simulate.family)
        own = {
            one.name: Parameter(name=one.name, unit="", low=one.low, high=one.high, neutral=float("nan"))
            for one in space.intervals
        }
        code = (meaning_of_code(one) for one in (simulator, *(agents or {}).values()))
        identity = digest(*code, names, sorted((domain or {}).items()))
        units = {one.name: "" for one in settings.metrics}
        study = open_settings(settings, GivenFamily(simulate, own, units, names, settings.starts, identity))
        return run_quietly(study, progress, _known(study, known))


def _check_agents(simulator: Any, agents: Any) -> None:
    """Refuse agents that are no policies by name, or that are given with a function."""
    if not agents:
        return
    if callable(simulator) and {"theta", "agent"} <= _arguments(simulator):
        raise InputError("agents: are policies of a Gymnasium environment; of a function leave it out")
    if not isinstance(agents, Mapping):
        told = "are policies of a Gymnasium environment by name; of a function leave it out"
        raise InputError(f"agents: {told}, got a {type(agents).__name__}")


def _check_takes(simulate: Simulate) -> None:
    """Refuse a function that cannot be called as `GivenFamily.run` does."""
    with suppress(ValueError):  # Of some nobody says what they take
        signature = inspect.signature(simulate)
        named = {"start", "seed"} & set(signature.parameters)
        try:
            signature.bind({}, "agent", **dict.fromkeys(named, 0))
        except TypeError:
            wanted = "the function must take (theta, agent), or (theta, agent, start, seed)"
            raise InputError(f"simulator: {wanted}, and takes {signature}") from None


def _as_repeats(table: ScoreTable) -> pd.DataFrame:
    """All of the target's episodes as repeats of start 0."""
    return pd.DataFrame(
        {"agent": agent, "episode": f"0/{place}", **dict(zip(table.metrics, values[place], strict=True))}
        for agent, values in zip(table.agents, table.values, strict=True)
        for place in np.flatnonzero(~np.isnan(values[:, 0]))
    )


@contextmanager
def _written(home: Path, scores: pd.DataFrame | str | Path) -> Iterator[Path]:
    """The file of the target's scores, in the study's folder if they are a DataFrame."""
    path, table = home / FILE_NAME, home / "target.csv"
    before = {one: one.read_text(encoding="utf-8") for one in (path, table) if one.exists()}
    if not before.get(path, HEAD).startswith(HEAD):
        raise InputError(f"{home}: has a study.toml that tune did not write; use run_study, or give another folder")
    if isinstance(scores, pd.DataFrame):
        write_text(table, column_table("scores", scores).to_csv(index=False, lineterminator="\n"))
    try:
        yield table if isinstance(scores, pd.DataFrame) else Path(scores)
    except InputError as problem:
        for one, text in before.items():
            write_text(one, text)
        where = f"{home}: " if before else ""
        told = str(problem).replace(f"{path}: ", where)
        told = of_rows(told.replace(str(table), "scores.csv")) if isinstance(scores, pd.DataFrame) else told
        raise type(problem)(told) from None


def _known(study: Study, known: pd.DataFrame | Iterable[Theta]) -> list[Outcome | Theta]:
    """Known points as the study has them: θ, or the outcomes of its episodes."""
    settings, space = study.settings, study.settings.space
    rows: list[dict[Any, Any]]
    rows = known.reset_index().to_dict("records") if isinstance(known, pd.DataFrame) else [dict(one) for one in known]
    found: list[Outcome | Theta] = []
    for place, row in enumerate(rows):
        where = f"known: row {place}"
        if missing := [name for name in space.names if name not in row]:
            raise InputError(f"{where}: has no '{missing[0]}'; give each parameter of the box")
        if not isinstance(known, pd.DataFrame) and (others := [name for name in row if name not in space.names]):
            hint = nearest(str(others[0]), space.names)
            raise InputError(f"{where}: '{others[0]}' is no parameter of the box; {hint}")
        check_numbers({name: row[name] for name in space.names}, where)
        theta = {name: float(row[name]) for name in space.names}
        for one in space.intervals:
            if not one.low <= theta[one.name] <= one.high:
                raise InputError(f"{where}: {one.name} is {theta[one.name]:g}, outside [{one.low:g}, {one.high:g}]")
        if not isinstance(known, pd.DataFrame):
            found.append(theta)
            continue
        episodes = {(one.agent, str(one.start)): one for one in plan_episodes(settings, theta, settings.seed)}
        episode = episodes.get((str(row.get("agent")), str(row.get("episode", 0))))
        if episode is None:
            starts = f"episode 0 to {settings.starts - 1}"
            raise InputError(f"{where}: is no episode of this study; its agents are {settings.agents}, {starts}")
        scored = {metric.name: float(row.get(metric.name, float("nan"))) for metric in settings.metrics}
        if lacks := [name for name, value in scored.items() if not math.isfinite(value)]:
            raise InputError(f"{where}: has no finite '{lacks[0]}'")
        found.append(Outcome(episode, scored, "", 0.0))
    return found


def _arguments(simulate: Simulate) -> frozenset[str]:
    """Names of the arguments that a function takes; none where nobody says."""
    try:
        return frozenset(inspect.signature(simulate).parameters)
    except ValueError:
        return frozenset()
