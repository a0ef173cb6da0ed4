"""The lessons of several families as a file, so that they can be shown again without running any code."""

import json
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any, cast

from proxytune.drafts import draft_of
from proxytune.errors import StoreError
from proxytune.learning.plv import Estimate
from proxytune.settings import is_finite
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
    except (OSError, ValueError, KeyError, TypeError, AttributeError, OverflowError, RecursionError):
        raise StoreError(f"{path}: is not as proxytune writes it; delete it, and run the study again") from None


def _lesson(kept: Mapping[str, Any]) -> Lesson:
    estimates = {name: None if kept[name] is None else _estimate(**kept[name]) for name in ESTIMATES}
    theta = {str(name): _number(value) for name, value in kept["theta"].items()}
    return Lesson(theta, _or_none(kept["zero_shot"]), failure=str(kept["failure"]), **estimates)


def _estimate(value: object, low: object, high: object) -> Estimate:
    return Estimate(_or_none(value), _or_none(low), _or_none(high))


def _or_none(value: object) -> float | None:
    return None if value is None else _number(value)


def _number(value: object) -> float:
    if type(value) not in (int, float) or not is_finite(cast(float, value)):
        raise ValueError("not a number")
    return float(cast(float, value))


def _file(settings: StudySettings) -> Path:
    return settings.folder / FAMILIES / "lessons.json"
