"""Stages of a diagnosis, kept as facts, so that one that was killed goes on where it was.

Each stage is a function of what came before, of the log, the robot, the options and our code. All of these have one
digest, under which the results of stages lie; with another digest they are other results. What is read again is the
same to the last bit: each file begins with a digest of what follows. Files are pickles of numbers and of our own
classes alone: nothing else is made of them when they are read, for a folder of findings may be a stranger's. Robots,
drives and pictures are not in them, but what stands for these.
"""

import contextlib
import dataclasses
import io
import pickle
import shutil
from collections.abc import Callable, Mapping
from enum import Enum
from hashlib import sha256
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

import proxytune
from proxytune.diagnosis.answer import Progress
from proxytune.driving import Robot
from proxytune.errors import RunError
from proxytune.files import write_whole
from proxytune.identity import digest, meaning_of, meaning_of_code, versions_of

Result = TypeVar("Result")

ROOMS = ("logs", "effects", "driving", "diagnosis")
"""Rooms whose code a diagnosis depends on."""
FOLDER = ".stages"
"""Where stages lie in the folder of the findings until these are written."""
MAKERS = {
    ("numpy", "ndarray"),
    ("numpy", "dtype"),
    ("numpy.core.multiarray", "_reconstruct"),
    ("numpy.core.multiarray", "scalar"),
    ("numpy._core.multiarray", "_reconstruct"),
    ("numpy._core.multiarray", "scalar"),
    ("numpy._core.numeric", "_frombuffer"),
    ("numpy.core.numeric", "_frombuffer"),
    ("functools", "partial"),
}
"""What arrays are made by, and what binds SIGNALS to curves."""
SIGNALS = "proxytune.diagnosis.motion.signals"
"""Functions of this module only reckon."""


def facts_of(robot: Robot, *things: object) -> str:
    """A digest of all that a diagnosis depends on: the robot, logs, pictures, options, and what our code means."""
    package = Path(proxytune.__file__).parent
    code = meaning_of((path for room in ROOMS for path in (package / room).rglob("*.py")), package)
    effects = [(name, meaning_of_code(robot.catalogue.effect(name))) for name in robot.catalogue.names]
    body = robot.urdf and robot.urdf.read_bytes()
    built = (robot.name, robot.drive, robot.reverse, body, robot.figures, robot.theta)
    return digest(_plain((things, built, effects, code, versions_of(("numpy", "scipy", "pybullet", "numba")))))


def _plain(value: Any) -> object:
    """A value without arrays, which are told by their bytes."""
    if isinstance(value, np.ndarray):
        return value.shape, str(value.dtype), digest(value.tobytes().hex())
    if dataclasses.is_dataclass(value):
        return tuple(_plain(getattr(value, field.name)) for field in dataclasses.fields(value))
    if isinstance(value, Mapping):
        return sorted((name, _plain(one)) for name, one in value.items())
    return tuple(map(_plain, value)) if isinstance(value, tuple | list) else value


class Stages:
    """Keeps results of stages in the folder of findings, if there is one; a symbolic link in their place is refused.

    What is `known` is not written: results refer to it by name.
    """

    def __init__(self, folder: Path | None, facts: str, report: Progress = lambda _: None, **known: Any) -> None:
        self._folder = None if folder is None else folder / FOLDER / facts
        self._report, self._known = report, known
        if folder is not None and (folder / FOLDER).is_symlink():
            raise RunError(f"{folder / FOLDER}: is a symbolic link; remove it, or give another folder")

    def keep(self, stage: str, make: Callable[[], Result]) -> Result:
        """The result of a stage, made if it is not kept."""
        if self._folder is None:
            return make()
        path = self._folder / f"{stage}.pickle"
        if path.exists():
            with contextlib.suppress(Exception):
                known, content = path.read_bytes().split(b"\n", 1)
                if known == _digest_of(content):
                    return _Reader(io.BytesIO(content), self._known).load()  # type: ignore[no-any-return]
            self._report(f"{path}: is damaged; it is made again")
        result, written = make(), io.BytesIO()
        _Writer(written, self._known).dump(result)
        content = written.getvalue()
        write_whole(path, lambda draft: draft.write_bytes(_digest_of(content) + b"\n" + content))
        return result


def forget_stages(folder: Path) -> None:
    """Remove the stages of a diagnosis whose findings are written."""
    shutil.rmtree(folder / FOLDER, ignore_errors=True)


def _digest_of(content: bytes) -> bytes:
    return sha256(content).hexdigest().encode()


class _Writer(pickle.Pickler):
    def __init__(self, file: io.BytesIO, known: Mapping[str, Any]) -> None:
        super().__init__(file, protocol=5)
        self._names = {id(thing): name for name, thing in known.items()}

    def persistent_id(self, thing: Any) -> str | None:
        return self._names.get(id(thing))


class _Reader(pickle.Unpickler):
    def __init__(self, file: io.BytesIO, known: Mapping[str, Any]) -> None:
        super().__init__(file)
        self._known = known

    def persistent_load(self, name: str) -> Any:
        return self._known[name]

    def find_class(self, module: str, name: str) -> Any:
        """Find numbers and our own classes of values; nothing else is made."""
        if (module, name) in MAKERS:
            return super().find_class(module, name)
        found = super().find_class(module, name) if module.startswith("proxytune.") and "." not in name else None
        if isinstance(found, type) and (dataclasses.is_dataclass(found) or issubclass(found, tuple | Enum)):
            return found
        if module == SIGNALS and getattr(found, "__module__", "") == SIGNALS:
            return found
        raise pickle.UnpicklingError(f"{module}.{name} is no value of a stage")
