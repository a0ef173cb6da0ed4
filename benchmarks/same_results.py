"""Compare what two checkouts of proxytune compute on one machine, to the last bit.

    python benchmarks/same_results.py BEFORE AFTER [--only PART …] [--keep DIR] [--tables DIR]

BEFORE and AFTER are folders of checkouts, or commits of this repository. Each part runs commands of the command line
and public names of `import proxytune` in a folder of its own, once per checkout and with the same interpreter, and
collects what they print and write. There are no golden files: these numbers depend on the machine's linear algebra.
The exit status is 1 where something differs, or cannot be run.

With --keep, answers are kept by what code, robots and studies of a checkout are, so that BEFORE is computed once;
without it, a checkout compared with itself shows what chance decides.
"""

import argparse
import contextlib
import functools
import hashlib
import json
import math
import os
import re
import resource
import shutil
import sqlite3
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from html.parser import HTMLParser
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from results_to_compare import PARTS, Part

REPOSITORY = Path(__file__).resolve().parent.parent
ROOMS = ("proxytune", "robots", "studies", "benchmarks/truths")
"""Folders of a checkout that its answers depend on."""
LEFT_OUT = {
    "took_s": "how long a part took",
    "seconds": "how long it took",
    "seconds_per_episode": "how long it took",
    "seconds_per_episode_interval": "how long it took",
    "seconds_per_family": "how long it took",
    "cheapest": "which simulator was the fastest",
}
"""Keys of JSON that differ by nature, at any depth, and what they say."""
PROGRESS = re.compile(r"^\d+ s: ")
"""A line that is left out: it comes by the clock."""
MASKED = {
    r"\d{4}-\d\d-\d\d[T ]\d\d:\d\d(:\d\d(\.\d+)?)?": "a time of day",
    r"(?<![\w.])[\d.]+ (s|ms|min|h|seconds?|minutes?) of episodes": "how long it took",
    r"Cheapest: .*?\.(?= Next:|$)": "which simulator was the fastest",
    r"[\d.]+ of [\d.]+ s were spent": "how long it took",
    r"(?<=episodes )\([\d.]+ (ms|s|min|h)\)|(?<=episode )\([\d.]+ (ms|s|min|h)\)": "how long it would have taken",
}
"""Parts of text that differ by nature, and what they say."""
UNREAD = {
    ".db": "study.db: its format changes; what it holds is read by `study` and `plot`",
    ".npz": "kept lessons and examinations: named by digests of the code",
    ".pkl": "a pickle names classes; its numbers are read by skopt.load",
    ".lock": "empty",
    ".pyc": "made by Python",
}
"""Files that are not compared, and why."""
PICTURES = {".png", ".svg", ".pdf", ".gif", ".jpg", ".mp4"}
SHOWN = 5
"""Differences of a part that are printed."""

Answers = dict[str, Any]


class CannotRunError(Exception):
    """A command of a part ended otherwise than it should."""


class VisibleText(HTMLParser):
    """The text of a page, without markup, scripts and styles."""

    def __init__(self, page: str) -> None:
        super().__init__()
        self.lines: list[str] = []
        self._hidden = 0
        self.feed(page)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """Enter what is not shown."""
        self._hidden += tag in ("script", "style")

    def handle_endtag(self, tag: str) -> None:
        """Leave it."""
        self._hidden -= tag in ("script", "style")

    def handle_data(self, data: str) -> None:
        """Keep a text that is shown."""
        if not self._hidden and data.strip():
            self.lines.append(" ".join(data.split()))


