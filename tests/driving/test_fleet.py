"""Robots side by side: each drives, and is scored, exactly as it is by itself."""

import dataclasses
import functools
import itertools
from pathlib import Path

import numpy as np
import pytest
from one_line import complaint_of

from proxytune.domain import Demonstration, make_episode
from proxytune.driving import LaneFollowing, drive, lane_following
from proxytune.driving.expert import Pupil
from proxytune.driving.fleet import AT_ONCE, drive_fleet, fleet_at, plant_at
from proxytune.effects import CATALOGUE, Stage, theta_names
from proxytune.errors import EpisodeError
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


@pytest.mark.parametrize("policy", [lean, cloned()], ids=("one by one", "many at once"))
def test_each_robot_drives_and_scores_to_the_bit_as_it_does_by_itself(policy):
    room, what = classroom(plant="planar", model=TWIN), episodes()
    assert_same(*alone_and_together(room, what, policy))
    assert room.examine_together(what, policy) == [room.examine(one, policy) for one in what]


@pytest.mark.slow
def test_robots_that_the_renderer_shows_drive_to_the_bit_as_each_by_itself():
    room = classroom(plant="planar", camera="renderer", effects={"blur": 0.0}, seconds=1.0)
    assert_same(*alone_and_together(room, episodes(2), lean))


MOVING = [name for name, effect in CATALOGUE.items() if effect.stage not in (Stage.CAMERA, Stage.MEASUREMENT)]


@pytest.mark.parametrize("name", MOVING)
def test_every_effect_of_the_catalogue_does_the_same_side_by_side(name):
    probes = [parameter.probes[-1] for parameter in CATALOGUE[name].parameters]
    effects = dict(zip(theta_names(CATALOGUE[name]), probes, strict=True))
    assert_same(*alone_and_together(classroom(plant="planar", effects=effects, seconds=1.0), episodes(2), lean))


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
    room = classroom(tmp_path, plant="planar", effects={"own:Wrong": 0.5}, seconds=1.0)
    assert_same(*alone_and_together(room, episodes(3), lean))


def test_episodes_of_several_thetas_and_more_than_drive_at_once_score_as_each_does(monkeypatch):
    monkeypatch.setitem(AT_ONCE, "planar", 2)
    room = classroom(plant="planar", seconds=1.0)
    for what in ([*episodes(2), *episodes(2, trim=0.2), *episodes(1)], episodes(5), []):
        assert room.examine_together(what, lean) == [room.examine(one, lean) for one in what]


def test_a_policy_is_asked_only_when_a_picture_is_new_and_a_robot_without_a_camera_is_refused_alike():
    room, asked = classroom(plant="planar", seconds=1.0), []
    room.examine_together(episodes(1), lambda picture: asked.append(picture) or np.full(2, 0.1))
    assert len(asked) == 15
    room = dataclasses.replace(classroom(plant="planar"), robot="irobot_create")
    assert complaint_of(room.examine_together, episodes(2), lean) == complaint_of(room.examine, episodes(1)[0], lean)


def lost(picture):
    raise ValueError(f"lost at {picture.mean():.6f}")


def batch(policy):
    return Taught(policy, lambda pictures: np.array([policy(picture) for picture in pictures]))


@pytest.mark.parametrize("form", [lambda policy: policy, batch], ids=("one by one", "many at once"))
@pytest.mark.parametrize("answer", [lost, lambda p: np.full(2, np.nan), lambda p: np.zeros(3)], ids=range(3))
def test_a_policy_that_fails_is_told_as_if_one_episode_followed_the_other(form, answer):
    room, what = classroom(plant="planar", seconds=2.0), episodes(3)
    first = room.instance({}).camera.render(room.course(what[0], 2.0).start[None])[0].mean()
    late = form(lambda picture: answer(picture) if abs(picture.mean() - first) > 0.5 else np.full(2, 0.3))
    with pytest.raises(EpisodeError) as one_by_one:
        [room.examine(one, late) for one in what]
    with pytest.raises(EpisodeError) as together:
        room.examine_together(what, late)
    assert str(together.value) == str(one_by_one.value)
    assert " at 0.00 s" not in str(together.value), "the first robot must not be the first to fail"


@pytest.mark.parametrize("many", [lambda p: 1 / 0, lambda p: np.zeros(2), lambda p: np.full((len(p), 2), np.inf)])
def test_a_policy_that_cannot_answer_many_as_it_should_is_asked_one_by_one(many):
    room, what = classroom(plant="planar", seconds=1.0), episodes(2)
    assert room.examine_together(what, Taught(lean, many)) == [room.examine(one, lean) for one in what]


MIXED = (
    {},
    {"delay_jitter": 0.1, "dropped_commands": 0.2},
    {"trim": 0.2, "blur": 0.08},
    {"image_noise": 9.0, "motor_lag.imbalance": 0.3},
    LEARNT,
)
SEVERAL = ("steady", "wary", "braitenberg", "laggy", "smooth", "edges", "steady")


