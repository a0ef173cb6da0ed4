"""A loop, checked before anything is driven; its held-out agents; and its steps, which are kept.

Held-out agents are those that no tuning sees: how well a tuned proxy orders them is what the loop is judged by. A step
whose output is there, made from inputs of the same digest, is not done again.
"""

import hashlib
import json
import os
from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from proxytune import study
from proxytune.api import recordable
from proxytune.domain import DomainFamily, Episode
from proxytune.driving import AGENTS, LaneFollowing
from proxytune.errors import InputError, LogError, RunError, SettingsError, StoreError
from proxytune.importing import Facts, open_log
from proxytune.logs import Log
from proxytune.report import write_text
from proxytune.running import Silent, Watcher
from proxytune.scores import ScoreTable, read_scores
from proxytune.seeds import fresh_seed
from proxytune.space import Theta
from proxytune.storage import Store, locked
from proxytune.usefulness import Assessment, assess, floor_of_repeats

KEY = "held_out"
FEWEST = 3
"""Of fewer agents PRPV says nothing."""


def held_out_of(settings: study.StudySettings, family: DomainFamily, *, driven: bool) -> tuple[str, ...]:
    """The agents that study.toml holds out, else shipped ones that it does not use; empty where they are too few.

    Where the target is not driven, only agents that its table has can be held out. One that study.toml names is refused
    if it is tuned on, or has no rank.
    """
    named, scored = settings.held_out, scored_agents(settings)
    used = {*settings.agents, *settings.loaded_agents}
    for name in named:
        if name in used:
            raise settings.error(KEY, f"'{name}' is among the agents that are tuned on; take it out of one of them")
        if name not in scored and not driven:
            raise settings.error(KEY, f"the target's table has no scores of '{name}'; measure them, or take it out")
    if named and len(named) < FEWEST:
        raise settings.error(KEY, f"names {len(named)} of at least {FEWEST} agents; add some, or take the key out")
    if driven:  # A family that names its agents otherwise is asked without its guard.
        scored = tuple(AGENTS) if isinstance(study.bare_family(settings, settings.proxy), LaneFollowing) else ()
    found = named or tuple(name for name in scored if name not in used and _is_known(family, name))
    return found if len(found) >= FEWEST else ()


def scored_agents(settings: study.StudySettings) -> tuple[str, ...]:
    """The agents that the target's table has."""
    if not all(path.is_file() for path in settings.targets):
        return ()
    metrics = [metric.name for metric in settings.metrics]
    return read_scores(settings.targets, metrics, columns=settings.target_columns).agents


def _is_known(family: DomainFamily, name: str) -> bool:
    try:
        family.check_agent(name)
    except InputError:
        return False
    return True


def held_out_settings(
    settings: study.StudySettings, names: tuple[str, ...], target: Path | None = None
) -> study.StudySettings:
    """The study with these agents instead, and the target's scores of them from another file if one is given."""
    known = replace(settings, agents=names)
    return known if target is None else replace(known, targets=(target,), target_columns={})


def drive_held_out(
    opened: study.Study, settings: study.StudySettings, theta: Theta, watcher: Watcher
) -> tuple[Assessment, int]:
    """Drive held-out agents in an instance, twice from each start: its assessment, and the episodes driven now."""
    held = replace(opened, settings=settings, target=study.read_target(settings, opened.family)[0])
    seeds = [fresh_seed(settings.seed, repetition) for repetition in (1, 2)]
    with locked(opened.settings.folder), Store.open(opened.settings.folder) as store:
        run = study.StudyRun(held, store, watcher)
        once, again = (_scores(run, study.plan_episodes(settings, theta, seed)) for seed in seeds)
    # The second time is for the noise floor: what the instance scores against itself.
    floor = floor_of_repeats(domain=once, again=again, metrics=settings.metrics)
    return assess(proxy=once, target=held.target, metrics=settings.metrics, floor=floor), run.spent.episodes


def _scores(run: study.StudyRun, planned: list[Episode]) -> ScoreTable:
    outcomes = list(run.outcomes(planned, "held-out agents").values())
    worked = {outcome.episode.agent for outcome in outcomes if outcome.metrics is not None}
    for outcome in outcomes:
        if outcome.episode.agent not in worked:
            raise RunError(f"held out: {study.failure_of(outcome)}; name other agents under {KEY} in study.toml")
    return study.score_table(outcomes)


HOME = "loop"
"""The folder of a loop, in that of its study."""


@dataclass(frozen=True)
class Loop:
    """A loop to be closed; the twin is a simulated target's model.toml, recorded where there is no log."""

    settings: study.StudySettings
    family: DomainFamily
    robot: str
    twin: Path | None
    log: Path | None
    held_out: tuple[str, ...]

    @property
    def home(self) -> Path:
        """The folder of all that the loop makes."""
        return self.settings.folder / HOME

    @property
    def facts(self) -> Facts:
        """The study's robot and map, which a source that is no log's folder does not say."""
        road = self.settings.domain.get("map", "small_loop")
        return Facts(self.robot, road=str(self.settings.folder.resolve() / road) if road.endswith(".toml") else road)


