"""What frames cannot show is said, and what to take to see it."""

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

sys.path.append(str(Path(__file__).parents[1]))
from viewed import OPTICS, driven, everything, stood

from proxytune.diagnosis.camera.measured.edges import Edges
from proxytune.diagnosis.camera.model.projection import project
from proxytune.diagnosis.camera.naming.search import fit_everything
from proxytune.diagnosis.camera.naming.visibility import ALWAYS, hidden_effects, next_views

MOTION = ("camera_latency", "rolling_shutter")


def only(views, chosen):
    return replace(views, edges=Edges(*(field[chosen] for field in views.edges)))


def test_frames_standing_still_hide_latency_and_shutter():
    hidden = hidden_effects(everything(), ("camera_pitch",))
    assert set(MOTION) <= set(hidden)
    assert not {"camera_pitch", "camera_roll", "camera_yaw", "lens_distortion"} & set(hidden)


def test_a_drive_shows_latency():
    assert "camera_latency" not in hidden_effects(everything(count=40, moving=True), ("camera_pitch",))


def test_a_readout_that_is_stated_is_not_hidden():
    full = fit_everything(
        driven(), (*OPTICS.mounting, "camera_latency"), {"rolling_shutter": 0.02}, learn_scatter=False
    )
    assert "rolling_shutter" not in hidden_effects(full, ("camera_pitch",))


def test_markings_far_away_alone_hide_where_the_lens_is():
    full = everything(count=30)
    there = project(full.views, full.state)
    far = only(full.views, np.linalg.norm(there.lever, axis=1) > 0.7)
    assert len(far.edges.row) > 300
    few = fit_everything(far, OPTICS.mounting, {}, learn_scatter=False)
    hidden, shown = hidden_effects(few, ("camera_pitch",)), hidden_effects(full, ("camera_pitch",))
    assert {"camera_height", "camera_forward"} <= set(hidden)
    assert not {"camera_height", "camera_forward"} & set(shown)


def test_no_edges_hide_everything():
    views = stood(count=3)
    full = fit_everything(only(views, np.zeros(len(views.edges.row), bool)), OPTICS.mounting, {}, learn_scatter=False)
    effects = {name.split(".")[0] for name in (*OPTICS.mounting, *MOTION)}
    assert set(hidden_effects(full, ())) == effects


def test_effects_of_the_model_are_not_hidden():
    full = everything(count=30)
    model = ("camera_pitch", "field_of_view", "camera_height")
    assert not set(model) & set(hidden_effects(full, model))


@pytest.mark.parametrize(
    ("hidden", "words"),
    [
        ("camera_latency", "driving bends"),
        ("blur", "driving bends"),
        ("camera_forward", "nearer than 0.4 m"),
        ("camera_yaw", "both lanes"),
        ("image_noise", "ten frames standing still"),
    ],
)
def test_the_next_views_are_those_that_show_what_was_hidden(hidden, words):
    (view,) = next_views((hidden,), repeated=False)
    assert words in view


def test_there_is_nothing_to_take_where_nothing_was_hidden():
    assert next_views((), repeated=False) == ()
    assert next_views(("image_noise",), repeated=True) == ()


def test_what_a_tracker_does_is_always_a_rival():
    assert ALWAYS == {
        "camera_yaw": "heading_offset",
        "camera_forward": "marker_offset",
        "camera_latency": "clock offset",
    }
