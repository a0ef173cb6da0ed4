"""What a loop is about, checked before anything is driven."""

import os
from dataclasses import dataclass
from pathlib import Path

from proxytune.api.recording import recordable
from proxytune.closing.held_out import check_held_out, held_out_of
from proxytune.domain import DomainFamily
from proxytune.errors import InputError, LogError, SettingsError, StoreError
from proxytune.importing.facts import Facts
from proxytune.importing.opening import open_log
from proxytune.study.family import load_family
from proxytune.study.settings import LEARNING, StudySettings, read_study_settings

HOME = "loop"
"""The folder of a loop, in that of its study."""


@dataclass(frozen=True)
class Loop:
    """A loop to be closed.

    Attributes:
        settings: What study.toml says.
        family: The proxy's domain family.
        robot: The robot that proxy and log are of.
        twin: The model.toml of the target, where that is a simulator.
        log: The target's log, a folder or what `import` reads; None: the twin is recorded.
        held_out: Agents that the tuning does not see.
    """

    settings: StudySettings
    family: DomainFamily
    robot: str
    twin: Path | None
    log: Path | None
    held_out: tuple[str, ...]

    @property
    def home(self) -> Path:
        """Where all is kept that the loop makes."""
        return self.settings.folder / HOME

    @property
    def facts(self) -> Facts:
        """What a source that is no log's folder does not say: the study's robot and map."""
        road = self.settings.domain.get("map", "small_loop")
        return Facts(self.robot, road=str(self.settings.folder.resolve() / road) if road.endswith(".toml") else road)


def open_loop(study: Path, twin: Path | None = None, log: Path | None = None) -> Loop:
    """Read a study and check it, its twin, its log and its held-out agents.

    Args:
        study: The study's folder, or its study.toml.
        twin: The model.toml of the target; the study's `truth` if not given.
        log: The target's log; recorded of the twin if not given.

    Raises:
        InputError: If any of them cannot be used.
        StoreError: If the loop's folder cannot be written.
    """
    settings = read_study_settings(study)
    if settings.families or settings.family_name:
        raise settings.error("families", "`loop` is of one family; give it a study without this table")
    if settings.objective == LEARNING:
        raise settings.error("objective", "`loop` tunes by scores; give it a study with another objective than 'plv'")
    family = load_family(settings, settings.proxy)
    robot = getattr(family, "robot", None)
    if not isinstance(robot, str):
        raise settings.error("family", "`loop` diagnoses a robot's log, and this family names no robot")
    twin = _twin(settings, twin, robot)
    loop = Loop(settings, family, robot, twin, log, held_out_of(settings, family, driven=twin is not None))
    check_held_out(settings, family, loop.held_out)
    _check_log(loop)
    _check_folder(loop.home)
    return loop


def _twin(settings: StudySettings, given: Path | None, robot: str) -> Path | None:
    """The target's model, whose robot and equipment are the study's."""
    path, named = (given, f"--twin {given}") if given else (settings.truth, f"{settings.path}: truth")
    if path is None:
        return None
    if not path.is_file():
        raise InputError(f"{named}: no such file: {path}; check the path")
    try:
        of_twin = getattr(load_family(settings, path), "robot", robot)
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


def _check_folder(home: Path) -> None:
    try:
        home.mkdir(exist_ok=True)
    except OSError as problem:
        raise StoreError(f"{home}: cannot be written ({problem.strerror}); copy the study elsewhere") from None
    if not os.access(home, os.W_OK):
        raise StoreError(f"{home}: cannot be written (permission denied); copy the study elsewhere")
