"""Strict reading of TOML settings: every complaint is one line with file, key and what to do."""

import contextlib
import difflib
import errno
import math
import os
import re
import stat
import tomllib
import unicodedata
from collections.abc import ItemsView, Iterable, Iterator, KeysView, Mapping
from dataclasses import dataclass
from numbers import Integral, Real
from pathlib import Path
from types import MappingProxyType
from typing import Any

from proxytune.errors import InputError, SettingsError

PIPES = ("/dev/stdin", "/dev/fd/", "/proc/self/fd/")
"""Where a shell puts what another command prints."""
LARGEST = "PROXYTUNE_LARGEST_MB"
"""The environment variable that raises every limit of sizes [MB]."""
TEXT_MB, SETTINGS_MB = 500, 20
"""Of a table, and of TOML: what reads them takes many times as much memory."""
MOST_DOTS = 100
"""In one key: the time to read a dotted key grows with the square of its parts."""
GEOMETRY: Mapping[str, str] = MappingProxyType(
    {"wheel_radius_m": "wheel_radius", "baseline_m": "effective_baseline", "full_speed_m_s": "full_speed"}
)
"""Keys of log.toml and model.toml for a robot's figures, and what its robot.toml calls these."""
SIZES: Mapping[str, tuple[float, float, str]] = {
    "wheel_radius": (0.002, 1.5, "m"),
    "effective_baseline": (0.01, 6.0, "m"),
    "wheel_distance": (0.01, 6.0, "m"),
    "full_speed": (0.005, 40.0, "m/s"),
    "camera_height": (0.002, 10.0, "m"),
    "mass": (0.005, 2e4, "kg"),
}
"""Of anything that drives on wheels, from the smallest robot on a table to a lorry."""


def nearest(name: str, known: Iterable[str]) -> str:
    """A hint that ends an error line: the nearest known name, or all of them."""
    names = sorted(known)
    close = difflib.get_close_matches(name, names, n=1)
    return f"did you mean '{close[0]}'?" if close else f"known are: {', '.join(names)}"


def alike_caution(what: str, names: Iterable[str]) -> str:
    """The caution about different names of something, as "agents", that read the same; empty if none do.

    They may differ by Unicode form, by blanks and what is not seen at all, or in how a number is written.
    """
    known: dict[object, str] = {}
    pairs = []
    for name in dict.fromkeys(names):
        seen = "".join(letter for letter in name if unicodedata.category(letter) != "Cf")
        key: object = " ".join(unicodedata.normalize("NFKC", seen).split())
        with contextlib.suppress(ValueError):
            key = float(name) if name.isascii() and "_" not in name else key
        first = known.setdefault(key, name)
        if first != name:
            pairs.append(f"{first!a} and {name!a}")
    told = f"{pairs[0]} (and {len(pairs) - 1} more pairs)" if len(pairs) > 1 else "".join(pairs)
    return f"{what} {told} read the same and are taken for different ones; write them alike" if pairs else ""


def figure_cautions(figures: Mapping[str, float], where: str) -> tuple[str, ...]:
    """Sentences on a robot's figures, by robot.toml's names for them, that are probably in another unit."""
    return tuple(
        f"{where}: its {name} is {figures[name]:.4g} {unit}, and robots have {low:g} to {high:g} {unit}; check that"
        for name, (low, high, unit) in SIZES.items()
        if name in figures and not low <= figures[name] <= high
    )


