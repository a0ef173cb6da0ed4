"""A tracker's scatter is learnt from what a fit adds to its poses."""

import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.append(str(Path(__file__).parents[1]))
from pictured import lane_poses, pictures
from viewed import OPTICS, still, stood, tracked, views_of

from proxytune.diagnosis.camera.model.scatter import pose_scatter
from proxytune.diagnosis.camera.naming.search import fit_everything


@pytest.mark.slow
@pytest.mark.parametrize(("place", "turn"), [(0.002, 0.3), (0.008, 1.5)])
def test_a_scatter_that_nobody_states_is_learnt(place, turn):
    poses, truth = lane_poses(50), (place, np.radians(turn))
    views = views_of(pictures({}, poses), still(tracked(poses, scatter=truth)), (0.005, np.radians(1.0)))
    fit = fit_everything(views, OPTICS.mounting, {}, learn_scatter=True)
    assert pose_scatter(fit) == pytest.approx(truth, rel=0.6)
    assert (fit.views.position_m, fit.views.heading_rad) == pytest.approx(truth, rel=1.0)


def test_a_scatter_that_is_stated_is_kept():
    views = stood(count=20)
    fit = fit_everything(views, OPTICS.mounting, {}, learn_scatter=False)
    assert (fit.views.position_m, fit.views.heading_rad) == (views.position_m, views.heading_rad)