class Place:
    """A folder in which one checkout answers one part.

    Attributes:
        folder: The folder; every command runs in it, so that paths in answers are the same in both checkouts.
        checkout: Whose code runs.
        tables: A folder of score tables, if there is one.
        answers: What commands have printed, by the command.
    """

    def __init__(self, folder: Path, checkout: Path, tables: Path | None) -> None:
        self.folder, self.checkout, self.tables = folder, checkout, tables
        self.answers: Answers = {}
        self._given: dict[str, str] = {}

    def run(self, command: str, *, status: int | None = 0) -> Any:
        """Run a command of `python -m proxytune` and keep what it prints; give its JSON document, or lines.

        Args:
            command: What follows `python -m proxytune`.
            status: The exit status that it must have; None where any will do.

        Raises:
            CannotRunError: If it ends with another status.
        """
        return self._run(command, ["-m", "proxytune", *command.split()], status)

    def python(self, name: str, code: str, *arguments: str) -> Any:
        """Run a script in this folder, which may `import proxytune`, and keep what it prints.

        Raises:
            CannotRunError: If it fails.
        """
        return self._run(name, ["-c", code, *arguments], 0)

    def shipped(self, study: str, name: str = "", **settings: Any) -> None:
        """Copy a study of the checkout, wherever it keeps it, and set keys of its study.toml."""
        copy = self.folder / (name or study)
        leave = shutil.ignore_patterns("figures", "report.html", "study.db*", "teaching", "__pycache__")
        homes = (self.checkout / room / study for room in ("studies", "benchmarks"))
        shutil.copytree(next(home for home in homes if home.is_dir()), copy, ignore=leave)
        for path in copy.rglob("study.toml"):
            path.write_text(edited(path.read_text(encoding="utf-8"), settings), encoding="utf-8")
        self._remember(copy)

    def write(self, path: str, text: str) -> None:
        """Write a file that the part needs."""
        file = self.folder / path
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(text, encoding="utf-8")
        self._remember(file.parent)

    def gather(self) -> Answers:
        """What was printed, and what was written by the commands."""
        written = {}
        for path in sorted(self.folder.rglob("*")):
            name = path.relative_to(self.folder).as_posix()
            if path.is_file() and path.suffix not in UNREAD and self._given.get(name) != digest_of(path):
                written[name] = self._content(path)
        return {"printed": self.answers, "written": written}

    def _run(self, name: str, arguments: list[str], status: int | None) -> Any:
        # Checkouts until 24 November 2026 ask before they run code
        own = {"PYTHONPATH": str(self.checkout), "XDG_STATE_HOME": f"{self.folder}.state", "PROXYTUNE_TRUST": "1"}
        quiet = {"NO_COLOR": "1", "COLUMNS": "120", "MPLBACKEND": "Agg", "OMP_NUM_THREADS": "1"}
        environment = {**os.environ, **own, **quiet}
        call = [sys.executable, *arguments]
        done = subprocess.run(call, cwd=self.folder, env=environment, capture_output=True, text=True, check=False)
        if status is not None and done.returncode != status:
            last = (done.stderr.strip() or done.stdout.strip() or "nothing said").splitlines()[-1]
            raise CannotRunError(f"{name}: exit status {done.returncode}: {last}")
        said: Any = self._lines(done.stdout)
        with contextlib.suppress(ValueError):
            said = json.loads(done.stdout)
        self.answers[name] = {"status": done.returncode, "said": said, "remarks": self._lines(done.stderr)}
        return said

    def _content(self, path: Path) -> Any:
        if path.suffix in PICTURES:
            return digest_of(path)
        if path.suffix == ".sqlite3":
            with contextlib.closing(sqlite3.connect(path)) as database:
                return self._lines("\n".join(database.iterdump()))
        try:
            text = path.read_text(encoding="utf-8")
        except UnicodeDecodeError:
            return digest_of(path)
        if path.suffix == ".html":
            return self._lines("\n".join(VisibleText(text).lines))
        return json.loads(text) if path.suffix == ".json" else self._lines(text)

    def _lines(self, text: str) -> list[str]:
        for path, name in ((self.folder, "PLACE"), (self.checkout, "CHECKOUT")):
            text = text.replace(str(path), name)
        return [line for line in text.splitlines() if not PROGRESS.match(line)]

    def _remember(self, folder: Path) -> None:
        files = (path for path in folder.rglob("*") if path.is_file())
        self._given |= {path.relative_to(self.folder).as_posix(): digest_of(path) for path in files}


def edited(text: str, settings: dict[str, Any]) -> str:
    """A study.toml with other values; a key TABLE__NAME is of a table, a new one is added on top of its table."""
    for key, value in settings.items():
        table, _, name = key.rpartition("__")
        head, start, body = text.partition(f"[{table}]\n") if table else ("", "", text)
        if not start and table:
            continue
        own, mark, rest = body.partition("\n[")
        line = f"{name} = {json.dumps(value)}"
        own, found = re.subn(rf"^{name} = .*$", line, own, flags=re.MULTILINE)
        text = "".join((head, start, "" if found else f"{line}\n", own, mark, rest))
    return text


