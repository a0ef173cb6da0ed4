"""`list`: the robots, maps, effects, agents and metrics there are."""

import argparse
from collections.abc import Callable, Mapping

from rich.table import Table

from proxytune.cli.answer import Answer
from proxytune.driving.agents import AGENTS
from proxytune.driving.road.lane import lane_length
from proxytune.driving.road.reading import map_names, shipped_map
from proxytune.driving.robot import read_robot, robot_names
from proxytune.driving.task import METRICS
from proxytune.effects import CATALOGUE, DECLARED, theta_names

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
    robots = [read_robot(name) for name in robot_names()]
    return [
        {"name": robot.name, "description": robot.description, "mass_kg": robot.figures.get("mass", "")}
        for robot in robots
    ]


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
    for name, effect in CATALOGUE.items():
        for theta_name, parameter in zip(theta_names(effect), effect.parameters, strict=True):
            row: Row = {"effect": name, "stage": effect.stage.value, "parameter": theta_name, "unit": parameter.unit}
            row |= {"low": parameter.low, "high": parameter.high, "neutral": parameter.neutral}
            rows.append(row | {"declared": "yes" if name in DECLARED else "", "source": parameter.source})
    return rows


def _agents() -> list[Row]:
    return [{"name": name, "how_it_drives": str(agent)} for name, agent in AGENTS.items()]


def _metrics() -> list[Row]:
    return [{"name": name, "unit": unit} for name, unit in METRICS.items()]


_KINDS: Mapping[str, Callable[[], list[Row]]] = {
    "robots": _robots,
    "maps": _maps,
    "effects": _effects,
    "agents": _agents,
    "metrics": _metrics,
}
