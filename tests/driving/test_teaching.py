"""Lane following as a classroom: what its expert shows, and what a policy scores."""

import functools
import inspect
from pathlib import Path

import numpy as np
import pytest

from proxytune.domain import Classroom, DomainFamily, OnPolicyClassroom, make_episode
from proxytune.driving.agents.pupil import Pupil
from proxytune.driving.episode import TICK_HZ, Course, Sight, drive
from proxytune.driving.expert import Expert
from proxytune.driving.family import lane_following
from proxytune.driving.lane_following import LaneFollowing
from proxytune.driving.road.lane import off_map
from proxytune.driving.road.reading import shipped_map
from proxytune.driving.robot import read_robot
from proxytune.driving.task import driving_score, start_pose
from proxytune.errors import EpisodeError, SettingsError
from proxytune.settings import Section

ROAD = shipped_map("small_loop")
ROBOT = read_robot("duckiebot")
RATE = int(ROBOT.figures["control_rate"])
both_plants = pytest.mark.parametrize("plant", ["bullet", "planar"])


def lean(picture):
    """Turns away from the brighter half of the picture."""
    half = picture.shape[1] // 2
    towards = (picture[:, half:].mean() - picture[:, :half].mean()) / 255.0
    return (0.3 - towards, 0.3 + towards)


AGENT = f"""
{inspect.getsource(lean)}
class Leaning:
    def begin(self, robot): return None
    def act(self, picture, memory): return lean(picture), memory
"""


def classroom(folder=Path(), **domain) -> LaneFollowing:
    return lane_following(Section(folder / "study.toml", "domain.", {"seconds": 2.0, **domain}), model=None)


def episode(start=1, seed=5, agent="expert", **theta):
    return make_episode(theta, agent=agent, start=start, seed=seed)


def lesson(room, what, seconds):
    """The drive behind a demonstration."""
    instance = room.instance(dict(what.theta))
    noise = {"position_noise_m": room.position_noise_m, "heading_noise_deg": room.heading_noise_deg}
    start = np.array(start_pose(ROAD, what.start, seed=what.seed, **noise))
    course = Course(start, seconds, what.seed, functools.partial(off_map, ROAD))
    expert = Expert(ROAD, *ROBOT.expert_figures(), what.seed)
    with room.plant_at(ROBOT, start) as plant:
        return drive(instance, plant, expert, course, Sight)


def parameters(method):
    return list(inspect.signature(method).parameters)


def test_lane_following_has_every_member_of_a_classroom():
    members = {name: member for name, member in vars(Classroom).items() if not name.startswith("_")}
    members |= {name: member for name, member in vars(OnPolicyClassroom).items() if not name.startswith("_")}
    members |= {name: member for name, member in vars(DomainFamily).items() if not name.startswith("_")}
    assert {"demonstrate", "guide", "examine", "best_score", "identity", "run"} <= set(members)
    for name, wanted in members.items():
        given = getattr(LaneFollowing, name)
        if isinstance(wanted, property):
            assert isinstance(given, property), name
        else:
            assert parameters(given) == parameters(wanted), name


@both_plants
def test_a_lesson_on_the_road_shows_a_picture_and_a_command_for_every_step(plant):
    samples, asked = classroom(plant=plant).demonstrate(episode(), 1.5)
    assert asked == round(1.5 * RATE)
    assert samples.observations.shape == (asked, 48, 64, 3)
    assert samples.observations.dtype == np.uint8
    assert samples.commands.shape == (asked, 2)
    assert np.abs(samples.commands).max() <= 1.0


@both_plants
def test_the_same_lesson_shows_the_same_samples_to_the_last_bit(plant):
    room = classroom(plant=plant)
    first, again = (room.demonstrate(episode(), 1.0)[0] for _ in range(2))
    np.testing.assert_array_equal(first.observations, again.observations)
    np.testing.assert_array_equal(first.commands, again.commands)


def test_another_seed_start_or_theta_shows_other_samples():
    room = classroom(plant="planar")
    lessons = [episode(), episode(seed=6), episode(start=4), episode(trim=0.1)]
    shown = [room.demonstrate(one, 1.0)[0] for one in lessons]
    for other in shown[1:]:
        assert (other.commands != shown[0].commands).any()
        assert (other.observations != shown[0].observations).any()


@both_plants
def test_the_pictures_are_those_that_an_agent_would_have_seen(plant):
    room = classroom(plant=plant)
    samples, _ = room.demonstrate(episode(), 1.0)
    seen = room.replay(episode(), lesson(room, episode(), 1.0).commands).pictures
    np.testing.assert_array_equal(samples.observations, seen)


@pytest.mark.parametrize(
    ("theta", "seconds", "left_the_map"),
    [({"trim": 0.5}, 12.0, False), ({"trim": -0.5}, 12.0, True)],
    ids=("on the map", "off the map"),
)
def test_steps_off_the_road_are_not_shown_but_counted_among_those_asked_for(theta, seconds, left_the_map):
    room, what = classroom(plant="planar"), episode(seed=4, **theta)
    samples, asked = room.demonstrate(what, seconds)
    driven = lesson(room, what, seconds)
    on_road = np.array(driven.memory.on_road)
    assert (len(on_road) < asked) == left_the_map
    assert 0 < on_road.sum() < len(on_road)
    assert asked == round(seconds * RATE)
    np.testing.assert_array_equal(samples.commands, np.array(driven.memory.commands)[on_road])
    np.testing.assert_array_equal(samples.observations, np.array(driven.memory.pictures)[on_road])