def digest_of(path: Path) -> str:
    """A digest of a file's bytes."""
    return hashlib.sha256(path.read_bytes()).hexdigest()


def code_of(checkout: Path) -> str:
    """A digest of all that a checkout's answers depend on, whatever its commit."""
    files = (path for room in ROOMS for path in (checkout / room).rglob("*") if path.is_file())
    leave = ("figures", "__pycache__", "teaching")
    kept = sorted(p for p in files if not set(leave) & set(p.parts) and ".db" not in p.suffix and p.suffix != ".md")
    parts = [(path.relative_to(checkout).as_posix(), digest_of(path)) for path in kept]
    return hashlib.sha256(repr(parts).encode()).hexdigest()[:16]


def answers_of(part: Part, checkout: Path, keep: Path | None, tables: Path | None) -> Answers:
    """What a checkout answers to a part: kept from before, or computed now; `failure` says why it cannot."""
    kept = keep / code_of(checkout) / f"{part.name}-{part.version}.json" if keep else None
    if kept and kept.exists():
        return json.loads(kept.read_text(encoding="utf-8"))
    with tempfile.TemporaryDirectory() as folder:
        place = Place(Path(folder).resolve() / "place", checkout, tables)
        place.folder.mkdir()
        began = time.monotonic()
        try:
            part.ask(place)
        except CannotRunError as problem:
            return {"failure": str(problem)}
        except (LookupError, TypeError, ValueError, OSError, StopIteration) as problem:
            return {"failure": f"an answer is not what the part expects: {type(problem).__name__}: {problem}"}
        answers = {**place.gather(), "took_s": round(time.monotonic() - began, 1)}
    if kept:
        kept.parent.mkdir(parents=True, exist_ok=True)
        draft = kept.with_suffix(".part")
        draft.write_text(json.dumps(answers, indent=1), encoding="utf-8")
        draft.replace(kept)
    return answers


def differences(before: Any, after: Any, path: str = "") -> Iterator[tuple[str, Any, Any]]:
    """Where two documents differ, with what stands there, but for keys that are left out."""
    if isinstance(before, dict) and isinstance(after, dict):
        for key in [*before, *(key for key in after if key not in before)]:
            if key not in LEFT_OUT:
                yield from differences(before.get(key, "(none)"), after.get(key, "(none)"), f"{path}/{key}")
    elif isinstance(before, list) and isinstance(after, list) and len(before) == len(after):
        for number, (one, other) in enumerate(zip(before, after, strict=True)):
            yield from differences(one, other, f"{path}/{number}")
    elif isinstance(before, list) and isinstance(after, list):
        both = zip([*before, "(none)"], [*after, "(none)"], strict=False)
        number, one, other = next((n, a, b) for n, (a, b) in enumerate(both) if list(differences(a, b)))
        yield f"{path}/{number} (of {len(before)} and {len(after)})", one, other
    elif not same(before, after):
        yield path, before, after


def same(before: Any, after: Any) -> bool:
    """Two values are of one kind and equal to the last bit, but for text that is masked; 0.0 is not -0.0."""
    if isinstance(before, float) and isinstance(after, float):
        if math.isnan(before) or math.isnan(after):
            return math.isnan(before) and math.isnan(after)
        return before.hex() == after.hex()
    if isinstance(before, str) and isinstance(after, str):
        for pattern in MASKED:
            before, after = re.sub(pattern, "…", before), re.sub(pattern, "…", after)
    return type(before) is type(after) and bool(before == after)


def report(part: Part, before: Answers, after: Answers) -> bool:
    """Print one part's line, and the first of its differences; tell whether both answered the same."""
    failures = [
        f"{side}: {said['failure']}" for side, said in (("before", before), ("after", after)) if "failure" in said
    ]
    if failures:
        print(f"{part.name}: cannot be run: {'; '.join(failures)}", flush=True)
        return False
    found = [one for one in differences(before, after) if not re.search(part.leaves_out, one[0])]
    took = f"{before['took_s']:g} s, {after['took_s']:g} s"
    if not found:
        print(f"{part.name}: same ({count(before)} values; {took})", flush=True)
        return True
    print(f"{part.name}: differs in {len(found)} of {count(before)} values ({took})", flush=True)
    for path, one, other in found[:SHOWN]:
        print(f"    {path}: {brief(one)} → {brief(other)}", flush=True)
    return False


