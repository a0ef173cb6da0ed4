"""The expert keeps to the lane by the true pose and comes back to it: a classroom of lane following."""

import dataclasses
import functools
import inspect
from pathlib import Path

import numpy as np
import pytest
from nominal_camera import Dark
from one_line import complaint_of

from proxytune.domain import Classroom, DomainFamily, OnPolicyClassroom, make_episode
from proxytune.driving import TICK_HZ, Expert, LaneFollowing, drive, lane_following, read_robot, shipped_map
from proxytune.driving.episode import Course, Sight, driving_score, start_pose
from proxytune.driving.expert import MEMORY, Pupil
from proxytune.driving.fleet import only
from proxytune.driving.lane import lane_point, off_map
from proxytune.driving.plants import PlanarPlant
from proxytune.effects import Stage, stage_chain
from proxytune.errors import EpisodeError
from proxytune.settings import Section

ROAD = shipped_map("small_loop")
ROBOT = read_robot("duckiebot")
LOOK_AHEAD, SPEED, GAIN, DISTURBANCE = ROBOT.expert_figures()
FAMILY = lane_following(Section(Path("study.toml"), "domain.", {"plant": "planar"}), model=None)
SECONDS = 20.0
NOMINAL = ()
SHIFTED = (("trim", 0.06), ("delay", 0.19))
STEPS = np.array([(1.6, 0.6 + 0.004 * step, np.pi / 2 + 0.02 * np.sin(step / 9.0)) for step in range(80)])
"""Poses that are shown to the expert one after the other, whatever it does."""


def expert(seed=0, *, look_ahead=LOOK_AHEAD, disturbance=0.0, gain=GAIN):
    return Expert(ROAD, look_ahead, SPEED, gain, disturbance, seed)


@functools.lru_cache
def lesson(start, theta=NOMINAL, seconds=SECONDS, seed=0, **figures):
    unseen = {"camera": Dark(), "image": stage_chain((), Stage.IMAGE)}
    instance = dataclasses.replace(FAMILY.instance(dict(theta)), **unseen)
    begin = np.array(start_pose(ROAD, start, seed=seed, position_noise_m=0.01, heading_noise_deg=2.0))
    course = Course(begin, seconds, seed, functools.partial(off_map, ROAD))
    return drive(instance, PlanarPlant(begin, 1 / TICK_HZ), expert(seed, **figures), course, Sight)


def score(driven):
    distance = ROBOT.figures["wheel_distance"]
    return driving_score(ROAD, driven.poses, wheel_distance=distance, tick_s=1 / TICK_HZ, seconds=SECONDS)


def shown(driver, poses=STEPS):
    """What is driven and what is left in the end when the expert is shown these poses."""
    memory, driven = driver.begin(ROBOT), []
    for step, pose in enumerate(poses):
        command, memory = driver.act(Sight(np.full((1, 1, 3), step % 256, dtype=np.uint8), pose), memory)
        driven.append(command)
    return np.array(driven), memory


def pushes(seed, steps=80, disturbance=DISTURBANCE):
    """What is added to the right wheel and taken off the left one."""
    driven, memory = shown(expert(seed, disturbance=disturbance), np.tile(STEPS[:1], (steps, 1)))
    return driven - np.array(memory.commands)


@pytest.mark.slow
@pytest.mark.parametrize("theta", [NOMINAL, SHIFTED], ids=("nominal", "shifted"))
def test_undisturbed_it_keeps_both_wheels_in_the_lane_from_all_ten_starts(theta):
    assert [score(lesson(start, theta)) for start in range(len(ROAD.starts))] == pytest.approx([SECONDS] * 10)


@pytest.mark.parametrize("outer", [True, False])
@pytest.mark.parametrize("left", [-0.06, 0.06])
def test_off_the_centre_line_it_turns_back_to_it(outer, left):
    here, ahead = (lane_point(ROAD, outer, 0.28 + way) for way in (0.0, 0.01))
    heading = np.arctan2(*(ahead - here)[::-1])
    aside = here + left * np.array((-np.sin(heading), np.cos(heading)))
    command = shown(expert(), [np.array((*aside, heading))])[0][0]
    assert (command[1] - command[0]) * left < 0


