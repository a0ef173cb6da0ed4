"""Numba and NumPy look up the same texels, to the bit; where Numba is not at hand, NumPy does it."""

import importlib
import itertools
import os
import subprocess
import sys

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from nominal_camera import CAMERA

from proxytune.domain import make_episode
from proxytune.driving import ground_plane
from proxytune.driving.family import lane_following
from proxytune.driving.road.reading import shipped_map
from proxytune.driving.road.texture import draw_floor
from proxytune.driving.texels import choosing, plain
from proxytune.effects.sight.shutter import Blur
from proxytune.settings import Section

TABLE = ground_plane.GroundPlaneCamera(CAMERA, draw_floor(shipped_map("small_loop")))._table
NUMBERED = TABLE._replace(texels=np.arange(TABLE.texels.size, dtype=np.uint32))
"""Every texel has a colour of its own: on the road most have their neighbours'."""


@pytest.fixture(scope="module")
def compiled():
    pytest.importorskip("numba", reason="Numba is not installed: pip install 'proxytune[fast]'")
    return importlib.import_module("proxytune.driving.texels.compiled")


def place(x, y, heading):
    return np.cos(heading), np.sin(heading), x, y


near = st.floats(-1.0, 4.0)


@given(st.lists(st.builds(place, near, near, st.floats(-7.0, 7.0)), min_size=1, max_size=5))
@settings(max_examples=200, derandomize=True, deadline=None)
def test_both_show_the_same_texels_on_the_map_and_off_it(compiled, places):
    poses = np.array(places, dtype=np.float32)
    np.testing.assert_array_equal(compiled.look_up(NUMBERED, poses), plain.look_up(NUMBERED, poses))


@pytest.mark.parametrize("wrong", [np.nan, np.inf, -np.inf, 1e30, 50.0])
def test_a_robot_that_is_nowhere_sees_something(compiled, wrong):
    shown = compiled.look_up(TABLE, np.full((2, 4), wrong, dtype=np.float32))
    assert np.isin(shown, TABLE.texels).all()


@given(st.floats(0.0, 0.2), st.integers(0, 2**32 - 1))
@settings(max_examples=100, derandomize=True, deadline=None)
def test_both_blur_to_the_same_picture(compiled, blur, seed):
    weights = Blur(blur).mean_weights(60.0)
    glimpses = np.random.default_rng(seed).integers(0, 2**32, (len(weights), 40), dtype=np.uint32)
    pictures = np.empty((2, 40, 3), dtype=np.uint8)
    for average, colours in zip((compiled.average, plain.average), pictures, strict=True):
        average(glimpses, weights, colours)
    np.testing.assert_array_equal(*pictures)


@pytest.mark.parametrize("plant", ["planar", pytest.param("bullet", marks=pytest.mark.slow)])
def test_an_episode_is_the_same_without_numba(compiled, tmp_path, monkeypatch, plant):
    family = lane_following(Section(tmp_path / "study.toml", "domain.", {"plant": plant}), model=None)
    episode = make_episode({}, agent="steady", start=2, seed=5)
    monkeypatch.setattr(ground_plane, "fastest", lambda: compiled)
    with_numba = family.drive(episode).poses
    monkeypatch.setattr(ground_plane, "fastest", lambda: plain)
    np.testing.assert_array_equal(family.drive(episode).poses, with_numba)


def test_numpy_does_it_where_numba_is_told_not_to_compile(compiled):
    code = "from proxytune.driving.texels.choosing import by_numba; print(by_numba().__name__)"
    told = subprocess.run(
        [sys.executable, "-c", code],
        env={**os.environ, "NUMBA_DISABLE_JIT": "1"},
        capture_output=True,
        text=True,
        check=True,
    )
    assert told.stdout == "proxytune.driving.texels.plain\n"


@pytest.mark.parametrize("at_hand", [True, False])
def test_numpy_does_it_where_numba_does_not_work(compiled, monkeypatch, at_hand):
    if not at_hand:
        monkeypatch.delattr("proxytune.driving.texels.compiled")
        monkeypatch.setitem(sys.modules, "proxytune.driving.texels.compiled", None)
    assert choosing.by_numba.__wrapped__() is (compiled if at_hand else plain)


def test_numba_is_loaded_once_that_pays_off(compiled, monkeypatch):
    monkeypatch.setattr(choosing, "_uses", itertools.count(choosing.PAYS_OFF - 2))
    assert [choosing.fastest() for _ in range(4)] == [plain, plain, compiled, compiled]
