"""What log.toml says of a log, with every complaint about it at once."""

from collections.abc import Callable
from typing import NamedTuple, TypeVar

from proxytune.errors import LogError, SettingsError
from proxytune.logs.frames import Camera, read_camera
from proxytune.logs.log import COMMANDS, GEOMETRY
from proxytune.settings import Section

TEXTS = ("name", "robot", "pose", "source", "licence", "map", "frames")
KEYS = ("format", *TEXTS, "command", "rate_hz", "clock_offset_s", "measured", "camera", *GEOMETRY)

FIT = "fit"
"""What `clock_offset_s` says where the offset is to be fitted."""

FURTHEST_S = 3600.0
"""Clocks may be declared to be an hour apart, as where one has another time zone's half hour."""

Value = TypeVar("Value")


class Description(NamedTuple):
    """What log.toml says.

    Attributes:
        name: What the log is called.
        robot: Name of the robot.
        command: Kind of the commands.
        rate_hz: Samples per second; 0 where poses have times of their own.
        geometry: Figures of the robot that it states.
        clock_offset_s: How much later poses are stamped than commands [s], or None.
        fit_clock_offset: Whether that is to be fitted.
        camera: What it says of pictures, or None.
    """

    name: str
    robot: str
    command: str
    rate_hz: float
    geometry: dict[str, float]
    clock_offset_s: float | None
    fit_clock_offset: bool
    camera: Camera | None


def read_description(settings: Section) -> Description:
    """Read log.toml.

    Raises:
        LogError: With everything that is wrong, in one line.
    """
    wrong: list[str] = []

    def read(check: Callable[[], Value], otherwise: Value) -> Value:
        try:
            return check()
        except SettingsError as problem:
            wrong.append(str(problem).removeprefix(f"{settings.path}: "))
            return otherwise

    read(lambda: settings.only(KEYS), None)
    read(lambda: settings.whole("format", 1, low=1, high=1), 1)
    read(lambda: settings.flag("measured", True), True)
    for key in (key for key in TEXTS if key not in ("name", "robot")):
        read(lambda key=key: settings.text(key, ""), "")  # type: ignore[misc]
    stated = {name: key for key, name in GEOMETRY.items() if key in settings}
    offset = settings.get("clock_offset_s")
    description = Description(
        name=read(lambda: settings.text("name", settings.path.resolve().parent.name), ""),
        robot=read(lambda: settings.text("robot"), ""),
        command=read(lambda: settings.text("command", choices=COMMANDS), ""),
        rate_hz=read(lambda: _rate(settings), 0.0),
        geometry={name: read(lambda key=key: _figure(settings, key), 1.0) for name, key in stated.items()},  # type: ignore[misc]
        clock_offset_s=None if offset in (None, FIT) else read(lambda: _offset(settings), None),
        fit_clock_offset=offset == FIT,
        camera=read(lambda: read_camera(settings), None),
    )
    if wrong:
        raise LogError(f"{settings.path}: {_listed(wrong)}")
    return description


def _rate(settings: Section) -> float:
    return settings.number("rate_hz", low=0.01, high=10000.0) if "rate_hz" in settings else 0.0


def _figure(settings: Section, key: str) -> float:
    return settings.number(key, low=1e-4, high=1e4)


def _offset(settings: Section) -> float:
    if isinstance(settings["clock_offset_s"], str):
        raise settings.error("clock_offset_s", f'must be seconds, or "{FIT}", got {settings["clock_offset_s"]!r}')
    return settings.number("clock_offset_s", low=-FURTHEST_S, high=FURTHEST_S)


def _listed(wrong: list[str]) -> str:
    different = list(dict.fromkeys(wrong))
    if len(different) == 1:
        return different[0]
    return "; ".join(f"({number}) {problem}" for number, problem in enumerate(different, start=1))
