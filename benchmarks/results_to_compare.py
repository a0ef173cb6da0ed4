"""The parts that same_results.py compares: studies, engines, diagnoses, episodes, scores, and every other command.

A part asks only the command line and public names of `import proxytune`: the path of an inner module may change.
Budgets are small, so that all parts of one checkout take about ten minutes of one core.
"""

import hashlib
import inspect
import json
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any, Protocol

SMALL = {"jobs": 1, "starts": 2, "budget": 5, "initial": 3, "domain__seconds": 3.0}
PLANAR = {**SMALL, "domain__plant": "planar"}
"""Settings that make seconds of a shipped study's minutes."""
LESSONS = {
    "teaching__proxy_samples": 200,
    "teaching__target_samples": [0, 40, 80],
    "teaching__seeds": 2,
    "teaching__examinations": 8,
    "teaching__lesson_s": 2.0,
    "teaching__budget": 2,
}
FAMILY = '''
"""A simulator that is a formula: agents like different θ, and do worse the further off they are."""

import os
import time
import tomllib
from dataclasses import dataclass

import numpy as np

from proxytune import Parameter

AGENTS = [f"agent{number}" for number in range(6)]


@dataclass(frozen=True)
class Formula:
    held: tuple

    identity = property(lambda self: f"formula {self.held}")
    metrics = {"distance": "m", "survival_time": "s"}
    parameters = {
        "trim": Parameter(name="trim", unit="", low=-0.3, high=0.3, neutral=0.0),
        "delay": Parameter(name="delay", unit="s", low=0.0, high=0.3, neutral=0.0),
        "gain": Parameter(name="gain", unit="", low=0.5, high=2.0, neutral=1.0),
    }
    starts = 5

    def truth(self, model):
        return tomllib.loads(model.read_text())

    def check_agent(self, name):
        pass

    def run(self, episode):
        if episode.agent == "raises" and episode.start == 1:
            raise ValueError("it lost its way")
        if episode.agent == "sleeps" and episode.start == 1:
            time.sleep(60)
        if episode.agent == "dies" and episode.start == 1:
            os._exit(9)
        theta = {**dict(self.held), **dict(episode.theta)}
        trim, delay, gain = theta.get("trim", 0.0) / 0.3, theta.get("delay", 0.0) / 0.3, theta.get("gain", 1.0)
        number = AGENTS.index(episode.agent) if episode.agent in AGENTS else 6
        wobble = np.random.default_rng([episode.seed, episode.start]).normal(0.0, 0.15, 2)
        far = abs(trim - np.sin(3.0 * number)) + abs(delay - (0.5 + 0.5 * np.cos(5.0 * number))) + abs(gain - 1.2)
        near = abs(trim + np.cos(2.0 * number)) + 0.3 * delay + 0.2 * gain * number
        return {"distance": float(5.0 - far + wobble[0]), "survival_time": float(60.0 - 10.0 * near + wobble[1])}


def formula(section, *, model):
    held = tomllib.loads(model.read_text()) if model else {}
    return Formula(tuple(sorted(held.items())))
'''
FORMULA_STUDY = """
format = 1
name = "formula"
family = "formula:formula"
target = "target.csv"
truth = "truth.toml"
metrics = ["distance:max", "survival_time:max"]
agents = ["agent0", "agent1", "agent2", "agent3", "agent4", "agent5"]
starts = 3
budget = 20
initial = 6
jobs = 1
{more}

[parameters]
trim = [-0.3, 0.3]
delay = [0.0, 0.3]
gain = [0.5, 2.0]

[domain]
"""
DRIVING_STUDY = """
format = 1
target = "target.csv"
metrics = ["distance:max"]
agents = ["steady", "brisk"]
starts = 2
budget = 2

[parameters]
trim = [-0.3, 0.3]

[domain]
robot = "{robot}"
plant = "{plant}"
camera = "{camera}"
map = "{map}"
seconds = {seconds}
"""
DRIVE = """
import hashlib, json, sys
from pathlib import Path
import proxytune

told = {}
for number, (study, agent, theta, start, seed) in enumerate(json.loads(sys.argv[1])):
    try:
        kept = proxytune.drive(study, agent, theta, start=start, seed=seed)
    except proxytune.ProxytuneError as problem:
        told[f"{number} {study} {agent} {theta}"] = str(problem)
        continue
    tables = {"poses": kept.poses, "commands": kept.commands}
    bits = {name: hashlib.sha256(t.to_numpy().tobytes()).hexdigest() for name, t in tables.items() if t is not None}
    last = {name: table.iloc[-1].to_dict() for name, table in tables.items() if table is not None}
    told[f"{number} {study} {agent} {theta}"] = {"scores": dict(kept.scores), "last": last, "bits": bits}
print(json.dumps(told))
"""
ASK_AND_TELL = """
import json
import proxytune

told = {}
for engine in ("gp", "random", "sobol", "tpe"):
    box = proxytune.SearchBox({"gain": (0.5, 2.0), "lag": (0.0, 0.5)}, initial=4, engine=engine, seed=3)
    for number in range(5):
        for theta in [box.ask() for _ in range(3)]:
            box.tell(theta, None if number == 2 else (theta["gain"] - 1.2) ** 2 + (theta["lag"] - 0.1) ** 2)
    told[engine] = {"best": box.best(), "trials": box.trials().to_dict("list")}
print(json.dumps(told))
"""
NOTEBOOK = """
import json, sys
from pathlib import Path
import numpy as np, pandas as pd
import proxytune

robot = {"trim": 0.1, "delay": 0.12}
hidden = {**robot, "yaw_scrub": 0.13}
agents = ["steady", "daredevil", "laggy", "drifter", "edges", "braitenberg"]
target = pd.DataFrame(
    {"agent": agent, "episode": start, **proxytune.drive("study", agent, robot, start=start, seed=7).scores}
    for agent in agents for start in range(3)
)
target.to_csv("study/target.csv", index=False)
report = proxytune.run_study("study")
again = proxytune.run_study("study")
noise = np.random.default_rng(1)
poses, commands = [], []
for agent in ("steady", "edges"):
    for start in range(10):
        kept = proxytune.drive("study", agent, hidden, start=start)
        seen = kept.poses[::3]
        poses.append((seen + noise.normal(0.0, 0.001, seen.shape) * [0, 1, 1, 1]).assign(episode=f"{agent}_{start}"))
        commands.append(kept.commands.assign(episode=f"{agent}_{start}"))
description = {"name": "my_log", "robot": "duckiebot", "command": "duty", "rate_hz": 20}
lacks = proxytune.diagnose(proxytune.log_of(pd.concat(poses), description, pd.concat(commands)))
lacks.write("found")
sim = pd.DataFrame({"agent": ["a", "b", "c", "d"], "distance": [4.1, 3.0, 2.2, 0.9]})
real = pd.DataFrame({"agent": ["a", "b", "c", "d"], "distance": [3.5, 2.1, 2.4, 0.8]})
scored = proxytune.score(proxy=sim, target=real, metrics="distance:max")
print(json.dumps({
    "sentence": report.sentence, "theta": dict(report.theta), "document": report.document(),
    "trials": report.trials().reset_index().to_dict("list"), "driven again": again.spent.episodes,
    "verdict": lacks.verdict, "effects": lacks.effects, "notes": list(lacks.notes),
    "parameters": lacks.parameters().reset_index().to_dict("list"),
    "errors": lacks.errors().reset_index().to_dict("list"),
    "scored": [scored.prpv.value, dict(scored.srcc.value), list(scored.notes)],
}, default=str))
"""
OPTIMIZE_RESULT = """
import json, sys
import skopt

kept = skopt.load(sys.argv[1])
print(json.dumps({"x": kept.x, "fun": kept.fun, "x_iters": kept.x_iters, "func_vals": list(kept.func_vals)}))
"""


