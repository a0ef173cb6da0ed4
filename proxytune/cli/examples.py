"""Examples for the help of every command, as typed after the program's name."""

from collections.abc import Mapping

EXAMPLES: Mapping[str, tuple[str, ...]] = {
    "study": (
        "study quickstart",
        "study my_study --jobs 8 --budget 40",
        "study my_study --retry-failed",
    ),
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
    "loop": (
        "loop my_study --log drive.bag",
        "loop my_study --twin twin.toml",
    ),
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
        "export found/model.toml --to mjcf --output rover.xml",
        "export my_study --to ros --output rover.yaml",
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
