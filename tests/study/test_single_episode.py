"""One episode to look at, in proxy and target: the same but for what the domains differ in."""

import inspect

import numpy as np
import pytest
from episodes import paired, recorded
from hypothesis import given, settings, strategies as st

from proxytune.api import drive, read_theta
from proxytune.domain import make_episode
from proxytune.errors import EpisodeError, InputError
from proxytune.study import (
    APART_M,
    check_episode,
    drive_side_by_side,
    load_family,
    read_study_settings,
    record_episode,
)

LANE = {"robot": '"duckiebot"', "plant": '"planar"', "seconds": "2.0"}
MODEL = 'format = 1\nrobot = "duckiebot"\n[effects.trim]\ntrim = 0.2\n'


@pytest.fixture(scope="module")
def lane(make_studies):
    return make_studies(
        "lane", domain=LANE, family='"proxytune.driving.family:lane_following"', agents='["steady", "wary"]'
    )


def side_by_side(folder, theta, tmp_path):
    settings = read_study_settings(folder)
    proxy = load_family(settings, settings.proxy)
    (tmp_path / "model.toml").write_text(MODEL)
    target = load_family(settings, tmp_path / "model.toml")
    return drive_side_by_side(make_episode(theta, agent="steady", start=1, seed=5), proxy=proxy, target=target)


def test_proxy_and_target_are_named_where_both_drive():
    taken = inspect.signature(drive_side_by_side).parameters
    assert {taken[side].kind for side in ("proxy", "target")} == {inspect.Parameter.KEYWORD_ONLY}


def test_a_proxy_starts_where_its_target_does_and_parts_from_one_unlike_it(lane, tmp_path):
    pair = side_by_side(lane, {"trim": 0.2}, tmp_path)
    assert pair.proxy.metrics == pair.target.metrics
    assert np.array_equal(pair.proxy.places, pair.target.places)
    assert pair.parted_s is None
    assert (pair.road.name, pair.command_unit) == ("small_loop", "duty")
    pair = side_by_side(lane, {"trim": -0.2}, tmp_path)
    assert np.array_equal(pair.proxy.places[0], pair.target.places[0])
    row = round(60 * pair.parted_s)
    gaps = np.hypot(*(pair.proxy.places - pair.target.places).T)
    assert gaps[row] > APART_M >= gaps[:row].max()


CURVE = "[effects.learnt.range]\nforward = [-1, 1]\nyaw = [-9, 9]\n[effects.learnt.direction]\nknots = [1.0]\n"
CURVE += "forward = [-0.5]\nyaw = [0]\nveer = [0]\n"


def test_curves_of_a_model_are_driven_by_a_family_that_is_built_of_effects_and_by_no_other(lane, make_study, tmp_path):
    (tmp_path / "model.toml").write_text(MODEL + CURVE)
    curved = read_theta(str(tmp_path / "model.toml"))
    distances = [drive(lane, "steady", theta).scores["distance"] for theta in (curved, {"trim": curved["trim"]})]
    assert distances[0] < 0.7 * distances[1]
    of_its_own = read_study_settings(make_study())
    curves = {name: value for name, value in curved.items() if name != "trim"}
    with pytest.raises(InputError, match=r"unknown parameter 'learnt\.range"):
        check_episode(load_family(of_its_own, of_its_own.proxy), "agent0", curves, 0)


@settings(max_examples=20)
@given(st.floats(0.03, 1.0))
def test_they_part_at_the_first_time_that_is_further_apart_than_the_limit(speed):
    pair = paired(recorded(lambda time: speed * time), recorded(lambda time: 0.0 * time))
    later = [tenth / 10 for tenth in range(21) if speed * (tenth / 10) > APART_M]
    assert pair.parted_s == pytest.approx(later[0])


def test_places_are_compared_at_the_same_time_until_one_has_ended():
    assert paired(recorded(lambda time: 0.04 * time), recorded(lambda time: 0.0 * time, seconds=1.0)).parted_s is None
    fast, slow = recorded(lambda time: 0.5 * time), recorded(lambda time: 0.5 * time)
    thinned = {name: column[::4] for name, column in slow.poses.items()}
    assert paired(fast, type(slow)(slow.metrics, thinned, slow.commands)).parted_s is None


WATCHER = """
import inspect

import numpy as np

class Watcher:
    def begin(self, robot):
        return 0

    def act(self, picture, memory):
        return np.array([picture.mean() / 255.0, 0.3]), 0
"""


def family_of(folder):
    settings = read_study_settings(folder)
    return load_family(settings, settings.proxy)


"""An agent whose left duty is the brightness of the picture that it sees."""


def test_pictures_are_those_that_the_agent_saw_kept_only_for_who_asks_and_where_there_is_a_camera(lane, make_study):
    (lane / "watcher.py").write_text(WATCHER)
    watched = make_episode({"blur": 0.05}, agent="watcher:Watcher", start=1, seed=3)
    kept = record_episode(family_of(lane), watched, filmed=True)
    assert kept.pictures.shape[0] == len(kept.commands["time"]) > 20
    assert np.allclose(kept.commands["left"], kept.pictures.mean(axis=(1, 2, 3)) / 255.0)
    assert len(set(kept.commands["left"])) > 5, "the picture changes while it drives"
    kept = record_episode(family_of(lane), make_episode({}, agent="steady", start=0, seed=3))
    assert kept.pictures is None
    assert kept.channels == ("left", "right")
    assert kept.seconds == pytest.approx(2.0)
    folder = make_study(family='"walking:walking"')
    kept = record_episode(family_of(folder), make_episode({"trim": 0.1}, agent="agent0", start=0, seed=3), filmed=True)
    assert kept.places[-1, 0] == pytest.approx(0.6)
    assert kept.channels == ("head",)
    assert kept.pictures is None


def test_columns_that_do_not_belong_together_are_told_in_one_line(make_study):
    folder = make_study(family='"walking:walking"', domain={"columns": '"x short"'})
    with pytest.raises(EpisodeError, match="poses need a column `time` and as many rows in every column") as problem:
        record_episode(family_of(folder), make_episode({}, agent="agent0", start=0, seed=3))
    assert "\n" not in str(problem.value)