class Place(Protocol):
    """A folder in which one checkout answers; see same_results.py."""

    tables: Any
    folder: Any

    def run(self, command: str, *, status: int | None = 0) -> Any: ...
    def python(self, name: str, code: str, *arguments: str) -> Any: ...
    def shipped(self, study: str, name: str = "", **settings: Any) -> None: ...
    def write(self, path: str, text: str) -> None: ...


@dataclass(frozen=True)
class Part:
    """What is asked of both checkouts, independent of all other parts."""

    name: str  # what it is called
    ask: Callable[[Place], None]  # runs its commands in a place
    needs: tuple[str, ...] = ()  # modules that must be installed
    tables: bool = False  # whether score tables must be given
    leaves_out: str = "^$"  # paths of answers that differ by nature, as a regular expression

    @property
    def version(self) -> str:
        """A digest of what is asked: of the code, what it closes over, and what of this module it names."""
        return hashlib.sha256(repr(list(_asked(self.ask))).encode()).hexdigest()[:8]


def _asked(function: Callable[..., Any]) -> Iterator[Any]:
    yield inspect.getsource(function)
    yield from (cell.cell_contents for cell in function.__closure__ or ())
    for name in function.__code__.co_names:
        named = globals().get(name)
        if inspect.isfunction(named):
            yield from _asked(named)
        elif isinstance(named, str | dict):
            yield named


