"""The forms in which evaluators have their scores, all made rows of one table: texts by column.

- LeRobot's eval_info.json, or a folder of them: a row per rollout, the agent being the folder's name;
- dictionaries {task: {agent: score}}, as JSON or as literals in a Python file (SIMPLER's metrics.py), which is not run;
- one table for both sides, as "Sim success (%)" beside "Real success (%)": each side takes its own column;
- counts ("18 of 25", "18/25", or success beside n), a row per rollout then; per cent; "0.61 ± 0.05", or a column
  "success se" with standard errors.
"""

import ast
import fnmatch
import json
import math
import re
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, Literal

from proxytune.errors import ScoresError
from proxytune.settings import nearest, read_text

Side = Literal["proxy", "target"]
Line = tuple[int, list[str]]
LABELS = ("agent", "episode", "domain")
WORDS: dict[str, Side] = {
    **dict.fromkeys(("sim", "simulated", "simulation", "simulator", "proxy", "predicted"), "proxy"),
    **dict.fromkeys(("real", "robot", "target", "hardware", "physical"), "target"),
}
"""Words in a column's name that say whose it is."""
AGENTS = ("policy", "model", "method", "checkpoint")
"""Other names of the column of agents, in any case."""
COUNTS = ("n", "trials", "rollouts", "n trials", "n rollouts", "num trials", "n episodes")
ERRORS = ("se", "sem", "stderr", "std error", "standard error")
MOST_ROLLOUTS = 100_000
NUMBER = r"[-−+]?\d*[.,]?\d+(?:[eE][-+]?\d+)?"
OF = re.compile(r"(\d{1,9})\s*(?:/|of|out of)\s*(\d{1,9})")
CELL = re.compile(rf"({NUMBER})\s*(%?)(?:\s*(?:±|\+/-|\+-)\s*({NUMBER})\s*(%?))?\s*(%?)")


def is_form(path: Path) -> bool:
    """True of what is no table of cells: a folder, JSON or Python."""
    return path.is_dir() or path.suffix.lower() in (".json", ".py")


def form_rows(path: Path, domain: str | None = None) -> tuple[list[str], list[Line]]:
    """The columns and rows of a folder, a JSON file or a Python file, of which `domain` is the dictionary."""
    if path.is_dir():
        if not (files := sorted(path.glob("*/eval_info.json")) or sorted(path.glob("*.json"))):
            raise ScoresError(f"{path}: cannot be read, a folder without AGENT/eval_info.json; name a table")
        return _table(path, [row for file in files for row in _json_rows(file)])
    if path.suffix.lower() == ".py":
        return _table(path, _nested(path, _literal(path, domain)))
    return _table(path, _json_rows(path))


def _json_rows(path: Path) -> list[dict[str, Any]]:
    try:
        found = json.loads(read_text(path, "utf-8-sig"), object_pairs_hook=_each_once)
    except (OSError, UnicodeDecodeError, ValueError, RecursionError) as problem:
        raise ScoresError(f"{path}: is not readable as JSON ({str(problem)[:80]})") from None
    if isinstance(found, list) and found and all(isinstance(row, dict) for row in found):
        return found
    if not isinstance(found, dict):
        raise ScoresError(f"{path}: holds no scores; give LeRobot's eval_info.json, or {{task: {{agent: score}}}}")
    agent = path.parent.name if path.stem == "eval_info" else path.stem
    if isinstance(found.get("per_episode"), list):
        return [_episode(path, agent, row, place) for place, row in enumerate(found["per_episode"])]
    if isinstance(found.get("per_task"), list):
        return [row for task in found["per_task"] for row in _task(path, agent, task)]
    if {"aggregated", "overall"} & set(found):
        raise ScoresError(f"{path}: has no 'per_episode' and no 'per_task'; its aggregates alone say nothing of noise")
    return _nested(path, found)


