"""A fleet: θ of each robot and p(θ) over them, as sentence, tables, figure, page and JSON document."""

from collections.abc import Mapping
from typing import Any

from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator
from rich.console import Group

from proxytune.report import figure_style as style
from proxytune.report.study.document import estimate_document, intervals_document
from proxytune.report.text import file_texts, group_texts, section_text
from proxytune.report.view import Drawn, Paragraphs, Table, View, columns_of
from proxytune.report.wording import as_known, listed, percent, plain, probability, span, with_unit
from proxytune.report.writing import ABOUT, picture_of
from proxytune.study import FEW, Fleet
from proxytune.usefulness import Estimate

MOST_NAMED = 40
"""More robots than this are not named beside their lines."""
NAME = 14
"""Characters of a robot's name beside its line."""
OWN, GIVEN = "θ of each robot by its own scores", "θ of each robot given the fleet"


def fleet_sentence(fleet: Fleet) -> str:
    """Say in which parameters the robots differ, and by how much."""
    out = f" No θ explains {listed(fleet.left_out)}: left out of p(θ)." if fleet.left_out else ""
    if fleet.population is None:
        return f"Of {len(fleet.robots)} robots {len(fleet.fitting)} can be explained: too few for p(θ).{out}"
    differ = [
        f"{plain(name)} by {_with_interval(spread)} {fleet.units[name]}".rstrip()
        for name, spread in fleet.deviation.items()
        if fleet.varies[name]
    ]
    alike = [plain(name) for name, varies in fleet.varies.items() if not varies]
    told = f"differ in {listed(differ)} (standard deviation)" if differ else "do not differ beyond measurement"
    same = f"; in {listed(alike)} no difference is told" if differ and alike else ""
    return f"{len(fleet.fitting)} robots {told}{same}.{out}"


def fleet_notes(fleet: Fleet) -> tuple[str, ...]:
    """What is to be known beside the tables: cautions of every robot, each once."""
    notes = [line for robot in fleet.robots for line in robot.cautions]
    count = len(fleet.fitting)
    if fleet.population is not None and count < FEW:
        told = f"{count} robots hardly tell a spread: what is assumed before any is measured"
        notes.append(f"{told} (uniform over the box) widens it; measure {FEW} or more")
    for name in fleet.mean:
        if 2 * sum(name in one.knowledge.unidentified for one in fleet.fitting) > count:
            notes.append(f"{plain(name)}: unidentified by most robots, so p(θ) of it is what was assumed")
    for pair, found in fleet.correlations.items():
        notes.append(f"{listed([*map(plain, pair)])} go together between robots: correlation {_with_interval(found)}")
    return tuple(dict.fromkeys(notes))


def fleet_lines(fleet: Fleet) -> tuple[str, ...]:
    """The box that 95 % of robots of this kind lie in, in each parameter, as TOML; none where there is no p(θ)."""
    return tuple(f"{name} = [{told.low:.4g}, {told.high:.4g}]" for name, told in fleet.next_robot.items())


def fleet_tables(fleet: Fleet) -> tuple[Table, ...]:
    """The population, and each robot by its own scores and given the fleet."""
    heads = {name: with_unit(name, unit) for name, unit in fleet.units.items()}
    own = []
    for robot in fleet.robots:
        learnt = robot.knowledge
        fit, share = "too few trials to tell", percent(learnt.posterior.share)
        if (p_value := learnt.misfit.p_value) is not None:
            fit = f"{'fits' if robot.fits else 'misfit'}, {probability(p_value)}"
        own.append((robot.name, fit, share, *map(span, learnt.intervals.values())))
    by_robot = Table(OWN, columns_of(("robot", "proxy"), ("region", *heads.values())), tuple(own), fleet_notes(fleet))
    if fleet.population is None:
        return (by_robot,)
    rows = []
    for name, told in fleet.next_robot.items():
        known = _with_interval(fleet.mean[name]), _with_interval(fleet.deviation[name]), span((told.low, told.high))
        rows.append((heads[name], *known, "yes" if fleet.varies[name] else "not told"))
    columns = ("mean", "standard deviation", "95 % of robots", "robots differ")
    title = f"p(θ) over {len(fleet.fitting)} robots"
    population = Table(title, columns_of(("parameter",), columns), tuple(rows), (ABOUT["fleet"],))
    given = tuple((name, *map(_with_interval, theta.values())) for name, theta in fleet.given.items())
    return population, by_robot, Table(GIVEN, columns_of(("robot",), [*heads.values()]), given)