def small_study(study: str, commands: tuple[str, ...] = (), **settings: Any) -> Callable[[Place], None]:
    """A shipped study with a small budget, and commands on what it found."""

    def ask(place: Place) -> None:
        place.shipped(study, **{key: value for key, value in {**SMALL, **settings}.items() if value is not None})
        place.run(f"study {study} --json")
        for command in ("plot STUDY", *commands):
            place.run(command.replace("STUDY", study))

    return ask


def extended_studies(*paths: str) -> Callable[[Place], None]:
    """Shipped studies of a tuned or extended proxy, within another's folder."""

    def ask(place: Place) -> None:
        for study in sorted({path.split("/")[0] for path in paths}):
            place.shipped(study, **{**(SMALL if study == "mujoco_target" else PLANAR), "budget": 4, "starts": 1})
        for path in paths:
            place.run(f"study {path} --json")

    return ask


def resumed(place: Place) -> None:
    """Go on with a study whose budget is raised, score it anew by other metrics, and export what it found."""
    place.shipped("truths", **SMALL)
    place.run("study truths --json")
    place.run("study truths --json --budget 9")
    place.run("plot truths --metric distance:max:5% --metric survival_time:max --format svg")
    for kind, name in (("urdf", "a.urdf"), ("mjcf", "a.xml"), ("ros", "a.yaml"), ("skopt", "a.pkl")):
        place.run(f"export truths --to {kind} --output {name} --json")
    place.python("skopt.load", OPTIMIZE_RESULT, "a.pkl")
    place.run("drive truths --agent steady --json --output steady.png")


def families(place: Place) -> None:
    """Several simulators; the budget ends each, since time would differ."""
    small = {**SMALL, **LESSONS, "budget": 3, "initial": 2, "stop__wall_time_s": 1e5}
    place.shipped("which_simulator", **small)
    place.run("study which_simulator --json")


def taught(place: Place) -> None:
    """Teach by several proxies, and look for the θ that teaches best."""
    place.shipped("teacher", **{**PLANAR, **LESSONS})
    place.run("teach teacher --json")
    place.run("study teacher --json")
    place.run("plot teacher")


def randomised(place: Place) -> None:
    """Look for how much is to be randomised for a learner."""
    place.shipped("which_randomisation", **{**PLANAR, **LESSONS, "budget": 3})
    place.run("study which_randomisation --json")


def mujoco_robot(place: Place) -> None:
    """A robot in MuJoCo, measured, and the log of its manoeuvres."""
    place.shipped("mujoco_target", **{**SMALL, "domain__seconds": 3.0, "starts": 1})
    robot = "mujoco_target/robot"
    place.run(f"measure {robot} --model {robot}/truth.toml --output measured.csv --json")


def formula(place: Place, more: str) -> None:
    """Write a study of a simulator that is a formula, and measure its target."""
    place.write("formula/formula.py", FAMILY)
    place.write("formula/truth.toml", "trim = 0.1\ndelay = 0.12\ngain = 1.4\n")
    place.write("formula/study.toml", FORMULA_STUDY.format(more=more))
    place.run("measure formula --model formula/truth.toml --output formula/target.csv --repeats 2 --json")


def proposals(more: str) -> Callable[[Place], None]:
    """Proposals of an engine."""

    def ask(place: Place) -> None:
        formula(place, more)
        place.run("study formula --json")
        place.run("plot formula")

    return ask


def failing(agent: str) -> Callable[[Place], None]:
    """A study with an agent that fails, in one of three ways."""

    def ask(place: Place) -> None:
        formula(place, "preflight = false\nepisode_timeout_s = 3.0\nengine = 'sobol'")
        text = FORMULA_STUDY.format(more="preflight = false\nepisode_timeout_s = 3.0\nengine = 'sobol'\nconfirm = 0")
        text = text.replace('"agent5"', f'"agent5", "{agent}"').replace("budget = 20", "budget = 2")
        place.write("formula/study.toml", text.replace("starts = 3", "starts = 2"))
        measured = (place.folder / "formula" / "target.csv").read_text().splitlines()
        rows = [line.replace("agent5", agent, 1) for line in measured if line.startswith("agent5")]
        place.write("formula/target.csv", "\n".join([*measured, *rows]) + "\n")
        place.run("study formula --json")
        place.run("study formula --json --retry-failed")

    return ask