def open_loop(path: Path, twin: Path | None = None, log: Path | None = None) -> Loop:
    """Read a study and check it, its twin (its `truth` if not given), its log and its held-out agents.

    An InputError if one of them cannot be used, a StoreError if the loop's folder cannot be written.
    """
    settings = study.read_study_settings(path)
    if settings.families or settings.family_name:
        raise settings.error("families", "`loop` is of one family; give it a study without this table")
    if settings.objective == study.LEARNING:
        raise settings.error("objective", "`loop` tunes by scores; give it a study with another objective than 'plv'")
    if not settings.budget:
        nothing = "is 0, and of the proxy with what is found nothing is known without a trial; make it 1 or more"
        raise settings.error("budget", nothing)
    family = study.load_family(settings, settings.proxy)
    robot = getattr(family, "robot", None)
    if not isinstance(robot, str):
        raise settings.error("family", "`loop` diagnoses a robot's log, and this family names no robot")
    twin = _twin(settings, twin, robot)
    loop = Loop(settings, family, robot, twin, log, held_out_of(settings, family, driven=twin is not None))
    for name in loop.held_out:
        with settings.complaints_about(KEY):
            family.check_agent(name)
    _check_log(loop)
    try:
        loop.home.mkdir(exist_ok=True)
    except OSError as problem:
        raise StoreError(f"{loop.home}: cannot be written ({problem.strerror}); copy the study elsewhere") from None
    if not os.access(loop.home, os.W_OK):
        raise StoreError(f"{loop.home}: cannot be written (permission denied); copy the study elsewhere")
    return loop


def _twin(settings: study.StudySettings, given: Path | None, robot: str) -> Path | None:
    """The target's model, whose robot and equipment are the study's."""
    path, named = (given, f"--twin {given}") if given else (settings.truth, f"{settings.path}: truth")
    if path is None:
        return None
    if not path.is_file():
        raise InputError(f"{named}: no such file: {path}; check the path")
    try:
        of_twin = getattr(study.load_family(settings, path), "robot", robot)
    except SettingsError as problem:
        raise SettingsError(f"{named}: {problem}") from None
    if of_twin != robot:
        raise InputError(f"{named}: is of the robot '{of_twin}', the study of '{robot}'; give a model of '{robot}'")
    return path


def _check_log(loop: Loop) -> None:
    """Refuse a log of another robot, or none where nothing can be recorded."""
    if loop.log is None:
        if loop.twin is None:
            raise InputError(
                f"{loop.settings.path}: the target is no simulator; give a log of it by --log LOG, or its model.toml "
                "by --twin or the key truth"
            )
        recordable(loop.settings, loop.twin)
        return
    with open_log(loop.log, facts=loop.facts) as (log, _):
        if log.robot != loop.robot:
            theirs = f"is of the robot '{log.robot}', the study of '{loop.robot}'"
            raise LogError(f"{loop.log}: {theirs}; give a log of '{loop.robot}'")


FILE_NAME = "loop.json"


class Teller:
    """Hears how a loop goes, and tells nobody."""

    def say(self, line: str) -> None:
        """A step begins, or there is something to be known at once."""

    def episodes(self, total: int) -> AbstractContextManager[Watcher]:
        """So many episodes at most are driven."""
        return nullcontext(Silent())

    def diagnosis(self, log: Log) -> AbstractContextManager[Callable[[str], None]]:
        """A log is diagnosed; gives what hears of each step of that."""
        return nullcontext(lambda step: None)


class Kept:
    """The done steps of a loop, in loop.json: each step's digest of its inputs, written once its output is there."""

    def __init__(self, folder: Path) -> None:
        """Read what is known."""
        self._path, self.inputs = folder / FILE_NAME, dict[str, str]()
        try:
            steps = json.loads(self._path.read_text(encoding="utf-8"))["steps"]
            self.inputs |= {str(name): str(inputs) for name, inputs in steps.items()}
        except FileNotFoundError:
            pass
        except (OSError, ValueError, KeyError, TypeError, AttributeError, RecursionError):
            raise StoreError(f"{self._path}: cannot be read; remove it to do every step again") from None

    def has(self, name: str, inputs: str, output: Path) -> bool:
        """True if a step is done: its output is there, and made of inputs of this digest."""
        return self.inputs.get(name) == inputs and output.exists()

    def run(self, name: str, inputs: str, do: Callable[[], object]) -> None:
        """Do a step, which makes its output of inputs of this digest."""
        self._write({known: digest for known, digest in self.inputs.items() if known != name})
        do()
        self._write({**self.inputs, name: inputs})

    def _write(self, inputs: dict[str, str]) -> None:
        # Until a step has been done again, what is left of its old output counts as none.
        if inputs != self.inputs:
            write_text(self._path, json.dumps({"format": 1, "steps": inputs}, indent=2) + "\n")
        self.inputs = inputs


def digest(*parts: Any) -> str:
    """A digest of plain values."""
    return hashlib.sha256(json.dumps(parts, sort_keys=True, default=str).encode()).hexdigest()[:16]


def digest_of_files(path: Path) -> str:
    """A digest of a file, or of all files in a folder with their names; its hidden and compiled ones are left out."""
    files = [path]
    if not path.is_file():
        found = sorted(one for one in path.rglob("*") if one.is_file())
        files = [one for one in found if not one.name.startswith(".") and one.parent.name != "__pycache__"]
    return digest([(str(one.relative_to(path)), hashlib.sha256(one.read_bytes()).hexdigest()) for one in files])
