"""Commands that are options, one function of `proxytune.api`, and text: a function for each."""

import argparse
import math
import shlex
from pathlib import Path
from typing import Any

from rich.console import Group
from rich.text import Text

from proxytune import api, report
from proxytune.cli.commands import names_in
from proxytune.cli.options import check_made, facts_of, on_its_cluster, study_folder, typed, wanted_of
from proxytune.cli.terminal import Answer, waiting
from proxytune.errors import InputError
from proxytune.files import check_place
from proxytune.importing import Survey
from proxytune.settings import nearest, read_settings
from proxytune.study import check_model, read_study_settings

MOST_FRAMES = 1_000_000
"""As many as six digits number."""
MOST_REPEATS = 10_000
"""Weeks of driving at the least."""


@on_its_cluster
def sweep(arguments: argparse.Namespace) -> Answer:
    """`sweep`: simulate what is missing of usefulness along one parameter or each of a study's, and draw it."""
    folder = study_folder(arguments.path)
    check_made(folder) if arguments.output is None else check_place(arguments.output, folder=True)
    chosen = {"points": arguments.points, "at": arguments.at, "target_model": arguments.target_model}
    found = api.run_sweep(folder, arguments.parameter, progress=True, **chosen)
    figures, files = found.write(arguments.output, typed(arguments))
    document = found.document()
    at = document.pop("at")
    paths = {"figures": [str(path) for path in figures], "files": [str(path) for path in files]}
    text = report.sweep_text(found.curves, found.episodes, [*figures, *files], found.held)
    return Answer(document | paths | {"at": at}, text)


@on_its_cluster
def teach(arguments: argparse.Namespace) -> Answer:
    """`teach`: run what is left of learning curves and PLV; what is finished is summed up without training."""
    folder = study_folder(arguments.path)
    check_made(folder)
    found = api.teach(folder, progress=True)
    figure, page = found.write(typed(arguments))
    document = {**found.document(), "figure": str(figure), "report": str(page)}
    return Answer(document, report.teach_text(found.experiment, found.prpv, {"figure": figure, "report": page}))


def fleet(arguments: argparse.Namespace) -> Answer:
    """`fleet`: tell θ of several robots of one kind, and p(θ) over them; nothing is simulated."""
    if arguments.output:
        check_place(arguments.output, folder=True)
    with waiting("learning θ of each robot"):
        found = api.fleet(study_folder(arguments.path), arguments.targets)
    written = found.write(arguments.output, typed(arguments)) if arguments.output else ()
    files = dict(zip(("figure", "report"), written, strict=False))
    document = {**found.document(), **{name: str(path) for name, path in files.items()}}
    return Answer(document, report.fleet_text(found.result, files))


def measure(arguments: argparse.Namespace) -> Answer:
    """`measure`: score a study's agents from every start in the domain of a model file, and write the table."""
    settings = read_study_settings(arguments.path)
    check_place(arguments.output, inputs=(settings.folder, settings.home, *_files_of(arguments.model, settings.folder)))
    found = api.measure(arguments.path, arguments.model, repeats=arguments.repeats, seed=arguments.seed, progress=True)
    found.write(arguments.output)
    document = {"scores": str(arguments.output), **found.document()}
    lines = [*(f"beware: {line}" for line in found.cautions), f"seed {found.seed}", str(arguments.output)]
    means = zip(found.scores.agents, found.scores.means, strict=True)
    rows = tuple((str(agent), *(f"{value:.3f}" for value in own)) for agent, own in means)
    heads = report.columns_of(("agent",), [report.plain(name) for name in found.scores.metrics])
    return Answer(document, Group(report.table_text(report.Table("", heads, rows)), Text("\n".join(lines))))


def _files_of(model: Path, folder: Path) -> tuple[Path, ...]:
    """A model, and what the robot that it names is read from."""
    named = str(read_settings(model).values.get("robot")) if model.is_file() else ""
    return (model, *api.robot_files(named, folder))


def _check_effects(arguments: argparse.Namespace) -> None:
    """Refuse own effects that neither the model nor its robot in the current folder names."""
    if not arguments.effects or not arguments.model.is_file():
        return
    model = read_settings(arguments.model)
    robot = Path(str(model.values.get("robot")), "robot.toml")
    files = [model, *([read_settings(robot)] if robot.is_file() else [])]
    named = {name for file in files for name in file.section("effects").values}
    for name in names_in(arguments.effects):
        if name not in named:
            raise InputError(f"--effects {name}: {arguments.model} names no such effect; {nearest(name, named)}")


def record(arguments: argparse.Namespace) -> Answer:
    """`record`: drive every manoeuvre, and lanes where pictures are wanted, and write the log."""
    if arguments.seconds is None:
        arguments.seconds = api.Wanted.seconds
    elif arguments.commands is not None:
        raise InputError("--seconds: is for manoeuvres, and a table of --commands has its own; leave it out")
    bounds = {"repeats": (1, MOST_REPEATS), "seconds": (5, 600), "frames": (0, MOST_FRAMES), "seed": (0, math.inf)}
    for name, (low, high) in bounds.items():
        if not low <= (given := getattr(arguments, name)) <= high:
            limits = f"between {low} and {high}" if high < math.inf else f"at least {low}"
            raise InputError(f"--{name} must be {limits}, got {given}")
    settings = read_study_settings(arguments.path)
    check_model(settings, arguments.model, "--model")
    check_place(arguments.output, folder=True)
    if (arguments.output / "log.toml").exists():
        raise InputError(f"{arguments.output}: holds a log; give another folder, or remove this one")
    wanted = api.Wanted(arguments.repeats, arguments.seconds, arguments.frames, arguments.seed, arguments.commands)
    with waiting("driving") as tell:
        log, cautions = api.record_log(settings, arguments.model, arguments.output, wanted, tell)
    rows, frames = sum(len(episode.times) for episode in log.episodes), arguments.frames
    document = {"log": str(arguments.output), "episodes": len(log.episodes), "rows": rows, "frames": frames}
    pictures = f", {frames} frames" if frames else ""
    text = f"{len(log.episodes)} drives, {rows} rows{pictures}\n{arguments.output}"
    lines = [*(f"beware: {line}" for line in cautions), text]
    return Answer({**document, "seed": arguments.seed, "cautions": list(cautions)}, Text("\n".join(lines)))