@both_plants
def test_a_guided_policy_drives_as_it_does_alone_and_sees_what_it_sees_then(plant):
    room = classroom(plant=plant)
    samples, asked = room.guide(episode(), lean, 1.0)
    driven = room._drive(episode(), Pupil(lean), room.course(episode(), 1.0))
    assert len(driven.commands) == len(samples.commands) == asked == RATE
    np.testing.assert_array_equal(samples.observations, room.replay(episode(), driven.commands).pictures)


def test_a_guided_policys_steps_are_labelled_with_what_the_expert_would_do_there():
    room = classroom(plant="planar")
    samples, _ = room.guide(episode(), lean, 1.0)
    poses = room._drive(episode(), Pupil(lean), room.course(episode(), 1.0)).poses[:: TICK_HZ // RATE]
    expert = Expert(ROAD, *ROBOT.expert_figures(), seed=0)
    asked = [expert.act(Sight(None, pose), expert.begin(ROBOT))[1].commands[0] for pose in poses[:RATE]]
    np.testing.assert_array_equal(samples.commands, asked)
    assert np.abs(samples.commands - [lean(picture) for picture in samples.observations]).max() > 0.05


def test_a_policy_that_drives_as_the_expert_does_visits_what_it_is_shown():
    room = classroom(plant="planar")
    shown, commands = lesson(room, episode(), 1.0).memory, iter(lesson(room, episode(), 1.0).commands)
    samples, _ = room.guide(episode(), lambda picture: next(commands), 1.0)
    np.testing.assert_array_equal(samples.observations, np.array(shown.pictures))
    np.testing.assert_array_equal(samples.commands, np.array(shown.commands))


def test_where_a_guided_policy_is_off_the_road_nothing_is_labelled():
    room, straight = classroom(plant="planar"), lambda picture: np.array((0.5, 0.5))
    samples, asked = room.guide(episode(start=1), straight, 12.0)
    driven = room._drive(episode(start=1), Pupil(straight), room.course(episode(start=1), 12.0))
    assert 0 < len(samples.commands) == len(samples.observations) < len(driven.commands) < asked == 12 * RATE


def lost(picture):
    raise ValueError("lost")


def test_a_guided_policy_that_fails_is_told_with_the_time_in_one_line():
    with pytest.raises(EpisodeError, match=r"^raised ValueError at 0\.00 s: lost$"):
        classroom(plant="planar").guide(episode(), lost, 1.0)


@pytest.mark.parametrize("method", ["demonstrate", "guide"])
def test_a_robot_without_an_expert_is_refused_in_one_line(tmp_path, method):
    room = LaneFollowing("irobot_create", "planar", "ground_plane", ROAD, 2.0, 0.01, 2.0, (), tmp_path)
    with pytest.raises(SettingsError) as caught:
        room.demonstrate(episode(), 1.0) if method == "demonstrate" else room.guide(episode(), lean, 1.0)
    assert str(caught.value) == (
        "robot 'irobot_create' has no expert: its robot.toml states no expert_look_ahead, expert_speed, expert_gain, "
        "expert_disturbance; add them, or teach with a robot that has one"
    )


@both_plants
def test_an_examination_scores_the_drive_of_the_agent_that_answers_as_the_policy_does(tmp_path, plant):
    (tmp_path / "mine.py").write_text(AGENT, encoding="utf-8")
    room = classroom(tmp_path, plant=plant, seconds=4.0)
    driven = room.drive(episode(agent="mine:Leaning"))
    distance = ROBOT.figures["wheel_distance"]
    expected = driving_score(ROAD, driven.poses, wheel_distance=distance, tick_s=1 / TICK_HZ, seconds=4.0)
    assert room.examine(episode(), lean) == expected
    assert -4.0 < expected < 4.0


@both_plants
def test_standing_where_it_was_put_down_scores_best(plant):
    room = classroom(plant=plant, position_noise_m=0.0)
    assert room.examine(episode(start=5), lambda picture: np.zeros(2)) == pytest.approx(room.best_score)


@pytest.mark.parametrize("seconds", [2.0, 60.0])
def test_the_best_score_is_every_second_of_an_examination(seconds):
    assert classroom(seconds=seconds).best_score == seconds


@both_plants
def test_leaving_the_lane_scores_worse_than_staying(plant):
    room = classroom(plant=plant, seconds=3.0, position_noise_m=0.0)
    assert room.examine(episode(start=5), lambda picture: np.array((0.5, 0.2))) < room.best_score - 1.0


@both_plants
@pytest.mark.parametrize(
    ("policy", "says"),
    [
        (lost, "raised ValueError at 0.00 s: lost"),
        (lambda picture: np.array((0.1, np.nan)), "answered [0.1, nan] at 0.00 s; duties must be finite"),
        (lambda picture: np.zeros(3), "answered with shape (3,) at 0.00 s; a command is two duties, left and right"),
        (lambda picture: None, "answered with shape () at 0.00 s; a command is two duties, left and right"),
    ],
    ids=("raises", "not a number", "three duties", "nothing"),
)
def test_a_policy_that_fails_is_told_with_the_time_in_one_line(plant, policy, says):
    with pytest.raises(EpisodeError) as caught:
        classroom(plant=plant).examine(episode(), policy)
    assert str(caught.value) == says


def test_a_pupil_answers_each_picture_by_its_policy_and_remembers_nothing():
    picture = np.full((48, 64, 3), 7, dtype=np.uint8)
    pupil = Pupil(lambda seen: seen[0, 0, :2] / 100.0)
    command, memory = pupil.act(picture, pupil.begin(ROBOT))
    assert command == pytest.approx([0.07, 0.07])
    assert memory is None