@dataclass(frozen=True)
class Section:
    """One table of a settings file, which answers for its keys' types and names.

    It reads like a mapping of plain values too: `section["key"]`, `"key" in section`, `section.get("key", 1.0)`,
    `dict(section)`. `section.values` is that mapping itself.

    Every method raises SettingsError with file, key and remedy.
    """

    path: Path
    name: str
    values: Mapping[str, Any]

    def __getitem__(self, key: str) -> Any:
        return self._get(key, None)

    def __iter__(self) -> Iterator[str]:
        return iter(self.values)

    def __contains__(self, key: object) -> bool:
        return key in self.values

    def __len__(self) -> int:
        return len(self.values)

    def keys(self) -> KeysView[str]:
        """The keys of this table."""
        return self.values.keys()

    def items(self) -> ItemsView[str, Any]:
        """The keys with their plain values."""
        return self.values.items()

    def get(self, key: str, default: Any = None) -> Any:
        """The plain value of a key, or the default where it is missing."""
        return self.values.get(key, default)

    def error(self, key: str, problem: str) -> SettingsError:
        """The one-line complaint about a key of this section."""
        return SettingsError(f"{self.path}: {self.name}{key}: {problem}")

    def only(self, known: Iterable[str]) -> None:
        """Refuse keys that are not known."""
        names = list(known)
        for key in self.values:
            if key not in names:
                raise self.error(key, f"unknown key; {nearest(key, names)}")

    def number(
        self, key: str, default: float | None = None, *, low: float = -math.inf, high: float = math.inf
    ) -> float:
        """A finite number within bounds."""
        value = self._get(key, default)
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise self.error(key, f"must be a number, got {value!r}")
        if not is_finite(value):
            raise self.error(key, f"must be finite, got {value}")
        if not low <= value <= high:
            raise self.error(key, f"must be between {low:g} and {high:g}, got {value}")
        return float(value)

    def whole(self, key: str, default: int | None = None, *, low: int = 0, high: int = 2**53) -> int:
        """A whole number within bounds."""
        value = self._get(key, default)
        if isinstance(value, bool) or not isinstance(value, int):
            raise self.error(key, f"must be a whole number, got {value!r}")
        if not low <= value <= high:
            raise self.error(key, f"must be between {low} and {high}, got {value}")
        return value

    def flag(self, key: str, default: bool) -> bool:
        """True or false."""
        value = self.values.get(key, default)
        if not isinstance(value, bool):
            raise self.error(key, f"must be true or false, without quotes, got {value!r}")
        return value

    def text(self, key: str, default: str | None = None, *, choices: Iterable[str] = ()) -> str:
        """A piece of text, one of the choices where there are any."""
        value = self._get(key, default)
        if not isinstance(value, str):
            raise self.error(key, f"must be text in quotes, got {value!r}")
        self._check_letters(key, value)
        names = list(choices)
        if names and value not in names:
            raise self.error(key, f"unknown value '{value}'; {nearest(value, names)}")
        return value

    def file(self, key: str, name: str | None = None) -> Path:
        """The file that a key names, by its text or by one of its texts, from this file's folder on."""
        path = self.path.parent / (self.text(key) if name is None else name)
        try:
            path.stat()
        except OSError as problem:
            # Of all else that may be wrong, whoever reads the file tells
            if problem.errno == errno.ENAMETOOLONG:
                raise self.error(key, "no file can have so long a name; shorten it") from None
        return path

    def texts(self, key: str, default: tuple[str, ...] | None = None) -> tuple[str, ...]:
        """A list of distinct texts."""
        value = self._get(key, None if default is None else list(default))
        if not isinstance(value, list) or not all(isinstance(item, str) for item in value):
            raise self.error(key, f"must be a list of texts in quotes, got {value!r}")
        for item in value:
            self._check_letters(key, item)
        if len(set(value)) < len(value):
            raise self.error(key, "names something twice")
        return tuple(value)

    def bounds(self, key: str) -> tuple[float, float]:
        """A pair of finite numbers, the lower one first."""
        value = self._get(key, None)
        pair = value if isinstance(value, list) and len(value) == 2 else None
        if pair is None or not all(isinstance(v, int | float) and not isinstance(v, bool) for v in pair):
            raise self.error(key, f"must be [low, high], got {value!r}")
        if not (is_finite(pair[0]) and is_finite(pair[1])):
            raise self.error(key, f"bounds must be finite, got {value!r}")
        low, high = float(pair[0]), float(pair[1])
        if low >= high:
            raise self.error(key, f"the lower bound must be below the upper one, got {value!r}")
        return low, high

    def section(self, key: str) -> "Section":
        """The table under this key, empty where it is missing."""
        value = self.values.get(key, {})
        if not isinstance(value, dict):
            raise self.error(key, f"must be a table, written [{self.name}{key}], got {value!r}")
        return Section(self.path, f"{self.name}{key}.", value)

    def _check_letters(self, key: str, text: str) -> None:
        if "\0" in text:
            raise self.error(key, f"must not contain the character NUL, got {text!r}")

    def _get(self, key: str, default: Any) -> Any:
        if key in self.values:
            return self.values[key]
        if default is None:
            raise self.error(key, "is missing; add it")
        return default


def read_settings(path: Path) -> Section:
    """Read a TOML file; a SettingsError if it is missing, unreadable or not TOML."""
    try:
        text = read_text(path, "utf-8-sig", usual_mb=SETTINGS_MB)
        for number, line in enumerate(text.splitlines(), start=1):
            if line.count(".") > MOST_DOTS and max(part.count(".") for part in re.split("[,=]", line)) > MOST_DOTS:
                raise ValueError(f"a key of more than {MOST_DOTS} parts (at line {number})")
        return Section(path, "", tomllib.loads(text))
    except FileNotFoundError:
        raise SettingsError(f"{path}: no such file; check the path") from None
    except OSError as problem:
        raise SettingsError(f"{path}: cannot be read ({problem.strerror}); check the path") from None
    except UnicodeDecodeError:
        raise SettingsError(f"{path}: is no text in UTF-8; save it as that") from None
    except RecursionError:
        raise SettingsError(f"{path}: is nested too deeply; write fewer brackets in one another") from None
    except ValueError as problem:  # TOML that is none, or numbers of more digits than Python reads.
        raise SettingsError(f"{path}: is not valid TOML: {problem}") from None