def asked_and_told(place: Place) -> None:
    """Proposals without a study."""
    place.python("SearchBox", ASK_AND_TELL)


def diagnosed(study: str, model: str, record: str = "", diagnose: str = "") -> Callable[[Place], None]:
    """Record a log with a planted effect, or none, diagnose it, and predict by what was found."""

    def ask(place: Place) -> None:
        place.shipped(study)
        place.run(f"record {study} --model {study}/{model} --output log --json {record or '--repeats 1 --seconds 20'}")
        place.run(f"diagnose log --output found --json {diagnose}")
        place.run("predict found/model.toml log --output poses.csv --json")
        if "--frames" in record:
            place.run("predict found/model.toml log --frames --output pictures --json")

    return ask


def driven(place: Place) -> None:
    """Episodes by API: robots, plants, cameras, maps, agents, starts, seeds."""
    worlds = [
        ("duckiebot", "planar", "ground_plane", "small_loop"),
        ("duckiebot", "bullet", "ground_plane", "horseshoe"),
        ("duckiebot", "planar", "renderer", "small_loop"),
        ("husky", "planar", "ground_plane", "small_loop"),
        ("husky", "bullet", "ground_plane", "small_loop"),
        ("irobot_create", "bullet", "ground_plane", "small_loop"),
    ]
    agents = [one["name"] for one in place.run("list agents --json")["agents"]]
    episodes = []
    for robot, plant, camera, road in worlds:
        study = f"{robot}_{plant}_{camera}"
        seconds = 2.0 if camera == "renderer" else 4.0
        keys = {"robot": robot, "plant": plant, "camera": camera, "map": road, "seconds": seconds}
        place.write(f"{study}/study.toml", DRIVING_STUDY.format(**keys))
        few = agents if study == "duckiebot_planar_ground_plane" else agents[:3]
        episodes += [(study, agent, {"trim": 0.05, "delay": 0.1}, n % 3, n) for n, agent in enumerate(few)]
        episodes += [(study, few[1], {}, 1, 2)]
    place.python("drive", DRIVE, json.dumps(episodes))


def every_effect(place: Place) -> None:
    """An episode with each parameter of the catalogue of effects, on both plants."""
    episodes = []
    parameters = place.run("list effects --json")["effects"]
    for plant in ("planar", "bullet"):
        keys = {"robot": "duckiebot", "plant": plant, "camera": "ground_plane", "map": "small_loop", "seconds": 3.0}
        place.write(f"{plant}/study.toml", DRIVING_STUDY.format(**keys))
        for one in parameters:
            # A neutral value may be the robot's own, and is then its name.
            low = one["low"] if isinstance(one["neutral"], str) else one["neutral"]
            value = 0.5 * (low + (one["high"] if one["high"] != low else one["low"]))
            episodes.append((plant, "brisk", {one["parameter"]: value}, 0, 5))
    place.python("drive", DRIVE, json.dumps(episodes))


def drive_command(place: Place) -> None:
    """The proxy beside the target, as text, document, picture and animation."""
    place.shipped("quickstart", **SMALL)
    for agent in ("steady", "daredevil"):
        place.run(f"drive quickstart --agent {agent} --theta trim=0.1,delay=0.05 --json")
    place.run("drive quickstart --agent laggy --theta nominal --start 1 --seed 4 --output laggy.png")
    place.run("drive quickstart --agent brisk --theta nominal --output brisk.gif --json")


def published_tables(place: Place) -> None:
    """Score every table in the folder that is given; some are refused."""
    for folder in sorted(path for path in place.tables.iterdir() if (path / "proxy.csv").exists()):
        text = {side: (folder / f"{side}.csv").read_text(encoding="utf-8") for side in ("proxy", "target")}
        for side, table in text.items():
            place.write(f"{folder.name}/{side}.csv", table)
        columns = [text[side].splitlines()[0].split(",")[2:] for side in ("proxy", "target")]
        metrics = "".join(f" --metric {name}:max" for name in columns[0] if name in columns[1])
        sides = f"--proxy {folder.name}/proxy.csv --target {folder.name}/target.csv --common --unpaired"
        place.run(f"score {sides}{metrics} --resamples 200 --json", status=None)


