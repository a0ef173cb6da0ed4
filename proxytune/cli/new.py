"""`new`: a robot, study or family to start from."""

import argparse
import keyword
from importlib.util import find_spec
from pathlib import Path

from rich.text import Text

from proxytune.cli.terminal import Answer
from proxytune.driving import is_robot, read_robot
from proxytune.errors import InputError, RunError
from proxytune.files import folder_draft_of
from proxytune.settings import numbers_in
from proxytune.skeletons import Skeleton, family_skeleton, robot_from_urdf, robot_skeleton, study_skeleton

NARROW = 76
"""Columns of a terminal that are left beside what commands are indented by."""


def run(arguments: argparse.Namespace) -> Answer:
    """Write the skeleton's folder."""
    folder = Path(arguments.name)
    _check(arguments)
    skeleton = _skeleton(arguments)
    try:
        with folder_draft_of(folder) as draft:
            for name, text in skeleton.files.items():
                (draft / name).write_text(text, encoding="utf-8", newline="\n")
    except (FileExistsError, NotADirectoryError):
        raise InputError(f"{folder}: is there already; choose another name, or move it away") from None
    except OSError as problem:
        raise RunError(f"{folder}: cannot be written ({problem.strerror}); choose another place") from None
    files = [str(folder / name) for name in skeleton.files]
    document = {"kind": arguments.kind, "files": files, "notes": list(skeleton.notes), "next": list(skeleton.next)}
    return Answer(document, Text("\n".join([*files, *skeleton.notes, "next:", *map(pasteable, skeleton.next)])))


def pasteable(command: str) -> str:
    """A command that a narrow terminal leaves whole: broken before an option, as a shell reads it."""
    if len(command) <= NARROW or " --" not in command:
        return f"  {command}"
    before, _, options = command.partition(" --")
    return f"  {before} \\\n      --{options}"


def read_figures(text: str | None) -> dict[str, float]:
    """Figures from NAME=VALUE pairs."""
    return numbers_in("--figures", text, "NAME=VALUE,NAME=VALUE with numbers") if text else {}


def _check(arguments: argparse.Namespace) -> None:
    name, kind = arguments.name, arguments.kind
    if not (name.isascii() and name.replace("-", "_").isidentifier()):
        raise InputError(f"'{name}': a name has letters, digits, _ and -, and begins with a letter; it is no path")
    if kind == "family" and "-" in name:
        raise InputError(f"'{name}': a family is a Python module; write _ for -")
    if kind == "family" and (keyword.iskeyword(name) or name.startswith("_")):
        raise InputError(f"'{name}': a family is a Python module that is imported by its name; choose another name")
    spec = find_spec(name) if kind == "family" else None
    if spec is not None and spec.origin:  # A mere folder of this name has none
        raise InputError(f"'{name}': a Python module of this name is installed; choose another name")
    if kind == "robot" and is_robot(name):
        raise InputError(f"'{name}': a robot of this name comes with proxytune; choose another name")
    for option, of in (("figures", "robot"), ("urdf", "robot"), ("drive", "robot"), ("robot", "study")):
        if getattr(arguments, option) is not None and kind != of:
            raise InputError(f"--{option}: is for `new {of}`; leave it out")


def _skeleton(arguments: argparse.Namespace) -> Skeleton:
    if arguments.kind == "family":
        return family_skeleton(arguments.name)
    if arguments.kind == "study":
        return study_skeleton(arguments.name, read_robot(arguments.robot or "duckiebot", Path.cwd()))
    figures = read_figures(arguments.figures)
    drive = arguments.drive or "differential"
    if arguments.urdf is not None:
        return robot_from_urdf(arguments.name, arguments.urdf, figures, drive)
    return robot_skeleton(arguments.name, figures, drive)