def mixed(count=15):
    """Episodes of several agents, starts and θ, in no order."""
    thetas, agents = itertools.cycle(MIXED), itertools.cycle(SEVERAL)
    many = zip(range(count), thetas, agents, strict=False)
    return [make_episode(theta, agent=agent, start=n % 4, seed=n) for n, theta, agent in many]


@pytest.mark.parametrize("plant", [pytest.param("bullet", marks=pytest.mark.slow), "planar"])
def test_episodes_of_several_agents_starts_and_thetas_score_side_by_side_as_each_by_itself(plant):
    room, what = classroom(plant=plant, seconds=1.0), mixed()
    alone = [room.run(one) for one in what]
    assert room.run_many(what) == alone
    assert room.run_many(what[::-1]) == alone[::-1]


@both_plants
def test_who_leaves_early_changes_nothing_for_the_others(plant):
    room = classroom(plant=plant, seconds=6.0)
    what = [make_episode({"trim": trim}, agent="daredevil", start=n, seed=n) for n in range(2) for trim in (0.0, 0.5)]
    together = room.drive_many(what)
    assert len({len(one.poses) for one in together}) > 1
    for one, other in zip(together, map(room.drive, what), strict=True):
        np.testing.assert_array_equal(one.poses, other.poses)
        np.testing.assert_array_equal(one.commands, other.commands)


AGENTS_OF_ONE_S_OWN = '''
import numpy as np
from proxytune.driving import AGENTS

class Counting:
    """Goes by how often it was asked, which its memory knows."""
    def begin(self, robot): return 0
    def act(self, picture, memory): return (0.2 + 0.1 * (memory % 3), 0.3), memory + 1

class Late(Counting):
    def act(self, picture, memory):
        if memory == 30: raise ValueError("lost")
        return super().act(picture, memory)

class NoStart(Counting):
    def begin(self, robot): raise KeyError("camera")

class NotFinite(Counting):
    def act(self, picture, memory): return (0.2, np.nan if memory == 12 else 0.3), memory + 1

class Many(Counting):
    def act_many(self, pictures, memories):
        return [self.act(*one)[0] for one in zip(pictures, memories)], [memory + 1 for memory in memories]

class BadMany(Counting):
    def act_many(self, pictures, memories): return np.zeros((1, 2)), memories

class Deciding(Counting):
    def decide(self, picture): return 3
    def act_many(self, pictures, memories): return 1 / 0

class ManyLate(Late):
    def act_many(self, pictures, memories):
        return [self.act(*one)[0] for one in zip(pictures, memories)], [memory + 1 for memory in memories]
'''


@pytest.fixture
def own(tmp_path):
    """A room whose folder has agents of one's own."""
    (tmp_path / "mine.py").write_text(AGENTS_OF_ONE_S_OWN)
    return classroom(tmp_path, plant="planar", seconds=1.6)


def of_agents(*agents):
    return [make_episode({}, agent=agent, start=start, seed=start) for agent in agents for start in range(2)]


def test_agents_that_fail_are_named_with_the_time_and_the_others_go_on_if_there_are_any(own):
    what = of_agents("steady", "mine:Late", "mine:NoStart", "mine:NotFinite", "mine:ManyLate", "mine:Counting")
    told = own.run_many(what)
    assert [str(one) for one in told[2:10]] == [
        *["raised ValueError at 1.50 s: lost"] * 2,
        *["raised KeyError before the first picture: 'camera'"] * 2,
        *["answered [0.2, nan] at 0.60 s; duties must be finite"] * 2,
        *["raised ValueError at 1.50 s: lost"] * 2,
    ]
    assert all(isinstance(one, EpisodeError) for one in told[2:10])
    assert told[:2] + told[10:] == [own.run(one) for one in what[:2] + what[10:]]
    with pytest.raises(EpisodeError, match=r"raised ValueError at 1\.50 s: lost"):
        own.run(what[2])
    assert all(isinstance(one, EpisodeError) for one in own.run_many(of_agents("mine:NoStart", "mine:Late")))


@pytest.mark.parametrize("agent", ["Counting", "Many", "BadMany", "Deciding"])
def test_one_s_own_agents_have_a_memory_for_each_robot_however_they_are_asked(own, agent):
    what = of_agents(f"mine:{agent}", "steady")
    assert own.run_many(what) == [own.run(one) for one in what]
    assert own.run_many(what)[:2] == own.run_many(of_agents("mine:Counting"))


def test_an_effect_of_one_s_own_is_asked_no_more_for_robots_that_have_left(tmp_path):
    counting = OWN.replace("own:", "counted:").replace("    parameters =", "    asked = []\n    parameters =")
    (tmp_path / "counted.py").write_text(counting.replace("return signal *", "self.asked.append(1); return signal *"))
    room = classroom(tmp_path, plant="planar", seconds=9.0, effects={"counted:Wrong": 0.1})
    [asked] = [one.asked for one in room.instance({}).drivetrain.actuation.effects if hasattr(one, "asked")]
    asked.clear()
    driven = room._drive(episodes(4), [Pupil(lambda picture: np.array((0.6, 0.6)))] * 4, 9.0)
    assert len({len(one.commands) for one in driven}) > 1
    assert len(asked) == sum(len(one.commands) for one in driven)