def take_in(arguments: argparse.Namespace) -> Answer:
    """`import`: list what a bag, a table or a trajectory holds, and write the log."""
    if arguments.output is not None:
        check_place(arguments.output, folder=True)
    wanted, facts = wanted_of(arguments), facts_of(arguments)
    with waiting(f"reading {arguments.source}"):
        found = api.import_log(arguments.source, arguments.output, wanted=wanted, facts=facts)
    source, output = found.source, arguments.output
    rows = tuple((one.name, one.kind, str(one.count), one.role) for one in source.channels)
    columns = (*report.columns_of(("what", "type"), ("count",)), report.Column("taken for"))
    channels = report.Table(source.form, columns, rows)
    heads = report.columns_of(
        ("drive",), ("time", "poses", "rate", "jitter", "lost", "gaps", "commands", "answers after")
    )
    drives = report.Table("Drives", heads, tuple(map(_drive_row, source.surveys)))
    beware = (f"- beware: {line}" for line in found.cautions)
    notes = Text("\n".join((*beware, *(f"- {note}" for note in source.notes))))
    last = f"next: python -m proxytune diagnose {output}" if output else "give OUTPUT to write the log"
    tables = report.table_text(channels), Text(), report.table_text(drives)
    return Answer(found.document(), Group(*tables, Text(), notes, Text(last)))


def _drive_row(one: Survey) -> tuple[str, ...]:
    gaps = f"{one.gaps} to {one.longest_gap_s:.1f} s" if one.gaps else "none"
    lag = "?" if one.lag_s is None else f"{one.lag_s:.2f} s"
    numbers = (f"{one.seconds:.1f} s", str(one.poses), f"{one.poses_hz:.1f} Hz", f"{1e3 * one.jitter_s:.1f} ms")
    return (one.name, *numbers, report.percent(one.lost), gaps, str(one.commands), lag)


def predict(arguments: argparse.Namespace) -> Answer:
    """`predict`: predict the poses of a log, or its pictures, by a model, and compare them with those measured."""
    output, folder = arguments.output, arguments.output if arguments.frames else None
    log = (arguments.log, *(arguments.log / f"{name}.csv" for name in ("samples", "commands", "frames")))
    if output is not None:
        check_place(output, folder=arguments.frames, inputs=(*log, *_files_of(arguments.model, Path.cwd())))
    elif arguments.frames:
        raise InputError("--frames: needs a folder for the pictures; give it by --output DIR")
    if arguments.frames and arguments.horizon is not None:
        raise InputError("--horizon: is for poses, and --frames predicts pictures instead; leave one of the two out")
    _check_effects(arguments)
    chosen: dict[str, Any] = {"wanted": wanted_of(arguments), "facts": facts_of(arguments)}
    horizon = chosen["horizon_s"] = 2.0 if arguments.horizon is None else arguments.horizon
    with waiting("predicting") as tell:
        found = api.predict(arguments.model, arguments.log, frames=folder, tell=tell, **chosen)
    if isinstance(found, api.PicturePrediction):
        return Answer(found.document(), Text(f"{found.sentence}\n{output}"))
    if output is not None:
        report.write_text(output, found.poses.to_csv(index=False))
    count = found.error.windows or len(found.poses.groupby(["episode", "start_time"]))
    windows = f"{count} windows of {horizon:g} s"
    written = [] if output is None else [str(output)]
    document = {"predictions": written[0] if written else None, **found.document()}
    cautions = [f"beware: {line}" for line in found.cautions]
    lines = [*cautions, *found.notes, f"{windows}: {found.sentence}", *written]
    return Answer(document, Text("\n".join(lines)))


def export(arguments: argparse.Namespace) -> Answer:
    """`export`: write what was found for other simulators or robots, and say what went where and what has no place."""
    check_place(arguments.output)
    _check_effects(arguments)
    wheels, has = names_in(arguments.wheels), names_in(arguments.has)
    found = api.export(arguments.model, arguments.output, to=arguments.to, into=arguments.into, wheels=wheels, has=has)
    cautions = (f"beware: {line}" for line in found.facts.get("cautions", ()))
    lines = [*cautions, *map(str, found.lines), str(arguments.output)]
    if arguments.to in api.TRIALS:
        lines.insert(0, f"{found.facts['trials']} trials of '{found.facts['name']}'")
    if arguments.to == "optuna":
        lines.append(f"look: optuna-dashboard sqlite:///{arguments.output}")
    said = Text("\n".join(lines))
    if arguments.into is None:
        return Answer(found.document(), said)
    diff = found.facts["diff"] or f"{arguments.into}: nothing in it has to change\n"
    rest = ("--to", "filter", "--has", ",".join(report.IN_WHEELS), "--output", "cmd_vel_filter.py")
    own = ("--effects", arguments.effects) if arguments.effects else ()
    then = f"the filter for the rest: {shlex.join(('proxytune', 'export', str(arguments.model), *own, *rest))}"
    above, below = (Text(text, no_wrap=True, overflow="ignore") for text in (diff, then))
    return Answer(found.document(), Group(above, said, below))
