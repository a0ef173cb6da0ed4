"""Whether frames, poses and map belong together; if not, what is wrong with them."""

from collections.abc import Callable, Mapping
from dataclasses import replace
from types import MappingProxyType

import numpy as np

from proxytune.diagnosis.camera.measured.edges import Edges
from proxytune.diagnosis.camera.model.fitting import CameraFit, fit_camera
from proxytune.diagnosis.camera.model.projection import neutral_state, project
from proxytune.diagnosis.camera.model.views import Views
from proxytune.diagnosis.camera.naming.search import FAR, FIRST
from proxytune.errors import LogError

MATCHED_PX = 2.0
"""An edge that lies no farther from the map's is matched."""

FEWEST_MATCHED = 0.2
"""Frames of which a smaller share of edges is matched do not belong to these poses, or to this map."""

USUAL_MATCHED = 0.6
"""A smaller share is told."""

LIKELY = 0.4
"""A mistake that, undone, brings this share to the map is the cause where hardly any match as they are."""

ADVICE = (
    "check that frames and rows are the same instants, the map is the right one, heading is counter-clockwise in "
    "radians, and the pictures are not mirrored"
)


def matched_share(fit: CameraFit) -> float:
    """Share of edge points near markings that lie on the map's, as the fit has them."""
    there = project(fit.views, fit.state)
    matched = there.valid & (np.abs(there.residual) < MATCHED_PX)
    return float(matched.sum() / max(int(there.near.sum()), 1))


def check_match(name: str, fit: CameraFit) -> tuple[str, ...]:
    """What is to be said of frames that match poorly; nothing where they match as usual.

    Raises:
        LogError: If they do not belong to the poses, with what would make them, where that is found.
    """
    share = matched_share(fit)
    if share >= USUAL_MATCHED:
        return ()
    causes = {cause: _share_if(fit.views, change) for cause, change in MISTAKES.items()}
    likely = max(causes, key=causes.__getitem__)
    problem = f"{name}: frames do not fit the poses: {100 * share:.0f} % of the markings' edges match at best"
    if causes[likely] > max(2.0 * share, LIKELY if share < FEWEST_MATCHED else USUAL_MATCHED):
        raise LogError(f"{problem}; {100 * causes[likely]:.0f} % match if {likely}; correct that")
    if share < FEWEST_MATCHED:
        raise LogError(f"{problem}; {ADVICE}")
    usual = f"{100 * USUAL_MATCHED:.0f} % or more is usual"
    return (f"{100 * share:.0f} % of the markings' edges match ({usual}): poses or map are off by centimetres",)


def _share_if(views: Views, change: Callable[[Views], Views]) -> float:
    changed = change(views)
    optics = changed.optics
    start = neutral_state(changed, {name: optics.neutral(name) for name in optics.mounting})
    return matched_share(fit_camera(changed, start, [name for name in FIRST if name in optics.mounting], FAR))


def _turned_pictures(right: bool, down: bool) -> Callable[[Views], Views]:
    """Pictures mirrored left to right, top to bottom, or both."""

    def turn(views: Views) -> Views:
        edges, optics = views.edges, views.optics
        column = optics.columns - edges.column if right else edges.column
        row = optics.rows - edges.row if down else edges.row
        signs = np.array((-1.0 if right else 1.0, -1.0 if down else 1.0))
        return replace(views, edges=Edges(edges.frame, edges.white, column, row, edges.normal * signs))

    return turn


def _posed(change: Callable[[np.ndarray], np.ndarray]) -> Callable[[Views], Views]:
    """Poses written another way."""
    return lambda views: replace(views, tracks=replace(views.tracks, poses=change(views.tracks.poses)))


MISTAKES: Mapping[str, Callable[[Views], Views]] = MappingProxyType(
    {
        "the pictures are mirrored": _turned_pictures(True, False),
        "the pictures are upside down": _turned_pictures(True, True),
        "heading is clockwise": _posed(lambda poses: poses * (1.0, 1.0, -1.0)),
        "headings are in degrees": _posed(lambda poses: poses * (1.0, 1.0, np.radians(1.0))),
        "x and y are swapped": _posed(lambda poses: poses[:, (1, 0, 2)]),
        "each frame belongs to the next row": _posed(lambda poses: np.roll(poses, -1, axis=0)),
        "each frame belongs to the row before": _posed(lambda poses: np.roll(poses, 1, axis=0)),
    }
)
"""Usual mistakes in logs, and what undoes each."""
