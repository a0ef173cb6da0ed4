"""`list`: the known robots, maps, effects, agents, metrics, engines, measures, learners and families.

Of what code makes, a user's own is told by its name, module:attribute of the current folder.
"""

import argparse
import inspect
from collections.abc import Callable, Collection, Mapping, Sequence
from pathlib import Path

from rich.console import Group
from rich.text import Text

from proxytune.cli.terminal import Answer
from proxytune.driving import AGENTS, METRICS, lane_length, load_agent, map_names, read_robot, robot_names, shipped_map
from proxytune.effects import SHIPPED, Catalogue
from proxytune.errors import InputError, to_install
from proxytune.extensions import load, plugins
from proxytune.report import Table, clause_of, columns_of, plain, table_text, what_it_does
from proxytune.search import ENGINE_NAMES, ENGINES, engine_of, is_installed
from proxytune.settings import nearest
from proxytune.study import measure_of
from proxytune.usefulness import MEASURES, PODS

Row = dict[str, object]
Names = tuple[str, ...]
"""One's own thing that was asked for, as module:attribute; none where all of a kind are to be told."""


def run(arguments: argparse.Namespace) -> Answer:
    """List one kind of thing, or tell all of one."""
    kind, name = arguments.kind, arguments.name
    shipped = name in LEARNERS or name in FAMILIES
    own = (name,) if name and ":" in name and kind in BY_MODULE and not shipped else ()
    rows = _KINDS[kind](own)
    key = next(iter(rows[0]))
    if name is not None:
        known, rows = dict.fromkeys(str(row[key]) for row in rows), [row for row in rows if name in (row[key], *own)]
        if not rows:
            raise InputError(f"list {kind}: no '{name}'; {nearest(name, known)}")
        lines = (f"{column.replace('_', ' ')}: {_cell(value)}" for row in rows for column, value in row.items())
        return Answer({kind: rows}, _effect_text(name, own) if kind == "effects" else Group(*map(Text, lines)))
    if kind == "effects":
        return Answer({kind: rows}, _effects_text())
    heads = columns_of([column.replace("_", " ") for column in rows[0]])
    return Answer({kind: rows}, table_text(Table("", heads, tuple(tuple(map(_cell, row.values())) for row in rows))))


def _effects_text() -> Group:
    """A row per effect: what it does, and its parameters with their units; those of a car in a table of their own."""
    tables, heads = [], columns_of(("effect", "what it does", "parameters [unit]"))
    for catalogue, names in _known_effects().items():
        rows = []
        for name in names:
            parameters = catalogue.effect(name).parameters
            units = ", ".join(f"{one.name} [{one.unit}]" if one.unit else one.name for one in parameters)
            rows.append((f"{name}{'*' * (name in catalogue.declared)}", what_it_does(name, catalogue), units))
        title = "" if catalogue is SHIPPED else "Of a car, in place of those on wheels"
        tables.append(table_text(Table(title, heads, tuple(rows))))
    return Group(*tables, Text("* declared by default: the θ of the paper. All of one: list effects NAME"))


def _known_effects(own: Names = ()) -> Mapping[Catalogue, Sequence[str]]:
    """The effects by whom they are for: all of a robot on two wheels, and those that a car has otherwise or alone."""
    if own:
        return {Catalogue(Path.cwd()): own}
    cars = Catalogue(drive="ackermann")
    of_cars = [name for name, effect in cars.shipped.items() if SHIPPED.shipped.get(name) is not effect]
    return {SHIPPED: SHIPPED.names, cars: of_cars}


def _effect_text(name: str, own: Names) -> Group:
    """All of one effect, on wheels and of a car."""
    lines = []
    for catalogue in (one for one, names in _known_effects(own).items() if name in names):
        effect, of = catalogue.effect(name), "" if catalogue.drive == "differential" else "\nof a car: "
        lines += [f"{of}{name}: {inspect.cleandoc(effect.__doc__ or '')}", f"\nstage: {effect.stage.value}"]
        for theta_name, one in zip(catalogue.theta_names(name), effect.parameters, strict=True):
            unit = f" {one.unit}".rstrip()
            neutral = f"the robot's {plain(one.neutral)}" if isinstance(one.neutral, str) else f"{one.neutral:g}{unit}"
            usual = f" (of most robots {one.usual[0]:g} to {one.usual[1]:g})" if one.usual else ""
            still = f"{neutral} where it is not given" if one.shape else f"without effect at {neutral}"
            lines.append(f"\n{theta_name}, {one.low:g} to {one.high:g}{unit}{usual}, {still}")
            facts = {"meaning": clause_of(theta_name, one.name.upper()), "source": one.source}
            lines += [f"  {what}: {said}" for what, said in facts.items() if said]
    return Group(*map(Text, lines))


def _cell(value: object) -> str:
    return f"{value:g}" if isinstance(value, float) else str(value)