def read_text(path: Path, encoding: str = "utf-8", usual_mb: float = TEXT_MB) -> str:
    """The text of a file, or of what another command prints.

    Raises:
        OSError: If `check_end` refuses it, or it cannot be read.
        UnicodeDecodeError: If it is no text.
    """
    check_end(path, usual_mb)
    return path.read_text(encoding=encoding)


NO_CSV = "is not a CSV file; save it as comma-separated text (UTF-8)"


def pairs_in(option: str, text: str, shape: str) -> dict[str, str]:
    """Values by name of an option, NAME=VALUE,NAME=VALUE; an InputError at other shapes, or a name given twice."""
    pairs: dict[str, str] = {}
    for part in filter(None, map(str.strip, text.split(","))):
        name, _, value = map(str.strip, part.partition("="))
        if not (name and value):
            raise InputError(f"{option} {part}: write {shape}")
        if name in pairs:
            raise InputError(f"{option} {text}: names '{name}' twice; give each once")
        pairs[name] = value
    return pairs


def numbers_in(option: str, text: str, shape: str) -> dict[str, float]:
    """Numbers by name of an option, one at least; other than these it is refused as pairs are."""
    try:
        numbers = {name: float(value) for name, value in pairs_in(option, text, shape).items()}
    except ValueError:
        numbers = {}
    if not numbers:
        raise InputError(f"{option} {text}: write {shape}")
    return numbers


def table_text(path: Path, kind: type[InputError], *, missing: str = "check the path", no_text: str = NO_CSV) -> str:
    """The text of a table; whatever keeps it from being read is a complaint of this kind, in one line."""
    try:
        return read_text(path, "utf-8-sig")
    except FileNotFoundError:
        raise kind(f"{path}: no such file; {missing}") from None
    except OSError as problem:
        raise kind(f"{path}: cannot be read ({problem.strerror})") from None
    except UnicodeDecodeError:
        raise kind(f"{path}: {no_text}") from None


def check_end(path: Path, usual_mb: float = TEXT_MB) -> None:
    """Refuse a file that has no end, or is larger than allowed: a few kilobytes of a disk may hold gigabytes.

    Raises:
        OSError: If it is a device, a named pipe or larger than that, or is not there.
        InputError: If what is to raise the limit is no number.
    """
    try:
        found = path.stat()
    except ValueError as problem:  # A character that no path has.
        raise OSError(errno.EINVAL, str(problem), str(path)) from None
    if not (stat.S_ISREG(found.st_mode) or path.is_dir() or str(path).startswith(PIPES)):
        raise OSError(errno.EINVAL, "it is a device or a pipe, not a file", str(path))
    if found.st_size > (most := allowed_bytes(usual_mb)):
        size = f"it has {found.st_size / 1e6:.0f} MB, of {most / 1e6:.0f} MB at most"
        remedy = f"if it is meant, allow as much by the environment variable {LARGEST}={int(found.st_size / 1e6) + 1}"
        raise OSError(errno.EFBIG, f"{size}; {remedy}", str(path))


def allowed_bytes(usual_mb: float) -> float:
    """The bytes that something may have, or unpack to; an InputError if what raises the limit is no number."""
    stated = os.environ.get(LARGEST, "0")
    try:
        return 1e6 * max(usual_mb, float(stated))
    except ValueError:
        raise InputError(f"{LARGEST}={stated}: must be a number of megabytes, as in {LARGEST}=4000") from None


def check_whole(name: str, given: object, low: int = 0) -> None:
    """Refuse an argument that is no whole number, or too low a one, by an InputError."""
    if not isinstance(given, Integral):
        raise InputError(f"{name} must be a whole number, got {given!r}")
    if given < low:
        raise InputError(f"{name} must be at least {low}, got {given}")


def check_numbers(theta: Mapping[Any, object], where: str = "θ") -> None:
    """Refuse a θ with a value that is no number, by an InputError."""
    for name, given in theta.items():
        if isinstance(given, bool) or not isinstance(given, Real):
            raise InputError(f"{where}: {name} must be a number, got {given!r}")


def is_finite(value: float) -> bool:
    """True if a number is finite as a float; a whole number may have too many digits."""
    try:
        return math.isfinite(value)
    except OverflowError:
        return False