def count(document: Any) -> int:
    """How many values a document holds that are compared."""
    if isinstance(document, dict):
        return sum(count(value) for key, value in document.items() if key not in LEFT_OUT)
    return sum(map(count, document)) if isinstance(document, list) else 1


def brief(value: Any) -> str:
    """A value in at most 90 characters."""
    text = json.dumps(value, ensure_ascii=False)
    return text if len(text) <= 90 else f"{text[:87]}…"


@contextlib.contextmanager
def checkout_of(name: str) -> Iterator[Path]:
    """The folder of a checkout: one that is there, or a commit of this repository, checked out for a while."""
    if (Path(name) / "proxytune").is_dir():
        yield Path(name).resolve()
        return
    with tempfile.TemporaryDirectory() as folder:
        tree = Path(folder).resolve() / "checkout"
        git = ["git", "-C", str(REPOSITORY), "worktree"]
        added = subprocess.run([*git, "add", "--detach", str(tree), name], capture_output=True, text=True, check=False)
        if added.returncode:
            sys.exit(f"same_results: '{name}' is neither a checkout's folder nor a commit: {added.stderr.strip()}")
        try:
            yield tree
        finally:
            subprocess.run([*git, "remove", "--force", str(tree)], check=False)


def chosen(names: list[str] | None) -> list[Part]:
    """The parts of these names, or those whose names begin with one."""
    wanted = [part for part in PARTS if not names or any(part.name.startswith(name) for name in names)]
    if not wanted:
        sys.exit(f"same_results: no such part; known are: {', '.join(part.name for part in PARTS)}")
    return wanted


def main() -> int:
    """Compare two checkouts part by part."""
    parser = argparse.ArgumentParser(description="Compare what two checkouts compute on one machine, to the last bit.")
    parser.add_argument("before", help="folder of a checkout, or a commit of this repository")
    parser.add_argument("after", help="the same; the same again computes and keeps one side")
    parser.add_argument("--only", nargs="+", metavar="PART", help="parts, by the beginning of their names [all]")
    parser.add_argument("--keep", type=Path, metavar="DIR", help="keep answers here, by code and part, and read them")
    parser.add_argument("--tables", type=Path, metavar="DIR", help="score tables, NAME/proxy.csv and NAME/target.csv")
    parser.add_argument("--jobs", type=int, default=1, metavar="N", help="how many parts are asked at a time [1]")
    asked = parser.parse_args()
    began, equal, skipped = time.monotonic(), [], 0
    with checkout_of(asked.before) as before, checkout_of(asked.after) as after, ThreadPoolExecutor(asked.jobs) as pool:
        parts = chosen(asked.only)
        missing = {part.name: why for part in parts if (why := why_not(part, asked.tables))}
        sides = [before] if asked.keep and code_of(before) == code_of(after) else [before, after]
        ask = functools.partial(pool.submit, answers_of)
        answers = [
            (part, [ask(part, side, asked.keep, asked.tables) for side in sides])
            for part in parts
            if part.name not in missing
        ]
        for name, why in missing.items():
            print(f"{name}: skipped: {why}")
            skipped += 1
        equal = [report(part, told[0].result(), told[-1].result()) for part, told in answers]
    total = f"{sum(equal)} of {len(equal)} parts are the same" + (f", {skipped} skipped" if skipped else "")
    spent = resource.getrusage(resource.RUSAGE_CHILDREN)
    print(f"{total}; {time.monotonic() - began:.0f} s, {spent.ru_utime + spent.ru_stime:.0f} s of one core")
    return 0 if all(equal) else 1


def why_not(part: Part, tables: Path | None) -> str:
    """Why a part cannot be asked here, or nothing."""
    absent = [module for module in part.needs if not find_spec(module)]
    if absent:
        return f"needs {', '.join(absent)}, not installed"
    if part.tables and not (tables and tables.is_dir()):
        return "needs score tables; give their folder by --tables"
    return ""


if __name__ == "__main__":
    sys.exit(main())
