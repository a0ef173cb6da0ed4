"""A study of a robot to start from, with a target to try it."""

from proxytune.driving.robot import Robot
from proxytune.errors import SettingsError
from proxytune.skeletons.skeleton import Skeleton, fill

AROUND_DEG = 10.0
"""How far the box of the camera's pitch reaches to either side of the nominal one."""

OFF_DEG = 4.0
"""How far the pitch that is to be found is from the nominal one."""

HIGHEST_DEG = 45.0


def study_skeleton(name: str, robot: Robot) -> Skeleton:
    """A study.toml for the plant that the robot can drive on, and a truth.toml.

    Args:
        name: Of the study's folder.
        robot: Which one; it needs a camera.

    Raises:
        SettingsError: If it has no camera.
    """
    pitch = robot.camera_figures().pitch_deg
    low, high = max(0.0, pitch - AROUND_DEG), min(HIGHEST_DEG, pitch + AROUND_DEG)
    off = pitch + OFF_DEG if pitch + OFF_DEG < high else pitch - OFF_DEG
    plant = _plant(robot)
    study = fill(
        "study.toml.txt", name=name, robot=robot.name, plant=plant, pitch_low=f"{low:g}", pitch_high=f"{high:g}"
    )
    return Skeleton(
        {"study.toml": study, "truth.toml": fill("truth.toml.txt", robot=robot.name, pitch=f"{off:g}")},
        commands(name),
    )


def commands(name: str) -> tuple[str, str]:
    """What makes the target of a study, and what runs it."""
    return (
        f"python -m proxytune measure {name} --model {name}/truth.toml --output {name}/target.csv",
        f"python -m proxytune study {name}",
    )


def _plant(robot: Robot) -> str:
    try:
        robot.body()
    except SettingsError:
        return "planar"
    return "bullet"
