"""Robots side by side: each drives, and is scored, exactly as it is by itself."""

import dataclasses
import functools
from pathlib import Path

import numpy as np
import pytest

from proxytune.domain import BatchClassroom, Demonstration, make_episode
from proxytune.driving import LaneFollowing, drive, lane_following
from proxytune.driving.expert import Pupil
from proxytune.driving.fleet import AT_ONCE, drive_fleet, fleet_at, plant_at
from proxytune.effects import CATALOGUE, Stage, theta_names
from proxytune.errors import EpisodeError, SettingsError
from proxytune.files import shipped
from proxytune.learning import policy_of
from proxytune.learning.cloning import BehaviourCloning
from proxytune.learning.learner import Taught
from proxytune.settings import Section

TWIN = shipped("studies") / "teacher" / "twin.toml"
both_plants = pytest.mark.parametrize("plant", ["bullet", "planar"])
LEARNT = {
    **{"learnt.range.forward@low": -0.6, "learnt.range.forward@high": 0.6},
    **{"learnt.range.yaw@low": -4.0, "learnt.range.yaw@high": 4.0},
    **{"learnt.turn_rate.yaw@-2.0": 0.4, "learnt.turn_rate.yaw@2.0": -0.4, "learnt.time.left@3.0": -0.2},
}


def classroom(folder=Path(), *, model=None, effects=None, **domain) -> LaneFollowing:
    room = lane_following(Section(folder / "study.toml", "domain.", {"seconds": 3.0, **domain}), model=model)
    return dataclasses.replace(room, effects=(*room.effects, *(effects or {}).items()))


def episodes(count=4, **theta):
    return [make_episode(theta, agent="pupil", start=start, seed=50 + start) for start in range(count)]


def lean(picture):
    """Turns away from the brighter half of the picture, hard."""
    half = picture.shape[1] // 2
    towards = (picture[:, half:].mean() - picture[:, :half].mean()) / 60.0
    return np.array((0.4 - towards, 0.4 + towards))


@functools.cache
def cloned():
    """A policy that was trained, however badly: its answers depend on every cell of the picture."""
    generator = np.random.default_rng(3)
    seen = generator.integers(0, 256, (80, 48, 64, 3), dtype=np.uint8)
    learner = BehaviourCloning(steps=60)
    return policy_of(learner, learner.train(Demonstration(seen, generator.uniform(0.1, 0.5, (80, 2))), None, 0))


def alone_and_together(room, what, policy):
    """The poses of each robot, driven by itself and side by side."""
    instance, courses = room.instance(dict(what[0].theta)), [room.course(one, room.seconds) for one in what]
    alone = []
    for course in courses:
        with plant_at(room.plant, instance.robot, course.start) as plant:
            alone.append(drive(instance, plant, Pupil(policy), course).poses)
    with fleet_at(room.plant, instance.robot, np.stack([course.start for course in courses])) as fleet:
        driven = drive_fleet([instance] * len(what), fleet, [Pupil(policy) for _ in what], courses)
    return alone, [one.poses for one in driven]


def assert_same(alone, together):
    assert len(alone) == len(together)
    for one, other in zip(alone, together, strict=True):
        np.testing.assert_array_equal(one, other)


INSTANCES = {
    "the twin of studies/teacher": {"model": TWIN},
    "noise in every picture": {"effects": {"image_noise": 9.0, "blur": 0.04}},
    "late and lost commands": {"effects": {"delay_jitter": 0.1, "dropped_commands": 0.2, "delay": 0.07}},
    "other pictures": {"effects": {"rolling_shutter": 0.03, "defocus": 0.01, "exposure.gamma": 1.3}},
    "what was learnt": {"effects": LEARNT},
}


@pytest.mark.parametrize("plant", [pytest.param("bullet", marks=pytest.mark.slow), "planar"])
@pytest.mark.parametrize("how", INSTANCES.values(), ids=INSTANCES.keys())
@pytest.mark.parametrize("policy", [lean, cloned()], ids=("one by one", "many at once"))
def test_each_robot_drives_and_scores_to_the_bit_as_it_does_by_itself(plant, how, policy):
    room, what = classroom(plant=plant, **how), episodes()
    assert_same(*alone_and_together(room, what, policy))
    assert room.examine_together(what, policy) == [room.examine(one, policy) for one in what]


def test_robots_that_the_renderer_shows_drive_to_the_bit_as_each_by_itself():
    room = classroom(plant="planar", camera="renderer", effects={"blur": 0.0}, seconds=1.0)
    assert_same(*alone_and_together(room, episodes(2), lean))


MOVING = [name for name, effect in CATALOGUE.items() if effect.stage not in (Stage.CAMERA, Stage.MEASUREMENT)]


