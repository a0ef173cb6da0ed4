"""How much a tracker scatters, from what fits of the camera add to its poses."""

import numpy as np

from proxytune.diagnosis.camera.model.fitting import CameraFit

PASSES = 4
"""The scatter is estimated so many times over, each with poses fitted under the one before."""


def pose_scatter(fit: CameraFit) -> tuple[float, float]:
    """Standard deviations of places [m] and headings [rad], as expectation maximisation has them."""
    squares = fit.state.poses**2 + fit.pose_sd**2
    place, turn = float(np.sqrt(squares[:, :2].mean())), float(np.sqrt(squares[:, 2].mean()))
    return place, turn
