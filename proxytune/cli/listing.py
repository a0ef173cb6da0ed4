"""`list`: the known robots, maps, effects, agents, metrics, engines and measures of usefulness."""

import argparse
import inspect
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import NoReturn

from rich.console import Group
from rich.text import Text

from proxytune.cli.options import take_late
from proxytune.cli.terminal import Answer
from proxytune.driving import AGENTS, METRICS, lane_length, load_agent, map_names, read_robot, robot_names, shipped_map
from proxytune.effects import DECLARED, SHIPPED
from proxytune.errors import InputError, to_install
from proxytune.extensions import plugins
from proxytune.report import Table, clause_of, columns_of, plain, table_text, what_it_does
from proxytune.search import ENGINE_NAMES, ENGINES, engine_of, is_installed
from proxytune.settings import nearest
from proxytune.study import measure_of
from proxytune.usefulness import MEASURES, PODS

Row = dict[str, object]


def configure(parser: argparse.ArgumentParser) -> None:
    """Add what can be listed."""
    parser.add_argument("kind", choices=list(_KINDS), help="what to list")
    parser.add_argument("name", nargs="?", metavar="NAME", help="tell all of one [all of the kind, a line each]")
    take_late(parser, "name", str)


def run(arguments: argparse.Namespace) -> Answer:
    """List one kind of thing, or tell all of one.

    Raises:
        InputError: If there is none of that name.
    """
    kind, name, rows = arguments.kind, arguments.name, _KINDS[arguments.kind]()
    key = next(iter(rows[0]))
    if name is not None:
        rows = [row for row in rows if row[key] == name] or _unknown(kind, name, [str(row[key]) for row in rows])
        return Answer({kind: rows}, _effect_text(name) if kind == "effects" else _all_of(rows))
    if kind == "effects":
        return Answer({kind: rows}, _effects_text())
    heads = columns_of([column.replace("_", " ") for column in rows[0]])
    return Answer({kind: rows}, table_text(Table("", heads, tuple(tuple(map(_cell, row.values())) for row in rows))))


def _unknown(kind: str, name: str, names: list[str]) -> NoReturn:
    raise InputError(f"list {kind}: no '{name}'; {nearest(name, dict.fromkeys(names))}")


def _all_of(rows: list[Row]) -> Group:
    return Group(
        *(Text(f"{column.replace('_', ' ')}: {_cell(value)}") for row in rows for column, value in row.items())
    )


def _effects_text() -> Group:
    """A row per effect: what it does, and its parameters with their units."""
    rows = []
    for name in SHIPPED.names:
        parameters = SHIPPED.effect(name).parameters
        units = ", ".join(f"{one.name} [{one.unit}]" if one.unit else one.name for one in parameters)
        rows.append((f"{name}{'*' * (name in DECLARED)}", what_it_does(name), units))
    table = Table("", columns_of(("effect", "what it does", "parameters [unit]")), tuple(rows))
    return Group(table_text(table), Text("* declared by default: the θ of the paper. All of one: list effects NAME"))


def _effect_text(name: str) -> Group:
    """All of one effect."""
    effect = SHIPPED.effect(name)
    lines = [f"{name}: {inspect.cleandoc(effect.__doc__ or '')}", f"\nstage: {effect.stage.value}"]
    for theta_name, one in zip(SHIPPED.theta_names(name), effect.parameters, strict=True):
        unit = f" {one.unit}".rstrip()
        neutral = f"the robot's {plain(one.neutral)}" if isinstance(one.neutral, str) else f"{one.neutral:g}{unit}"
        lines.append(f"\n{theta_name}, {one.low:g} to {one.high:g}{unit}, without effect at {neutral}")
        lines += [f"  meaning: {clause_of(theta_name, one.name.upper())}", f"  source: {one.source}"]
    return Group(*map(Text, lines))


def _cell(value: object) -> str:
    return f"{value:g}" if isinstance(value, float) else str(value)


def _robots() -> list[Row]:
    here, rows = Path.cwd(), list[Row]()
    for name in robot_names(here):
        try:
            robot = read_robot(name, here)
            rows.append({"name": name, "description": robot.description, "mass_kg": robot.figures.get("mass", "")})
        except InputError as problem:  # One that names code, or is damaged, hides no other
            rows.append({"name": name, "description": f"cannot be read: {problem}", "mass_kg": ""})
    return rows


def _maps() -> list[Row]:
    return [
        {
            "name": road.name,
            "description": road.description,
            "outer_lap_m": float(lane_length(road, True)),
            "inner_lap_m": float(lane_length(road, False)),
            "starts": len(road.starts),
        }
        for road in map(shipped_map, map_names())
    ]


def _effects() -> list[Row]:
    rows: list[Row] = []
    for name in SHIPPED.names:
        effect = SHIPPED.effect(name)
        for theta_name, parameter in zip(SHIPPED.theta_names(name), effect.parameters, strict=True):
            row: Row = {"effect": name, "stage": effect.stage.value, "parameter": theta_name, "unit": parameter.unit}
            row |= {"low": parameter.low, "high": parameter.high, "neutral": parameter.neutral}
            rows.append(row | {"declared": "yes" if name in DECLARED else "", "source": parameter.source})
    return rows


def _agents() -> list[Row]:
    own = {name: load_agent(name, Path.cwd()) for name in plugins("agent", AGENTS)}
    return [{"name": name, "how_it_drives": str(agent)} for name, agent in {**AGENTS, **own}.items()]


def _metrics() -> list[Row]:
    return [{"name": name, "unit": unit} for name, unit in METRICS.items()]


def _engines() -> list[Row]:
    own = [engine_of(name) for name in plugins("engine", ENGINE_NAMES)]
    return [
        {
            "name": engine.name,
            "label": engine.label,
            "learns_from": engine.learns_from,
            "of_studies": "yes" if engine.in_studies else "",
            "install": "" if is_installed(engine) or not engine.needs else to_install(engine.needs.extra),
            "what_it_proposes": engine.summary,
        }
        for engine in (*ENGINES, *own)
    ]


def _measures() -> list[Row]:
    shipped = {measure.key: measure for measure in (*MEASURES, *PODS)}
    own = {name: measure_of(name) for name in plugins("measure", shipped)}
    return [
        {
            "name": measure.name,
            "key": key,
            "spelt_out": measure.title,
            "better": measure.better,
            "unit": measure.unit,
            "per_metric": "yes" if measure.per_metric else "",
        }
        for key, measure in {**shipped, **own}.items()
    ]


_KINDS: Mapping[str, Callable[[], list[Row]]] = {
    "robots": _robots,
    "maps": _maps,
    "effects": _effects,
    "agents": _agents,
    "metrics": _metrics,
    "engines": _engines,
    "measures": _measures,
}
