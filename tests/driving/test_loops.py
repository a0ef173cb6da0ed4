"""The inner loops give the same by Numba and by NumPy, to the bit; where Numba is not at hand, NumPy does them."""

import importlib
import os
import subprocess
import sys

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from nominal_camera import CAMERA

from proxytune.domain import make_episode
from proxytune.driving import cameras, draw_floor, lane_following, loops, perception, shipped_map
from proxytune.effects import Blur
from proxytune.settings import Section

(TABLE,) = cameras.GroundPlaneCamera(CAMERA, draw_floor(shipped_map("small_loop")))._tables.values()
NUMBERED = TABLE._replace(texels=np.arange(TABLE.texels.size, dtype=np.uint32))
"""Every texel has a colour of its own: on the road most have their neighbours'."""


@pytest.fixture(scope="module")
def compiled():
    return importlib.import_module("proxytune.driving.compiled")


def place(x, y, heading):
    return np.cos(heading), np.sin(heading), -np.sin(heading), np.cos(heading), x, y


def exposed(way, table, places, weights, sky=5):
    planes = np.full((len(places) // len(weights), 3, len(table.last) + sky), 7, dtype=np.uint8)
    way.expose(table, places, weights, planes)
    assert (planes[..., :sky] == 7).all()
    return planes


near = st.floats(-1.0, 4.0)


@pytest.mark.slow
@given(st.lists(st.builds(place, near, near, st.floats(-7.0, 7.0)), min_size=1, max_size=5))
@settings(max_examples=200)
def test_both_show_the_same_texels_on_the_map_and_off_it(compiled, places):
    where, once = np.array(places, dtype=np.float32), np.ones(1, np.float32)
    np.testing.assert_array_equal(*(exposed(way, NUMBERED, where, once) for way in (compiled, loops)))


@pytest.mark.parametrize("wrong", [np.nan, np.inf, -np.inf, 1e30, 50.0])
def test_a_robot_that_is_nowhere_sees_something(compiled, wrong):
    shown = exposed(compiled, TABLE, np.full((2, 6), wrong, dtype=np.float32), np.ones(1, np.float32), sky=0)
    packed = shown.astype(np.uint32)
    assert np.isin(packed[:, 0] + (packed[:, 1] << 8) + (packed[:, 2] << 16), TABLE.texels & 0xFFFFFF).all()


@pytest.mark.slow
@given(st.floats(0.0, 0.2), st.lists(st.builds(place, near, near, st.floats(-7.0, 7.0)), min_size=13, max_size=13))
@settings(max_examples=100)
def test_both_blur_to_the_same_picture(compiled, blur, places):
    weights = Blur(blur).mean_weights(60.0)
    seen = np.array(2 * places[: len(weights)], dtype=np.float32)
    np.testing.assert_array_equal(*(exposed(way, TABLE, seen, weights) for way in (compiled, loops)))


def eyes(rng, robots, pixels):
    places, levels = rng.uniform(-1.0, 1.0, (2, 3, pixels)), rng.integers(0, 256, (2, robots, pixels), dtype=np.uint8)
    return loops.Eyes(*places, rng.integers(0, 3, robots), *levels)


@pytest.mark.slow
@given(st.integers(0, 2**32 - 1), st.integers(1, 5), st.sampled_from([1, 5, 7, 8, 60, 130, 700, 3000]))
@settings(max_examples=150)
def test_both_find_the_same_lanes_in_noise(compiled, seed, robots, pixels):
    """However many pixels count: sums go in NumPy's order."""
    rng = np.random.default_rng(seed)
    looks = eyes(rng, robots, pixels)
    levels = rng.integers(0, 256, (2, robots, pixels), dtype=np.uint8)
    np.testing.assert_array_equal(compiled.find_lanes(looks, *levels), loops.find_lanes(looks, *levels))


@pytest.mark.parametrize("plant", ["planar", pytest.param("bullet", marks=pytest.mark.slow)])
def test_an_episode_is_the_same_without_numba(compiled, tmp_path, monkeypatch, plant):
    family = lane_following(Section(tmp_path / "study.toml", "domain.", {"plant": plant}), model=None)
    episode = make_episode({}, agent="steady", start=2, seed=5)
    driven = []
    for way in (compiled, loops):
        for module in (cameras, perception):
            monkeypatch.setattr(module, "fastest", lambda pictures, way=way: way)
        driven.append(family.drive(episode).poses)
    np.testing.assert_array_equal(*driven)


def test_numpy_does_it_where_told_so_and_numba_is_loaded_once_that_pays_off(compiled, monkeypatch):
    code = "from proxytune.driving.loops import by_numba; print(by_numba().__name__)"
    off = {**os.environ, "NUMBA_DISABLE_JIT": "1"}
    assert subprocess.check_output([sys.executable, "-c", code], env=off, text=True) == "proxytune.driving.loops\n"
    monkeypatch.setattr(loops, "_used", [loops.PAYS_OFF - 20])
    assert [loops.fastest(10) for _ in range(4)] == [loops, loops, compiled, compiled]


@pytest.mark.parametrize("at_hand", [True, False])
def test_numpy_does_it_where_numba_does_not_work(compiled, monkeypatch, at_hand):
    if not at_hand:
        monkeypatch.delattr("proxytune.driving.compiled")
        monkeypatch.setitem(sys.modules, "proxytune.driving.compiled", None)
    assert loops.by_numba.__wrapped__() is (compiled if at_hand else loops)