def shipped_tables(place: Place) -> None:
    """Score tables that come with the studies: text, document, figures, tables."""
    for study in ("quickstart", "known_answer", "duckiebot"):
        place.shipped(study)
    both = "--metric distance:max:5% --metric survival_time:max"
    first = "--proxy known_answer/target.csv --target quickstart/target.csv"
    place.run(f"score {first} {both} --common --json")
    place.run(f"score {first} {both} --common --unpaired --beta distance:2 --beta survival_time:1 --seed 3")
    several = "--proxy known_answer/target.csv --proxy quickstart/target.csv --target duckiebot/target.csv"
    place.run(f"score {several} {both} --output several --table all.csv --format svg --json")
    place.run(f"score {several} {both} --table all.tex")


def swept(place: Place) -> None:
    """Usefulness along parameters, with POD, and at the best θ."""
    place.shipped("truths", **SMALL)
    place.run("sweep truths --parameter all --points 3 --at nominal --json")
    place.run("sweep truths --parameter trim --points 4 --at delay=0.1 --target-model truths/truth.toml --json")
    place.run("study truths --json")
    place.run("sweep truths --parameter delay --points 3 --output curves")
    place.run("plot truths")


def looped(place: Place) -> None:
    """Tune, diagnose, extend, tune again."""
    place.shipped("closing_the_loop", **{**PLANAR, "domain__seconds": 10.0})
    place.run("loop closing_the_loop --twin closing_the_loop/twin.toml --json")


def imported(place: Place) -> None:
    """A log of a table, and predictions of its poses."""
    place.shipped("closing_the_loop")
    model = "closing_the_loop/declared.toml"
    place.run(f"record closing_the_loop --model {model} --output log --repeats 1 --seconds 10 --json")
    lines = (place.folder / "log" / "samples.csv").read_text().splitlines()
    head, *rows = (line.split(",") for line in lines)
    drive = [dict(zip(head, row, strict=True)) for row in rows if row[0] == "0"]
    table = [f"{float(r['time']) * 1e9:.0f},{float(r['x']) * 1e3},{float(r['y']) * 1e3},{r['heading']}" for r in drive]
    commands = [f",{r['left']},{r['right']}" for r in drive]
    joined = "\n".join(pose + duties for pose, duties in zip(table, commands, strict=True))
    place.write("drive.csv", f"stamp,px,py,yaw,left,right\n{joined}\n")
    columns = "--columns time=stamp:ns,x=px:mm,y=py:mm,heading=yaw:rad"
    place.run(f"import drive.csv {columns} --kind duty --robot duckiebot --json")
    place.run(f"import drive.csv csv_log {columns} --kind duty --robot duckiebot")
    place.run(f"predict {model} csv_log --horizon 1 --output poses.csv --json")
    for kind, name in (("urdf", "a.urdf"), ("mjcf", "a.xml"), ("ros", "a.yaml")):
        place.run(f"export closing_the_loop/model.toml --to {kind} --output {name}")


def lists(place: Place) -> None:
    """What there is to choose from; engines that only a comparison uses may leave."""
    for kind in ("robots", "maps", "effects", "agents", "metrics", "measures"):
        place.run(f"list {kind} --json")
        place.run(f"list {kind}")


def helps(place: Place) -> None:
    """Options of every command that stays."""
    commands = "study score sweep teach drive import measure record diagnose loop predict plot new repair export list"
    for command in commands.split():
        place.run(f"{command} --help")
    for kind in ("robot", "study"):
        place.run(f"new {kind} my_{kind}")


def refused(place: Place) -> None:
    """Messages of bad input, in one line each."""
    place.shipped("quickstart")
    place.shipped("quickstart", "wrong_key", budgets=3)
    place.shipped("quickstart", "wrong_engine", engine="bayes")
    place.shipped("quickstart", "wrong_robot", domain__robot="duck")
    for study in ("wrong_key", "wrong_engine", "wrong_robot", "no_such_study"):
        place.run(f"study {study}", status=2)
    place.run("drive quickstart --agent stedy", status=2)
    place.run("drive quickstart --agent steady --theta trim=9", status=2)
    place.run("sweep quickstart --parameter trom", status=2)
    place.run("diagnose quickstart", status=2)
    place.run("score --proxy quickstart/target.csv --target nowhere.csv --metric distance:max", status=2)
    place.run("score --proxy quickstart/target.csv --target quickstart/target.csv --metric way:max", status=2)
    place.run("export quickstart --to urdf --output a.urdf", status=2)
    place.run("predict quickstart/truth.toml quickstart --output a.csv", status=2)
    place.run("teach quickstart", status=2)
    place.run("no_such_command", status=2)


