"""Every command: what it is called, does, leaves when it is stopped, and may run.

Examples for the help of every command, as typed after the program's name.
"""

import importlib
from collections.abc import Mapping
from types import ModuleType
from typing import NamedTuple


class Command(NamedTuple):
    """A command: its module, loaded only when it is asked for, and its line in the help.

    An interruption leaves everything finished, or nothing, where `kept` does not say; where `runs_code` is not set no
    code runs, whatever a file names.
    """

    module: str
    summary: str
    resumes: bool = False
    kept: str = ""
    draws: bool = False
    runs_code: bool = False

    @property
    def left(self) -> str:
        """Say what an interruption leaves, and what the same command does then."""
        kept = self.kept or ("everything finished is kept" if self.resumes else "nothing was written")
        return f"{kept}; run the same command to {'continue' if self.resumes else 'start again'}"

    def load(self) -> ModuleType:
        """The module."""
        return importlib.import_module(f"proxytune.cli.{self.module}")


COMMANDS: dict[str, Command] = {
    "study": Command(
        "study",
        "run or resume a study: find the θ that makes the simulator most useful",
        resumes=True,
        kept="every finished trial and episode is kept",
        draws=True,
        runs_code=True,
    ),
    "score": Command(
        "score",
        "measure how useful a simulator is, from two tables of scores",
        kept="of the output only whole files were written",
        draws=True,
    ),
    "sweep": Command(
        "sweep",
        "measure usefulness along one parameter",
        resumes=True,
        kept="every finished episode is kept",
        draws=True,
        runs_code=True,
    ),
    "teach": Command(
        "teach",
        "measure PLV (proxy learning value): how much a simulator saves in training",
        resumes=True,
        kept="every finished point of a learning curve is kept",
        draws=True,
        runs_code=True,
    ),
    "drive": Command(
        "drive",
        "show an episode, the proxy beside the target: metrics, a picture or an animation",
        kept="the picture is the old one or none",
        runs_code=True,
    ),
    "import": Command("importing", "make a log of a ROS bag, a CSV, a TUM trajectory or arrays, and say what is in it"),
    "measure": Command(
        "measure", "drive a study's agents in the domain of a model file and write their scores", runs_code=True
    ),
    "record": Command(
        "record",
        "drive the domain of a model file through manoeuvres and write the log",
        kept="no log was written, at most some of its pictures",
        runs_code=True,
    ),
    "diagnose": Command(
        "diagnose",
        "find the effect that the model lacks, from a log of measured drives",
        kept="findings are written last, each file whole or not at all",
        draws=True,
    ),
    "loop": Command(
        "loop",
        "tune, diagnose, extend, tune again: before and after on one page",
        resumes=True,
        kept="every finished step, trial and episode is kept",
        draws=True,
        runs_code=True,
    ),
    "predict": Command(
        "predict",
        "predict the poses of a log with a fitted model",
        kept="no table was written, at most some of the pictures",
    ),
    "plot": Command(
        "plot",
        "draw a study's figures and report again, without simulating",
        kept="every file is the old one or the new one",
        draws=True,
    ),
    "new": Command("new", "write a robot, study or domain family to start from", runs_code=True),
    "repair": Command(
        "repair",
        "keep what is whole of a damaged study.db, and say what the study does again",
        kept="study.db is the old one or the repaired one",
    ),
    "export": Command("export", "write what was found for another simulator, the robot or another optimiser"),
    "list": Command("listing", "list robots, maps, effects, agents, metrics, engines or measures"),
    "completion": Command("completion", "print a script that completes commands and options in your shell"),
}


def names_in(given: str) -> tuple[str, ...]:
    """The names of a list with commas."""
    return tuple(name.strip() for name in given.split(",") if name.strip())


EXAMPLES: Mapping[str, tuple[str, ...]] = {
    "study": ("study quickstart", "study my_study --jobs 8 --budget 40", "study my_study --retry-failed"),
    "score": (
        "score --proxy sim.csv --target robot.csv --metric distance:max:5% --metric lane_error:min:0.01",
        "score --proxy old.csv --proxy new.csv --target robot.csv --metric distance:max --output figures",
        "score --proxy sim.csv --target robot.csv --metric success:max --columns agent=policy,episode=trial",
    ),
    "sweep": (
        "sweep my_study --parameter trim",
        "sweep my_study --parameter all --points 9 --at nominal",
        "sweep my_study --parameter delay --at trim=0.1,blur=0.02 --target-model twin.toml",
    ),
    "teach": ("teach my_study", "teach my_study --json", "teach my_study --format pdf"),
    "drive": (
        "drive my_study --agent steady",
        "drive my_study --agent daredevil --theta best --against twin.toml --output daredevil.gif",
    ),
    "repair": ("repair my_study", "repair my_study --json"),
    "loop": ("loop my_study --log drive.bag", "loop my_study --twin twin.toml"),
    "import": (
        "import drive.bag",
        "import drive.bag my_log --robot duckiebot",
        "import drives.csv my_log --columns time=stamp_ns:ns,x=pos_x:mm,heading=yaw:deg,v=cmd_lin,omega=cmd_ang",
    ),
    "measure": (
        "measure my_study --model twin.toml --output target.csv",
        "measure my_study --model twin.toml --output target.csv --repeats 4",
    ),
    "record": (
        "record my_study --model twin.toml --output my_log",
        "record my_study --model twin.toml --output my_log --repeats 4 --frames 200",
    ),
    "diagnose": (
        "diagnose my_log --output found",
        "diagnose my_log --declared trim,delay,camera_pitch --test another_log --output found",
        "diagnose drive.bag --robot duckiebot --output found --format svg,pdf",
    ),
    "predict": (
        "predict found/model.toml my_log --horizon 2 --output poses.csv",
        "predict found/model.toml my_log --frames --output pictures",
    ),
    "plot": (
        "plot my_study",
        "plot my_study --format svg,pdf",
        "plot my_study --metric distance:max:5% --metric survival_time:max",
    ),
    "new": (
        "new robot rover --figures wheel_radius=0.033,wheel_distance=0.16,full_speed=0.5",
        "new robot rover --urdf rover.urdf",
        "new study rover_study --robot rover",
    ),
    "export": (
        "export found/model.toml --into my.urdf --output my_found.urdf",
        "export found/model.toml --to filter --output cmd_vel_filter.py",
        "export my_study --to optuna --output my_study.sqlite3",
    ),
    "list": ("list robots", "list effects --json"),
    "completion": (
        "completion bash > ~/.local/share/bash-completion/completions/proxytune",
        "completion zsh > ~/.zfunc/_proxytune",
    ),
}


def epilog(command: str, program: str) -> str:
    """The examples of a command, to stand below its help."""
    return "\n".join(["examples:", *(f"  {program} {line}" for line in EXAMPLES[command])])