@pytest.mark.parametrize("name", MOVING)
def test_every_effect_of_the_catalogue_does_the_same_side_by_side(name):
    probes = [parameter.probes[-1] for parameter in CATALOGUE[name].parameters]
    effects = dict(zip(theta_names(CATALOGUE[name]), probes, strict=True))
    assert_same(*alone_and_together(classroom(plant="planar", effects=effects, seconds=1.5), episodes(3), lean))


OWN = '''
import numpy as np
from proxytune.effects import FilterContext, Stage
from proxytune.space import Parameter

class Wrong:
    """Looks at the whole array, whoever is in it."""
    name, stage, trace = "own:Wrong", Stage.ACTUATION, None
    parameters = (Parameter(name="share", unit="", low=0.0, high=1.0, neutral=0.0, probes=(0.1, 0.5), source="-"),)
    def __init__(self, share): self.share = share
    def begin(self, setting): return None
    def apply(self, signal, memory): return signal * (1.0 - self.share * np.abs(signal).mean()), None
'''


def test_a_user_s_own_effect_is_asked_for_each_robot_by_itself(tmp_path):
    (tmp_path / "own.py").write_text(OWN)
    room = classroom(tmp_path, plant="planar", effects={"own:Wrong": 0.5})
    assert_same(*alone_and_together(room, episodes(), lean))


@both_plants
def test_robots_drop_out_as_they_leave_the_map_and_the_others_go_on(plant):
    room = classroom(plant=plant, seconds=9.0)
    alone, together = alone_and_together(room, episodes(5), lambda picture: np.array((0.6, 0.6)))
    assert len({len(poses) for poses in together}) > 2
    assert_same(alone, together)


def test_episodes_of_several_thetas_and_more_than_drive_at_once_score_as_each_does():
    room = classroom(plant="planar", seconds=1.0)
    several = [*episodes(2), *episodes(2, trim=0.2), *episodes(1)]
    many = [make_episode({}, agent="pupil", start=n % room.starts, seed=n) for n in range(AT_ONCE + 3)]
    for what in (several, many, []):
        assert room.examine_together(what, lean) == [room.examine(one, lean) for one in what]


def test_a_policy_is_asked_only_when_a_picture_is_new():
    room, asked = classroom(plant="planar", seconds=1.0), []
    room.examine_together(episodes(1), lambda picture: asked.append(picture) or np.full(2, 0.1))
    assert len(asked) == 15


def fails(answer, when):
    def policy(picture):
        return answer(picture) if when(picture) else np.full(2, 0.3)

    return policy


def lost(picture):
    raise ValueError(f"lost at {picture.mean():.6f}")


def batch(policy):
    return Taught(policy, lambda pictures: np.array([policy(picture) for picture in pictures]))


@pytest.mark.parametrize("form", [lambda policy: policy, batch], ids=("one by one", "many at once"))
@pytest.mark.parametrize(
    "answer", [lost, lambda p: np.full(2, np.nan), lambda p: np.zeros(3), lambda p: None], ids=range(4)
)
def test_a_policy_that_fails_is_told_as_if_one_episode_followed_the_other(form, answer):
    room, what = classroom(plant="planar", seconds=2.0), episodes()
    firsts = [
        alone_and_together(room, [one], lean)
        and room.instance({}).camera.render(room.course(one, 2.0).start[None])[0].mean()
        for one in what
    ]
    late = form(fails(answer, lambda picture: abs(picture.mean() - firsts[0]) > 0.5))
    with pytest.raises(EpisodeError) as one_by_one:
        [room.examine(one, late) for one in what]
    with pytest.raises(EpisodeError) as together:
        room.examine_together(what, late)
    assert str(together.value) == str(one_by_one.value)
    assert " at 0.00 s" not in str(together.value), "the first robot must not be the first to fail"


@pytest.mark.parametrize("many", [lambda p: 1 / 0, lambda p: np.zeros(2), lambda p: np.full((len(p), 2), np.inf)])
def test_a_policy_that_cannot_answer_many_as_it_should_is_asked_one_by_one(many):
    room, what = classroom(plant="planar", seconds=1.0), episodes(3)
    assert room.examine_together(what, Taught(lean, many)) == [room.examine(one, lean) for one in what]


def test_a_robot_that_cannot_be_examined_is_refused_in_the_same_line():
    room = dataclasses.replace(classroom(plant="planar"), robot="irobot_create")
    with pytest.raises(SettingsError) as alone:
        room.examine(episodes(1)[0], lean)
    with pytest.raises(SettingsError) as together:
        room.examine_together(episodes(2), lean)
    assert str(together.value) == str(alone.value)


def test_lane_following_offers_what_a_classroom_of_many_has():
    members = {name for name in vars(BatchClassroom) if not name.startswith("_")}
    assert members == {"examine_together"}
    assert all(callable(getattr(LaneFollowing, name)) for name in members)