def _robots(own: Names) -> list[Row]:
    here, rows = Path.cwd(), list[Row]()
    for name in robot_names(here):
        try:
            robot = read_robot(name, here)
            rows.append({"name": name, "description": robot.description, "mass_kg": robot.figures.get("mass", "")})
        except InputError as problem:  # One that names code, or is damaged, hides no other
            rows.append({"name": name, "description": f"cannot be read: {problem}", "mass_kg": ""})
    return rows


def _maps(own: Names) -> list[Row]:
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


def _effects(own: Names) -> list[Row]:
    rows: list[Row] = []
    for catalogue, name in ((one, name) for one, names in _known_effects(own).items() for name in names):
        effect = catalogue.effect(name)
        for theta_name, parameter in zip(catalogue.theta_names(name), effect.parameters, strict=True):
            row: Row = {"effect": name, "stage": effect.stage.value, "parameter": theta_name, "unit": parameter.unit}
            first, last = parameter.usual_range
            row |= {"low": parameter.low, "high": parameter.high, "usual_low": first, "usual_high": last}
            row |= {"neutral": parameter.neutral, "shape": "yes" if parameter.shape else ""}
            row |= {"declared": "yes" if name in catalogue.declared else ""}
            rows.append(row | {"source": parameter.source, "of": "" if catalogue.drive == "differential" else "car"})
    return rows


def _agents(own: Names) -> list[Row]:
    rows: list[Row] = [] if own else [{"name": name, "how_it_drives": str(agent)} for name, agent in AGENTS.items()]
    for name, code in _outside("agent", own, AGENTS).items():
        agent = load_agent(name, Path.cwd())
        plain = type(agent).__repr__ is object.__repr__ and type(agent).__str__ is object.__str__
        rows.append({"name": name, "how_it_drives": _first_line(agent, code) if plain else str(agent)})
    return rows


def _outside(kind: str, own: Names, shipped: Collection[str] = ()) -> Mapping[str, str]:
    """What is not shipped, by name with where its code is: what was asked for, else every plug-in."""
    return {name: name for name in own} or {name: point.value for name, point in plugins(kind, shipped).items()}


def _first_line(found: object, otherwise: str) -> str:
    """The first line of a docstring, where there is one."""
    return (inspect.getdoc(found) or otherwise).partition("\n")[0]


def _described(kind: str, own: Names, shipped: Mapping[str, str], told: str) -> list[Row]:
    known = {} if own else dict(shipped)
    for name, code in _outside(kind, own, shipped).items():
        known[name] = _first_line(load(name, kind=kind, beside=Path.cwd()), code)
    return [{"name": name, told: said} for name, said in known.items()]


def _engines(own: Names) -> list[Row]:
    outside = [engine_of(name, Path.cwd()) for name in _outside("engine", own, ENGINE_NAMES)]
    return [
        {
            "name": engine.name,
            "label": engine.label,
            "learns_from": engine.learns_from,
            "of_studies": "yes" if engine.in_studies else "",
            "install": "" if is_installed(engine) or not engine.needs else to_install(engine.needs.extra),
            "what_it_proposes": engine.summary,
        }
        for engine in (*(() if own else ENGINES), *outside)
    ]


def _measures(own: Names) -> list[Row]:
    shipped = {measure.key: measure for measure in (*MEASURES, *PODS)}
    outside = {name: measure_of(name, Path.cwd()) for name in _outside("measure", own, shipped)}
    return [
        {
            "name": measure.name,
            "key": key,
            "spelt_out": measure.title,
            "better": measure.better,
            "unit": measure.unit,
            "per_metric": "yes" if measure.per_metric else "",
        }
        for key, measure in (outside if own else shipped | outside).items()
    ]


LEARNERS = {
    "proxytune.learning.cloning:BehaviourCloning": "a neural network on a picture of few cells, trained by Adam",
    "proxytune.learning.ridge:RandomFeatures": "ridge regression on random Fourier features of such a picture",
}
"""Those shipped, as study.toml names them; loading them takes as long as scikit-learn does."""
FAMILIES = {
    "proxytune.driving.family:lane_following": "robots that follow a lane; what a study has that names none",
    "proxytune.environments.family:gymnasium_family": "an environment of Gymnasium",
}
BY_MODULE = ("effects", "agents", "engines", "measures", "learners", "families")
"""Kinds of which one's own is named as module:attribute."""
_KINDS: Mapping[str, Callable[[Names], list[Row]]] = {
    "robots": _robots,
    "maps": _maps,
    "effects": _effects,
    "agents": _agents,
    "metrics": lambda own: [{"name": name, "unit": unit} for name, unit in METRICS.items()],
    "engines": _engines,
    "measures": _measures,
    "learners": lambda own: _described("learner", own, LEARNERS, "how_it_learns"),
    "families": lambda own: _described("family", own, FAMILIES, "what_it_simulates"),
}
