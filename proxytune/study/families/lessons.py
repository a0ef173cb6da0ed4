"""The lessons of several families as a file, so that they can be shown again without running any code."""

import json
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

from proxytune.drafts import draft_of
from proxytune.errors import StoreError
from proxytune.learning.plv import Estimate
from proxytune.storage.own_files import FAMILIES
from proxytune.study.families.compared import Lesson
from proxytune.study.settings import StudySettings

ESTIMATES = ("needed", "plv", "more")


def save_lessons(settings: StudySettings, lessons: Mapping[str, Lesson]) -> None:
    """Write what each family is worth as a teacher into the folder of all.

    Raises:
        StoreError: If it cannot be written.
    """
    path = _file(settings)
    text = json.dumps({name: asdict(one) for name, one in lessons.items()}, indent=2, allow_nan=False) + "\n"
    try:
        with draft_of(path) as draft:
            draft.write_text(text, encoding="utf-8")
    except OSError as problem:
        raise StoreError(f"{path}: cannot be written ({problem.strerror}); make room and run again") from None


def read_lessons(settings: StudySettings) -> dict[str, Lesson]:
    """What was written; none where nothing was.

    Raises:
        StoreError: If the file is none that we wrote.
    """
    path = _file(settings)
    try:
        return {name: _lesson(one) for name, one in json.loads(path.read_bytes()).items()}
    except FileNotFoundError:
        return {}
    except (OSError, ValueError, KeyError, TypeError, AttributeError, RecursionError):
        raise StoreError(f"{path}: is not as proxytune writes it; delete it, and run the study again") from None


def _lesson(kept: Mapping[str, Any]) -> Lesson:
    estimates = {name: None if kept[name] is None else Estimate(**kept[name]) for name in ESTIMATES}
    theta = {str(name): float(value) for name, value in kept["theta"].items()}
    zero_shot = None if kept["zero_shot"] is None else float(kept["zero_shot"])
    return Lesson(theta, zero_shot, failure=str(kept["failure"]), **estimates)


def _file(settings: StudySettings) -> Path:
    return settings.folder / FAMILIES / "lessons.json"
