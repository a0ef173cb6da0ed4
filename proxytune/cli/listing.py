"""`list`: the known robots, maps, effects, agents, metrics, engines and measures of usefulness."""

import argparse
from collections.abc import Callable, Mapping
from pathlib import Path

from rich.table import Table

from proxytune.cli.terminal import Answer
from proxytune.driving import AGENTS, METRICS, lane_length, load_agent, map_names, read_robot, robot_names, shipped_map
from proxytune.effects import DECLARED, SHIPPED
from proxytune.errors import InputError
from proxytune.extensions import plugins
from proxytune.search import ENGINE_NAMES, ENGINES, engine_of, is_installed
from proxytune.study import measure_of
from proxytune.usefulness import MEASURES, PODS

Row = dict[str, object]


def configure(parser: argparse.ArgumentParser) -> None:
    """Add what can be listed."""
    parser.add_argument("kind", choices=list(_KINDS), help="what to list")


def run(arguments: argparse.Namespace) -> Answer:
    """List one kind of thing."""
    rows = _KINDS[arguments.kind]()
    table = Table(box=None, pad_edge=False)
    for column in rows[0]:
        table.add_column(column.replace("_", " "), overflow="fold")
    for row in rows:
        table.add_row(*(_cell(value) for value in row.values()))
    return Answer({arguments.kind: rows}, table)


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
            "install": "" if is_installed(engine) or not engine.needs else f"proxytune[{engine.needs.extra}]",
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
