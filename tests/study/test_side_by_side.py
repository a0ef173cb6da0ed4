"""An episode in proxy and target: the same but for what the domains differ in."""

import numpy as np
import pytest
from episodes import paired, recorded
from hypothesis import given
from hypothesis import strategies as st

from proxytune.domain import make_episode
from proxytune.errors import InputError
from proxytune.study.family import load_family
from proxytune.study.settings import read_study_settings
from proxytune.study.side_by_side import APART_M, drive_side_by_side, load_target

LANE = {"robot": '"duckiebot"', "plant": '"planar"', "seconds": "2.0"}
MODEL = 'format = 1\nrobot = "{}"\n[effects.trim]\ntrim = 0.2\n'


@pytest.fixture(scope="module")
def lane(make_studies):
    return make_studies(
        "lane", domain=LANE, family='"proxytune.driving.family:lane_following"', agents='["steady", "wary"]'
    )


def side_by_side(folder, theta, tmp_path):
    settings = read_study_settings(folder)
    proxy = load_family(settings, settings.proxy)
    (tmp_path / "model.toml").write_text(MODEL.format("duckiebot"))
    target = load_target(settings, proxy, tmp_path / "model.toml", "--against")
    return drive_side_by_side(proxy, target, make_episode(theta, agent="steady", start=1, seed=5))


def test_a_proxy_like_its_target_drives_the_very_same_episode(lane, tmp_path):
    pair = side_by_side(lane, {"trim": 0.2}, tmp_path)
    assert pair.proxy.metrics == pair.target.metrics
    assert np.array_equal(pair.proxy.places, pair.target.places)
    assert pair.parted_s is None
    assert (pair.road.name, pair.command_unit) == ("small_loop", "duty")


def test_another_proxy_starts_at_the_same_place_and_parts_later(lane, tmp_path):
    pair = side_by_side(lane, {"trim": -0.2}, tmp_path)
    assert np.array_equal(pair.proxy.places[0], pair.target.places[0])
    row = round(60 * pair.parted_s)
    gaps = np.hypot(*(pair.proxy.places - pair.target.places).T)
    assert gaps[row] > APART_M >= gaps[:row].max()


@given(st.floats(0.03, 1.0))
def test_they_part_at_the_first_time_that_is_further_apart_than_the_limit(speed):
    pair = paired(recorded(lambda time: speed * time), recorded(lambda time: 0.0 * time))
    later = [tenth / 10 for tenth in range(21) if speed * (tenth / 10) > APART_M]
    assert pair.parted_s == pytest.approx(later[0])


def test_what_happens_after_one_has_ended_does_not_count():
    pair = paired(recorded(lambda time: 0.04 * time), recorded(lambda time: 0.0 * time, seconds=1.0))
    assert pair.parted_s is None


def test_places_are_compared_at_the_same_time_whatever_the_rates():
    fast, slow = recorded(lambda time: 0.5 * time), recorded(lambda time: 0.5 * time)
    thinned = {name: column[::4] for name, column in slow.poses.items()}
    assert paired(fast, type(slow)(slow.metrics, thinned, slow.commands)).parted_s is None


def test_a_model_of_another_robot_is_refused_with_both_names(lane, tmp_path):
    settings = read_study_settings(lane)
    (tmp_path / "other.toml").write_text(MODEL.format("irobot_create"))
    with pytest.raises(InputError, match="other.toml: is of the robot 'irobot_create'; give a model of 'duckiebot'"):
        load_target(settings, load_family(settings, None), tmp_path / "other.toml", "--against")
    with pytest.raises(InputError, match="--against .*none.toml: no such file"):
        load_target(settings, load_family(settings, None), tmp_path / "none.toml", "--against")
