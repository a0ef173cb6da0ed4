"""The lane-following family as a study's `[domain]` table describes it."""

from pathlib import Path

from proxytune.driving.body import check_body
from proxytune.driving.lane_following import LaneFollowing
from proxytune.driving.plants import PLANTS
from proxytune.driving.renderers import CAMERAS
from proxytune.driving.road.reading import chosen_map
from proxytune.driving.robot import Robot, read_robot, robot_names
from proxytune.effects import Catalogue, read_effects, read_model
from proxytune.errors import SettingsError
from proxytune.settings import Section, nearest


def lane_following(section: Section, *, model: Path | None) -> LaneFollowing:
    """The family that a study's `[domain]` table describes.

    Args:
        section: Keys robot, plant, camera, map, seconds, position_noise_m, heading_noise_deg, and effects.
        model: A model.toml whose effects every instance has, besides those of the section.

    Raises:
        SettingsError: With file, key and remedy.
    """
    section.only(("robot", "plant", "camera", "map", "seconds", "position_noise_m", "heading_noise_deg", "effects"))
    folder = section.path.resolve().parent
    given = read_model(model, Catalogue(folder)) if model else None
    robot = _agreed(section, "robot", given.robot if given else None, "duckiebot", robot_names(folder))
    plant = _agreed(section, "plant", given.plant if given else None, "bullet", PLANTS)
    _check_equipment(section, read_robot(robot, folder), plant)
    theta, _ = read_effects(section.section("effects"), Catalogue(folder))
    effects = {**(given.theta if given else {}), **theta}
    return LaneFollowing(
        robot=robot,
        plant=plant,
        camera=section.text("camera", "ground_plane", choices=CAMERAS),
        map=chosen_map(section),
        seconds=section.number("seconds", 60.0, low=1.0, high=3600.0),
        position_noise_m=section.number("position_noise_m", 0.01, low=0.0, high=0.1),
        heading_noise_deg=section.number("heading_noise_deg", 2.0, low=0.0, high=30.0),
        effects=tuple(sorted(effects.items())),
        folder=folder,
    )


def _check_equipment(section: Section, robot: Robot, plant: str) -> None:
    """Refuse a robot that has no camera, or no body for the bullet plant, before the first episode."""
    try:
        robot.camera_figures()
        if plant == "bullet":
            check_body(robot)
    except SettingsError as problem:
        raise section.error("robot", str(problem)) from None


def _agreed(section: Section, key: str, of_model: str | None, default: str, known: tuple[str, ...]) -> str:
    value = section.text(key, of_model or default)
    if of_model is not None and value != of_model:
        raise section.error(key, f"is '{value}' but the model says '{of_model}'; take one of them out")
    if value not in known:
        raise section.error(key, f"unknown value '{value}'; {nearest(value, known)}")
    return value
