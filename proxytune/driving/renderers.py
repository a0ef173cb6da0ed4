"""The ways to draw what a camera sees, by name."""

from proxytune.driving.bullet.renderer import BulletCamera
from proxytune.driving.cameras import Camera, CameraFigures
from proxytune.driving.ground_plane import GroundPlaneCamera
from proxytune.driving.road.texture import Floor

CAMERAS = ("ground_plane", "renderer")


def camera_over(floor: Floor, mounted: CameraFigures, kind: str) -> Camera:
    """A camera of one of CAMERAS over a floor."""
    return GroundPlaneCamera(mounted, floor) if kind == "ground_plane" else BulletCamera(mounted, floor)