def fleet_view(fleet: Fleet, figure: Drawn) -> View:
    """What the page shows."""
    lines, tables = fleet_lines(fleet), fleet_tables(fleet)
    picture = picture_of("fleet", "fleet", figure)
    title = f"{fleet.settings.name}: how do {len(fleet.robots)} robots differ?"
    if not lines:
        following = "Find what the proxy lacks: `python -m proxytune diagnose`."
        return View(title, fleet_sentence(fleet), following, (*tables, picture))
    below, pasted = "below `[teaching.proxies.fleet]`", ", ".join(f"`{line}`" for line in lines)
    teach = f"To teach over the fleet, write into the study.toml of `teach`, {below}: {pasted}"
    box = "The same lines below `[parameters]` are the box for the next robot of this kind."
    use = Paragraphs("To use p(θ)", (teach, box))
    following = "Randomise over 95 % of robots, or search the next one there: the lines are below."
    return View(title, fleet_sentence(fleet), following, (tables[0], picture, use, *tables[1:]))


def fleet_text(fleet: Fleet, files: Mapping[str, Any]) -> Group:
    """A fleet as the command prints it."""
    lines = fleet_lines(fleet)
    paste = ["\n[teaching.proxies.fleet]   # or [parameters], for the next robot", *lines] if lines else []
    tables = (part for table in fleet_tables(fleet) for part in section_text(table))
    return group_texts(fleet_sentence(fleet), *tables, *paste, *file_texts(files))


def _with_interval(found: Estimate) -> str:
    ends = (found.low, found.high)
    return f"{as_known(found.value, ends)} ({span(ends)})"


def _documents(told: Mapping[str, Estimate]) -> dict[str, Any]:
    return {name: estimate_document(one) for name, one in told.items()}


def fleet_document(fleet: Fleet) -> dict[str, Any]:
    """A fleet as plain JSON; its keys are promises."""
    robots = {
        robot.name: {
            "target": str(robot.path),
            "fits": robot.knowledge.misfit.fits,
            "p_value": robot.knowledge.misfit.p_value,
            "region_share": robot.knowledge.posterior.share,
            "theta_interval": intervals_document(robot.knowledge.intervals),
            "given_fleet": _documents(fleet.given[robot.name]) if robot.name in fleet.given else None,
        }
        for robot in fleet.robots
    }
    population = fleet.population and {
        "robots": len(fleet.fitting),
        "mean": _documents(fleet.mean),
        "deviation": _documents(fleet.deviation),
        "varies": dict(fleet.varies),
        "next_robot": {name: [one.low, one.high] for name, one in fleet.next_robot.items()},
        "correlations": [
            {"parameters": [*pair], "value": found.value, "interval": [found.low, found.high]}
            for pair, found in fleet.correlations.items()
        ],
    }
    said = {"study": fleet.settings.name, "sentence": fleet_sentence(fleet), "cautions": list(fleet_notes(fleet))}
    return {**said, "population": population, "left_out": list(fleet.left_out), "robots": robots}


def fleet_figure(fleet: Fleet) -> Figure:
    """Draw each robot's intervals and the population, a panel a parameter."""
    intervals, robots = fleet.settings.space.intervals, fleet.robots
    figure, panels = style.panel_grid(len(intervals), 0.7 + 0.1 * max(4, len(robots)), 0.3, sharey=True)
    for box, axes in zip(intervals, panels, strict=True):
        if box.name in fleet.mean:
            mean, reach = fleet.mean[box.name].value, 2.0 * fleet.deviation[box.name].value
            axes.axvspan(mean - reach, mean + reach, color=style.GREEN, alpha=0.15, lw=0, label="fleet: mean ± 2 SD")
            axes.axvline(mean, color=style.GREEN, linewidth=1.0, linestyle="--")
        for place, robot in enumerate(robots):
            label = "own scores (95 %)" if robot.fits else "misfit, left out"
            colour = style.LIGHT_GREY if robot.fits else style.VERMILLION
            ends = robot.knowledge.intervals[box.name]
            axes.plot(ends, [place, place], color=colour, linewidth=1.6, solid_capstyle="butt", label=label)
            if robot.name in fleet.given:
                given = fleet.given[robot.name][box.name].value
                axes.plot(given, place, "o", color=style.BLUE, markersize=2.5, label="given the fleet")
        axes.set_xlim(box.low, box.high)
        axes.xaxis.set_major_locator(MaxNLocator(3))
        style.dress(axes, with_unit(box.name, fleet.units[box.name]))
    names = [robot.name if len(robot.name) <= NAME else f"{robot.name[: NAME - 1]}…" for robot in robots]
    panels[0].set_ylim(len(robots) - 0.5, -0.5)
    panels[0].set_yticks(range(len(robots)), names) if len(robots) <= MOST_NAMED else panels[0].set_yticks([])
    style.legend_below(figure, *panels)
    return figure