def test_it_steers_along_the_circle_through_the_point_pursued_and_half_a_metre_ahead_cuts_corners():
    here = lane_point(ROAD, True, 0.1)
    command = shown(expert(), [np.array((*here, np.pi / 2))])[0][0]
    assert command == pytest.approx(np.full(2, SPEED / ROBOT.figures["full_speed"]))
    pose = np.array((*here, np.pi / 2 + 0.2))
    left, right = shown(expert(), [pose])[0][0] * ROBOT.figures["full_speed"]
    radius = SPEED * ROBOT.figures["effective_baseline"] / (right - left)
    middle = here + radius * np.array((-np.sin(pose[2]), np.cos(pose[2])))
    assert np.hypot(*(lane_point(ROAD, True, 0.1 + LOOK_AHEAD) - middle)) == pytest.approx(abs(radius))
    assert (left + right) / 2 == pytest.approx(SPEED)
    once, twice = (shown(expert(gain=gain), STEPS[:30])[0] for gain in (1.0, 1.5))
    assert np.diff(twice) == pytest.approx(1.5 * np.diff(once))
    assert twice.sum(axis=1) == pytest.approx(once.sum(axis=1))
    assert score(lesson(0, SHIFTED, look_ahead=0.5)) < 0.6 * SECONDS
    assert score(lesson(0, SHIFTED)) == pytest.approx(SECONDS)


def test_a_push_turns_the_robot_without_speeding_it_up_is_not_shown_and_follows_from_seed_and_step():
    calm, calm_memory = shown(expert())
    pushed, pushed_memory = shown(expert(disturbance=DISTURBANCE))
    np.testing.assert_array_equal(calm_memory.commands, pushed_memory.commands)
    np.testing.assert_array_equal(calm, calm_memory.commands)
    assert (pushed != calm).all()
    left, right = pushes(0).T
    assert left == pytest.approx(-right)
    assert np.abs(right).min() > 0
    driven, memory = shown(expert(disturbance=5.0))
    assert np.abs(driven).max() == 1.0
    assert np.abs(memory.commands).max() < 1.0
    driven, memory = shown(expert(3, disturbance=DISTURBANCE))
    np.testing.assert_allclose(driven - np.array(memory.commands), pushes(3), atol=1e-12)
    np.testing.assert_array_equal(pushes(3, 20), pushes(3)[:20])
    assert (pushes(3) != pushes(4)).all()
    right = pushes(1, 2000)[:, 1]
    assert right.std() == pytest.approx(DISTURBANCE, rel=0.1)
    assert right.mean() == pytest.approx(0.0, abs=0.2 * DISTURBANCE)
    half_a_second = round(ROBOT.figures["control_rate"] / 2)
    for lag in (1, 2, 5, half_a_second):
        assert np.corrcoef(right[:-lag], right[lag:])[0, 1] == pytest.approx(MEMORY**lag, abs=0.1), lag
    assert MEMORY**half_a_second == pytest.approx(np.exp(-1), abs=0.03)


def test_a_picture_a_shown_command_and_whether_on_the_road_belong_to_every_step():
    driven, memory = shown(expert(disturbance=DISTURBANCE))
    assert len(memory.pictures) == len(memory.commands) == len(memory.on_road) == len(driven) == len(STEPS)
    assert [int(picture[0, 0, 0]) for picture in memory.pictures] == list(range(len(STEPS)))
    assert [len(part) for part in expert().begin(ROBOT)[2:]] == [0, 0, 0]


@pytest.mark.parametrize("heading", [np.pi / 2, -np.pi / 2], ids=("outer", "inner"))
@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_the_road_ends_with_the_outer_edges_of_its_two_lanes(heading, side):
    edge, middle = ROAD.lane_offset + ROAD.lane_width / 2, ROAD.size[0] - ROAD.width / 2
    poses = [np.array((middle + side * way, ROAD.size[0] / 2, heading)) for way in (0.0, edge - 0.001, edge + 0.001)]
    assert shown(expert(), poses)[1].on_road == (True, True, False)


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


def lesson_of_teaching(room, what, seconds):
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
    promised = (Classroom, OnPolicyClassroom, DomainFamily)
    members = {name: member for one in promised for name, member in vars(one).items() if not name.startswith("_")}
    assert {"demonstrate", "guide", "examine", "best_score", "identity", "run"} <= set(members)
    for name, wanted in members.items():
        given = getattr(LaneFollowing, name)
        if isinstance(wanted, property):
            assert isinstance(given, property), name
        else:
            assert parameters(given) == parameters(wanted), name