def _each_once(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    """An object of JSON; a name twice would drop a score."""
    if twice := [name for name, count in Counter(name for name, _ in pairs).items() if count > 1]:
        raise ValueError(f"'{twice[0]}' twice in one object")
    return dict(pairs)


def _episode(path: Path, agent: str, row: object, place: int) -> dict[str, Any]:
    if not isinstance(row, dict):
        raise ScoresError(f"{path}: per_episode, entry {place}: must hold the scores of an episode by name")
    plain = {name: value for name, value in row.items() if isinstance(value, bool | int | float)}
    seed = row.get("seed")
    return plain | {"agent": agent, "episode": place if seed is None else seed}


def _task(path: Path, agent: str, task: object) -> Iterator[dict[str, Any]]:
    """Rows of a task: what it has a list of, a value an episode."""
    metrics = task.get("metrics") if isinstance(task, dict) else None
    if not (isinstance(task, dict) and isinstance(metrics, dict)):
        raise ScoresError(f"{path}: per_task: each must have task_group, task_id and metrics")
    names = {"successes": "success", "sum_rewards": "sum_reward", "max_rewards": "max_reward"}
    lists = {names[key]: value for key, value in metrics.items() if key in names and isinstance(value, list)}
    if not lists or len({len(values) for values in lists.values()}) != 1:
        raise ScoresError(f"{path}: per_task: metrics must have lists of one length, as 'successes'")
    label = f"{task.get('task_group', 'task')}_{task.get('task_id', 0)}"
    for place, values in enumerate(zip(*lists.values(), strict=True)):
        yield {"agent": agent, "episode": f"{label}/{place}", **dict(zip(lists, values, strict=True))}


def _nested(path: Path, found: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Rows of {task: {agent: score}}: one an agent, a column a task."""
    rows: dict[str, dict[str, Any]] = {}
    for task, scores in found.items():
        if not isinstance(scores, dict):
            raise ScoresError(f"{path}: '{str(task)[:40]}' holds no scores by agent; give {{task: {{agent: score}}}}")
        for agent, score in scores.items():
            rows.setdefault(str(agent), {"agent": agent})[str(task)] = score
    return list(rows.values())


def _literal(path: Path, name: str | None) -> Mapping[str, Any]:
    """A dictionary that is written out in a Python file; nothing is run."""
    try:
        tree = ast.parse(read_text(path, "utf-8-sig"))
    except (OSError, UnicodeDecodeError, SyntaxError, ValueError, RecursionError) as problem:
        raise ScoresError(f"{path}: is not readable as Python ({type(problem).__name__})") from None
    known: dict[str, Mapping[str, Any]] = {}
    for node in tree.body:
        if isinstance(node, ast.Assign) and isinstance(node.value, ast.Dict) and isinstance(node.targets[0], ast.Name):
            try:
                known[node.targets[0].id] = ast.literal_eval(node.value)
            except (ValueError, TypeError):
                continue
    if name is None and len(known) == 1:
        return next(iter(known.values()))
    if not known:
        raise ScoresError(f"{path}: has none that is written out, {{task: {{agent: score}}}}")
    if name not in known:
        choices = f"has the dictionaries {', '.join(known)}"
        asked = f"no dictionary '{name}'; {nearest(name, known)}" if name else choices
        raise ScoresError(f"{path}: {asked}; choose one, as in {path}:{next(iter(known), 'NAME')}")
    return known[name]


def _table(path: Path, rows: Sequence[Mapping[str, Any]]) -> tuple[list[str], list[Line]]:
    header = list(dict.fromkeys(str(name) for row in rows for name in row))
    if not rows or len(header) < 2:
        raise ScoresError(f"{path}: holds no scores")
    return header, [(place + 1, [_text(row.get(name)) for name in header]) for place, row in enumerate(rows)]


def _text(value: object) -> str:
    if isinstance(value, bool):
        return str(int(value))
    return "" if value is None else str(value).strip()


def agent_column(header: Sequence[str]) -> str | None:
    """The column that names the agents under another name: the only one that has such a name."""
    found = [name for name in header if name.lower() in AGENTS]
    return found[0] if len(found) == 1 else None


def own_column(metric: str, header: Sequence[str], side: Side | None) -> str | None:
    """The column of a metric: of its very name, or of that name with side and unit; None if there is none."""
    if metric in header:
        return metric
    whose = [(name, *_plain(name)) for name in header]
    alike = [(name, of) for name, plain, of in whose if plain == _plain(metric)[0]]
    own = [name for name, of in alike if of == side] or [name for name, of in alike if of is None]
    return own[0] if len(own) == 1 else None


def _plain(name: str) -> tuple[str, Side | None]:
    """A column's name without unit and side, and the side."""
    words = re.sub(r"[(\[].*?[)\]]|%", " ", name.lower()).replace("_", " ").replace("-", " ").split()
    sides = [WORDS[word] for word in words if word in WORDS]
    rest = [word for word in words if word not in WORDS]
    return (" ".join(rest), sides[0]) if len(sides) == 1 and rest else (" ".join(words), None)


def both_metrics(header: Sequence[str]) -> list[str]:
    """The names, without side and unit, of what a table has a column of for either side."""
    sides: dict[str, set[Side]] = {}
    for name in header:
        plain, of = _plain(name)
        if of is not None and plain not in (*COUNTS, *ERRORS):
            sides.setdefault(plain, set()).add(of)
    return [name for name, known in sides.items() if len(known) == 2]


def beside(metric: str, header: Sequence[str], side: Side | None) -> tuple[str | None, str | None]:
    """The columns of rollouts and of standard errors that belong to a metric, where there are some."""
    names = COUNTS, [f"{_plain(metric)[0]} {word}" for word in ERRORS]
    counts, errors = (next(filter(None, (own_column(name, header, side) for name in some)), None) for some in names)
    return (None if counts == metric else counts), errors


Read = tuple[float, float | None, tuple[int, int] | None]
"""A mean, its standard error, and successes of rollouts; the latter two where they are known."""


def read_cell(text: str, in_percent: bool) -> Read | None:
    """What a cell says; None if it is a plain number, or nothing that is known here."""
    counts = OF.fullmatch(text)
    if counts is not None:
        done, of = int(counts[1]), int(counts[2])
        return (done / of, None, (done, of)) if 0 < of <= MOST_ROLLOUTS and done <= of else None
    found = CELL.fullmatch(text)
    if found is None or not (in_percent or "%" in text or found[3]):
        return None
    scale = 100.0 if in_percent or "%" in text else 1.0
    mean, error = (
        float(part.replace("−", "-").replace(",", ".")) / scale if part else None for part in (found[1], found[3])
    )
    return None if mean is None else (mean, error, None)


def counted(value: float, rollouts: str, where: str) -> tuple[int, int]:
    """Successes of rollouts, from a share or a number of successes beside the number of rollouts."""
    try:
        of = int(rollouts)
    except ValueError:
        raise ScoresError(f"{where}: the number of rollouts must be a whole number, got {rollouts!r}") from None
    within = 1 <= of <= MOST_ROLLOUTS
    done = value * of if within and value <= 1.0 and not (value == 1.0 and of == 1) else value
    if not within or not 0 <= done <= of:
        raise ScoresError(f"{where}: {value:g} successes of {of} rollouts cannot be; check both columns")
    if not math.isclose(done, round(done), abs_tol=0.05 + 0.005 * of):
        raise ScoresError(f"{where}: {value:g} of {of} rollouts is no whole number of successes; check both columns")
    return round(done), of


def expand(metrics: Sequence[str], header: Sequence[str]) -> list[str]:
    """Metrics as NAME:max with patterns in names, as *:max, replaced by the columns that they fit."""
    found = []
    for text in metrics:
        name, _, rest = text.partition(":")
        fit = fnmatch.filter([one for one in header if one not in LABELS], name) if {"*", "?"} & set(name) else []
        found += [f"{one}:{rest}" for one in fit] or [text]
    return list(dict.fromkeys(found))


def check_sides(where: str, header: Sequence[str], metrics: Sequence[str]) -> None:
    """Refuse to compare a column of a table with itself."""
    for name in metrics:
        own = {own_column(name, header, side) for side in ("proxy", "target")}
        if len(own) == 1 and None not in own:
            remedy = "name the sides in the columns, as 'Sim success' and 'Real success', or give two tables"
            raise ScoresError(f"{where}: the column '{own.pop()}' would be both proxy and target; {remedy}")
