"""Agents see every effect of the camera and of its pictures, through both cameras, and neutral ones cost nothing."""

import numpy as np
import pytest

from proxytune.domain import make_episode
from proxytune.driving.family import lane_following
from proxytune.driving.robot import read_robot
from proxytune.effects import CATALOGUE, PARAMETERS, Stage, theta_names
from proxytune.settings import Section

NEUTRAL = {name: one.neutral_value(read_robot("duckiebot").figures) for name, one in PARAMETERS.items()}
SEEN = [n for e in CATALOGUE.values() if e.stage in (Stage.CAMERA, Stage.IMAGE) for n in theta_names(e)]
IMAGE = [n for e in CATALOGUE.values() if e.stage is Stage.IMAGE for n in theta_names(e)]
COMMANDS = np.tile((0.2, 0.5), (8, 1))
"""For so many control steps that the robot moves, which shutters need."""


def family(folder, **domain):
    exactly = {"position_noise_m": 0.0, "heading_noise_deg": 0.0}
    settings = {"plant": "planar", "seconds": 2.0, **exactly, **domain}
    return lane_following(Section(folder / "study.toml", "domain.", settings), model=None)


def observed(domain, seed=5, commands=COMMANDS, **theta):
    return domain.replay(make_episode(theta, agent="-", start=3, seed=seed), commands)


def driven(domain, seed=5, **theta):
    return domain.drive(make_episode(theta, agent="wary", start=1, seed=seed)).poses


@pytest.mark.parametrize("camera", ["ground_plane", pytest.param("renderer", marks=pytest.mark.slow)])
@pytest.mark.parametrize("name", SEEN)
def test_the_picture_of_an_agent_shows_each_effect(tmp_path, name, camera):
    domain, commands = family(tmp_path, camera=camera), COMMANDS if name in IMAGE else COMMANDS[:1]
    plain = observed(domain, commands=commands, **{name: NEUTRAL[name]})
    for probe in (PARAMETERS[name].probes[0], PARAMETERS[name].probes[-1]):
        moved = observed(domain, commands=commands, **{name: probe})
        np.testing.assert_array_equal(moved.poses, plain.poses)
        assert np.abs(moved.pictures[-1].astype(float) - plain.pictures[-1]).mean() > 0.05


def test_neutral_image_effects_leave_no_work_and_no_trace_in_an_episode(tmp_path):
    domain, neutral = family(tmp_path), {name: NEUTRAL[name] for name in IMAGE}
    assert len(IMAGE) > 6
    assert domain.instance(neutral).image.effects == ()
    np.testing.assert_array_equal(driven(domain, **neutral), driven(domain, blur=0.0))


@pytest.mark.parametrize("name", IMAGE)
def test_an_image_effect_stays_while_one_of_its_values_is_not_neutral(tmp_path, name):
    theta = {other: NEUTRAL[other] for other in IMAGE} | {name: PARAMETERS[name].probes[0]}
    assert [effect.name for effect in family(tmp_path).instance(theta).image.effects] == [name.split(".")[0]]


def test_noise_is_the_same_for_the_same_seed_and_another_for_another(tmp_path):
    domain = family(tmp_path)
    noisy = {"image_noise": 20.0}
    np.testing.assert_array_equal(driven(domain, **noisy), driven(domain, **noisy))
    pictures = [observed(domain, seed, **noisy).pictures for seed in (5, 5, 6)]
    np.testing.assert_array_equal(pictures[0], pictures[1])
    assert np.abs(pictures[0].astype(float) - pictures[2]).mean() > 10.0


def test_pictures_are_clipped_only_once_all_effects_have_met_them(tmp_path):
    """Noise cannot be seen on a sky that is four times as bright as a picture can show."""
    sky = np.s_[:, 0, :, 2]
    noisy, bright = {"image_noise": 10.0}, {"exposure.gain": 4.0}
    assert (observed(family(tmp_path), **noisy).pictures[sky] < 255).any()
    assert (observed(family(tmp_path), **noisy, **bright).pictures[sky] == 255).all()