@both_plants
def test_the_same_lesson_shows_the_same_samples_to_the_last_bit_with_the_pictures_of_an_agent(plant):
    room = classroom(plant=plant)
    first, again = (room.demonstrate(episode(), 1.0)[0] for _ in range(2))
    np.testing.assert_array_equal(first.observations, again.observations)
    np.testing.assert_array_equal(first.commands, again.commands)
    samples, _ = room.demonstrate(episode(), 1.0)
    seen = room.replay(episode(), lesson_of_teaching(room, episode(), 1.0).commands).pictures
    np.testing.assert_array_equal(samples.observations, seen)


def test_another_seed_start_or_theta_shows_other_samples_and_a_lesson_off_the_road_says_where():
    room = classroom(plant="planar")
    shown = [room.demonstrate(one, 1.0)[0] for one in [episode(), episode(seed=6), episode(start=4), episode(trim=0.1)]]
    for other in shown[1:]:
        assert (other.commands != shown[0].commands).any()
        assert (other.observations != shown[0].observations).any()
    driven = lesson(1, (("trim", 0.5),))
    inside = np.abs(driven.poses[:-1:3, :2] - ROAD.size[0] / 2).max(axis=1)
    assert len(driven.memory.on_road) == len(driven.commands)
    assert not all(driven.memory.on_road)
    assert not any(driven.memory.on_road[step] for step in np.flatnonzero(inside < 0.2))


@pytest.mark.parametrize(
    ("theta", "seconds", "left_the_map"),
    [({"trim": 0.5}, 12.0, False), ({"trim": -0.5}, 12.0, True)],
    ids=("on the map", "off the map"),
)
def test_steps_off_the_road_are_not_shown_but_counted_among_those_asked_for(theta, seconds, left_the_map):
    room, what = classroom(plant="planar"), episode(seed=4, **theta)
    samples, asked = room.demonstrate(what, seconds)
    driven = lesson_of_teaching(room, what, seconds)
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
    driven = only(room._drive([episode()], [Pupil(lean)], 1.0))
    assert len(driven.commands) == len(samples.commands) == asked == RATE
    np.testing.assert_array_equal(samples.observations, room.replay(episode(), driven.commands).pictures)


def test_a_guided_policys_steps_are_labelled_by_the_expert_on_the_road_alone_and_failures_timed():
    room = classroom(plant="planar")
    samples, _ = room.guide(episode(), lean, 1.0)
    poses = only(room._drive([episode()], [Pupil(lean)], 1.0)).poses[:: TICK_HZ // RATE]
    expert = Expert(ROAD, *ROBOT.expert_figures(), seed=0)
    asked = [expert.act(Sight(None, pose), expert.begin(ROBOT))[1].commands[0] for pose in poses[:RATE]]
    np.testing.assert_array_equal(samples.commands, asked)
    assert np.abs(samples.commands - [lean(picture) for picture in samples.observations]).max() > 0.05
    room, straight = classroom(plant="planar"), lambda picture: np.array((0.5, 0.5))
    samples, asked = room.guide(episode(start=1), straight, 12.0)
    driven = only(room._drive([episode(start=1)], [Pupil(straight)], 12.0))
    assert 0 < len(samples.commands) == len(samples.observations) < len(driven.commands) < asked == 12 * RATE
    with pytest.raises(EpisodeError, match=r"^raised ValueError at 0\.00 s: lost$"):
        classroom(plant="planar").guide(episode(), lost, 1.0)


def lost(picture):
    raise ValueError("lost")


@pytest.mark.parametrize("method", ["demonstrate", "guide"])
def test_a_robot_without_an_expert_is_refused_in_one_line(tmp_path, method):
    room = LaneFollowing("irobot_create", "planar", "ground_plane", ROAD, 2.0, 0.01, 2.0, (), tmp_path)
    given = (episode(), 1.0) if method == "demonstrate" else (episode(), lean, 1.0)
    assert complaint_of(getattr(room, method), *given) == (
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


def test_standing_where_it_was_put_down_scores_best_which_is_every_second():
    room = classroom(plant="planar", position_noise_m=0.0, seconds=1.5)
    assert room.examine(episode(start=5), lambda picture: np.zeros(2)) == pytest.approx(room.best_score) == 1.5