def in_python(place: Place) -> None:
    """The functions of docs/python.md."""
    keys = {"robot": "duckiebot", "plant": "planar", "camera": "ground_plane", "map": "small_loop", "seconds": 4.0}
    agents = 'agents = ["steady", "daredevil", "laggy", "drifter", "edges", "braitenberg"]'
    text = DRIVING_STUDY.format(**keys).replace('agents = ["steady", "brisk"]', agents)
    text = text.replace("starts = 2\nbudget = 2", "starts = 3\nbudget = 10\ninitial = 6")
    place.write("study/study.toml", text.replace("[parameters]", "[parameters]\ndelay = [0.0, 0.3]"))
    place.python("the functions of docs/python.md", NOTEBOOK)


PARTS = (
    Part("study quickstart", small_study("quickstart", ("study STUDY --json --jobs 2 --budget 7",), budget=6)),
    Part("study known_answer", small_study("known_answer", batch=2, budget=6, starts=1)),
    Part("study duckiebot", small_study("duckiebot", engine="composite", domain__plant="planar")),
    Part(
        "study gymnasium_pendulum",
        small_study("gymnasium_pendulum", budget=8, initial=4, domain__seconds=None),
        ("gymnasium",),
    ),
    Part("study mujoco_target", extended_studies("mujoco_target", "mujoco_target/extended")),
    Part(
        "study closing_the_loop",
        extended_studies(
            "closing_the_loop",
            "closing_the_loop/extended",
            "closing_the_loop/no_name/extended",
            "closing_the_loop/two_effects/extended",
        ),
    ),
    Part(
        "study closing_the_camera_loop", extended_studies("closing_the_camera_loop", "closing_the_camera_loop/extended")
    ),
    Part("study truths, resumed and exported", resumed),
    # What an episode of each takes, drawn and in a table.
    Part("study which_simulator", families, leaves_out=r"/families\.png$|/report\.html/(3[7-9]|4[0-3])$"),
    Part("study teacher", taught),
    Part("study which_randomisation", randomised),
    Part("mujoco robot", mujoco_robot, ("gymnasium", "mujoco")),
    Part("engine outcomes", proposals("engine = 'outcomes'")),
    Part("engine outcomes, batch", proposals("engine = 'outcomes'\nbatch = 3\nseed = 2")),
    Part("engine composite", proposals("engine = 'composite'")),
    Part("engine gp", proposals("engine = 'gp'\npreflight = false")),
    Part("engine gp, batch", proposals("engine = 'gp'\nbatch = 3\nconfirm = 2\npreflight = false")),
    Part("engine gp, whole trials", proposals("engine = 'gp'\ncut_off = false\nobjective = 'ppv'")),
    Part("engine random", proposals("engine = 'random'")),
    Part("engine sobol", proposals("engine = 'sobol'")),
    Part("engine tpe", proposals("engine = 'tpe'"), ("optuna",)),
    Part("engines asked and told", asked_and_told, ("optuna",)),
    Part("failure raises", failing("raises")),
    Part("failure sleeps", failing("sleeps")),
    Part("failure dies", failing("dies")),
    Part("diagnosis clean", diagnosed("closing_the_loop", "declared.toml", diagnose="--declared trim,delay")),
    Part("diagnosis dead_band", diagnosed("closing_the_loop", "twin.toml")),
    Part("diagnosis wheel_gain", diagnosed("truths", "lacks_wheel_gain.toml", "--repeats 1 --seconds 15 --seed 3")),
    Part("diagnosis motor_lag", diagnosed("truths", "lacks_motor_lag.toml", "--repeats 1 --seconds 15 --seed 4")),
    Part(
        "diagnosis camera, planted",
        diagnosed(
            "closing_the_camera_loop",
            "twin.toml",
            "--repeats 1 --seconds 10 --frames 24",
            "--declared trim,delay,camera_pitch",
        ),
    ),
    Part(
        "diagnosis camera, clean",
        diagnosed("closing_the_loop", "declared.toml", "--repeats 1 --seconds 10 --frames 16", "--format svg"),
    ),
    Part("episodes", driven),
    Part("episodes of every effect", every_effect),
    Part("episodes by drive", drive_command),
    Part("scores of published tables", published_tables, tables=True),
    Part("scores of shipped tables", shipped_tables),
    Part("sweep", swept),
    Part("loop", looped),
    Part("import, predict, export", imported),
    Part("list", lists),
    Part("help", helps),
    Part("refusals", refused),
    Part("functions of Python", in_python),
)
