"""The Duckiebot's camera as its makers state it."""

from proxytune.driving import CameraFigures

CAMERA = CameraFigures(
    columns=160,
    rows=120,
    forward_m=0.066,
    pitch_deg=19.15,
    roll_deg=0.0,
    yaw_deg=0.0,
    height_m=0.108,
    field_of_view_deg=75.0,
    k1=0.0,
)
