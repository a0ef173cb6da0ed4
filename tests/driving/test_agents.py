"""Agents see pictures and nothing else, and never answer with anything but two finite duties."""

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from proxytune.driving import (
    AGENTS,
    Agent,
    GroundPlaneCamera,
    agents as pilots,
    draw_floor,
    load_agent,
    read_robot,
    shipped_map,
)
from proxytune.driving.agents import Laggy, LanePilot, Leaning, Smoothed, Wary, act_together, duties
from proxytune.driving.optics import parted
from proxytune.driving.perception import Markings, Seen, find_lanes, open_eye
from proxytune.errors import ExtensionError
from proxytune.testing.extension import check_agent

SMALL_LOOP = shipped_map("small_loop")
ROBOT = read_robot("duckiebot")
CAMERA = GroundPlaneCamera(ROBOT.camera_figures(), draw_floor(SMALL_LOOP))
EAST_LANE_X = 2.5 * SMALL_LOOP.width + SMALL_LOOP.lane_offset


def seen_from(left=0.0, turned=0.0):
    """The picture from the outer lane of the eastern straight, shifted to the left [m] and turned left [rad]."""
    return CAMERA.render(np.array([(EAST_LANE_X - left, 0.62, np.pi / 2 + turned)]))[0]


@pytest.mark.parametrize("name", AGENTS)
def test_every_agent_keeps_what_agents_promise(name):
    check_agent(AGENTS[name], robot=ROBOT)


@pytest.mark.parametrize(("left", "turned"), [(0, 0), (0.05, 0), (-0.05, 0), (0, 0.2), (0, -0.2), (0.04, 0.1)])
def test_the_lane_is_found_where_it_lies(left, turned):
    look = Markings(open_eye(ROBOT, reach_m=0.5), 60.0, 150.0)
    (lane,) = find_lanes(Seen(parted(seen_from(left, turned)[None])), (look,), (0,))
    assert lane is not None
    assert lane.slope == pytest.approx(-np.tan(turned), abs=0.12)
    assert lane.offset == pytest.approx(-left / np.cos(turned), abs=0.025)


MORE = {
    **AGENTS,
    "eager": LanePilot(speed=0.2, offset_gain=8.0, slope_gain=2.0, contrast=0.0, brightness=0.0, reach_m=0.9),
    "blind": LanePilot(speed=0.2, offset_gain=8.0, slope_gain=2.0, contrast=300.0, brightness=255.0),
    "nested": Laggy(Wary(Smoothed(LanePilot(0.3, 8.0, 2.0, contrast=60.5), 0.3), contrast=99.0, crisp=9.0), steps=2),
    "leaning_edges": Leaning(pilots.EdgePilot(speed=0.3, gain=4.0, step=20.5, first_row=0.1), bias=0.4),
    "pushed": pilots.Braitenberg(speed=0.3, push=4.0, first_row=0.0),
}


def scenes(seed):
    """So many robots' pictures of three times: of the road, with noise, and of noise alone."""
    random = np.random.default_rng(seed)
    x, y = random.uniform(0.1, 1.7, (2, 3 * len(MORE)))
    pictures = CAMERA.render(np.stack((x, y, random.uniform(-np.pi, np.pi, x.size)), axis=1)).astype(int)
    pictures[::3] += random.integers(-80, 80, pictures[::3].shape)
    pictures[::5] = random.integers(0, 256, pictures[::5].shape)
    return pictures.clip(0, 255).astype(np.uint8).reshape(3, len(MORE), *pictures.shape[1:])


@given(st.permutations(list(MORE)), st.integers(1, len(MORE)), st.integers(0, 2**32 - 1))
@settings(max_examples=20)
def test_who_is_asked_beside_an_agent_does_not_matter_to_a_bit(names, count, seed):
    agents = [MORE[name] for name in names[:count]]
    alone = together = [agent.begin(ROBOT) for agent in agents]
    for pictures in scenes(seed)[:, :count]:
        answers = [agent.act(one, memory) for agent, one, memory in zip(agents, pictures, alone, strict=True)]
        alone = [memory for _, memory in answers]
        commands, together = act_together(agents, pictures, together)
        assert commands.tobytes() == np.array([command for command, _ in answers]).tobytes()


@pytest.mark.parametrize("name", MORE)
def test_many_pictures_are_answered_as_each_would_be(name):
    agent = MORE[name]
    alone = many = [agent.begin(ROBOT)] * len(MORE)
    for pictures in scenes(4):
        answers = [agent.act(one, memory) for one, memory in zip(pictures, alone, strict=True)]
        alone = [memory for _, memory in answers]
        commands, many = agent.act_many(pictures, many)
        assert commands.tobytes() == np.array([command for command, _ in answers]).tobytes()


def lane_by_the_book(picture, look):
    """Least squares over the pixels of one picture, one after another."""
    eye, (red, green, blue) = look.eye, picture.reshape(-1, 3)[look.eye.first :].astype(int).T
    yellow = ((np.minimum(red, green) - blue > look.contrast) & eye.near).nonzero()[0]
    divide = eye.left[yellow].sum() / yellow.size if yellow.size else 0.128
    white = (np.minimum(np.minimum(red, green), blue) > look.brightness) & eye.near & (eye.left < divide)
    white = white.nonzero()[0]
    ahead = eye.ahead[np.concatenate((yellow, white))]
    left = np.concatenate((eye.left[yellow] - 0.128, eye.left[white] + 0.128))
    if ahead.size < 6:
        return None
    centred = ahead - ahead.sum() / ahead.size
    slope = (centred * left).sum() / ((centred * centred).sum() + 0.005 * ahead.size)
    return left.sum() / ahead.size - slope * (ahead.sum() / ahead.size), slope, ahead.size


@given(st.integers(0, 2**32 - 1), st.floats(0.0, 260.0), st.floats(0.0, 260.0), st.sampled_from([0.3, 0.5, 0.9]))
@settings(max_examples=40)
def test_lanes_of_many_pictures_are_those_of_one_picture_after_another(seed, contrast, brightness, reach):
    pictures = scenes(seed)[0]
    own = Markings(open_eye(ROBOT, reach_m=reach), contrast, brightness)
    looks = [Markings(open_eye(ROBOT, reach_m=0.5), 60.0, 150.0), own]
    asked = tuple(looks[robot % 2] for robot in range(len(pictures)))
    expected = [lane_by_the_book(*pair) for pair in zip(pictures, asked, strict=True)]
    assert find_lanes(Seen(parted(pictures)), asked, range(len(pictures))) == expected


def test_pictures_are_looked_at_once_and_without_markings_there_is_no_lane_and_wary_slows_down():
    agents, pictures = [AGENTS["wary"], AGENTS["braitenberg"], AGENTS["wary"]], scenes(1)[0][:3]
    seen, memories = Seen(parted(pictures)), [agent.begin(ROBOT) for agent in agents]
    once, _ = act_together(agents, seen, memories)
    pictures[:] = 0
    np.testing.assert_array_equal(act_together(agents, seen, memories)[0], once)
    look = Markings(open_eye(ROBOT), 60.0, 150.0)
    assert find_lanes(Seen(parted(np.zeros_like(seen_from())[None])), (look,), (0,)) == [None]
    np.testing.assert_allclose(commands(Wary(Fixed(0.5, 0.5), contrast=254.0, crisp=5.0, slowest=0.3), 3)[:, 0], 0.15)
    assert commands(Wary(Fixed(0.5, 0.5), contrast=30.0, crisp=5.0, slowest=0.3), 60)[-1, 0] > 0.49


@pytest.mark.parametrize("name", ["steady", "brisk", "pursuer_near", "white_only", "smooth"])
def test_off_centre_agents_turn_back_to_the_lane(name):
    agent = AGENTS[name]
    turns = []
    for left in (0.06, -0.06):
        command, _ = agent.act(seen_from(left), agent.begin(ROBOT))
        turns.append(command[1] - command[0])
    assert turns[0] < 0 < turns[1]


def test_duties_ask_for_the_twist_pilots_of_one_marking_look_at_no_other_and_laggy_waits_its_steps():
    np.testing.assert_allclose(duties(0.3, 0.0, full_speed=0.6, baseline=0.16), [0.5, 0.5])
    np.testing.assert_allclose(duties(0.6, 3.75, full_speed=0.6, baseline=0.16), [0.0, 1.0])
    yellow = LanePilot(speed=0.2, offset_gain=8.0, slope_gain=2.0, markings="yellow")
    blind = LanePilot(speed=0.2, offset_gain=8.0, slope_gain=2.0, markings="yellow", contrast=254.0)
    straight = duties(0.2, 0.0, full_speed=0.6, baseline=0.16)
    scene = seen_from(0.06)
    np.testing.assert_allclose(blind.act(scene, blind.begin(ROBOT))[0], straight)
    assert np.abs(yellow.act(scene, yellow.begin(ROBOT))[0] - straight).max() > 0.05
    np.testing.assert_allclose(commands(Laggy(Fixed(0.4, 0.5), steps=2), 4)[:, 0], [0.0, 0.0, 0.4, 0.4])
    np.testing.assert_allclose(commands(Smoothed(Fixed(0.4, 0.4), share=0.5), 3)[:, 0], [0.2, 0.3, 0.35])
    np.testing.assert_allclose(commands(Leaning(Fixed(0.4, 0.4), bias=0.1), 1), [[0.36, 0.44]])


class Fixed:
    """Always the same command."""

    def __init__(self, *command):
        self.command = np.array(command)

    def begin(self, robot):
        return None

    def act(self, picture, memory):
        return self.command, memory


def commands(agent: Agent, steps: int) -> np.ndarray:
    memory, out = agent.begin(ROBOT), []
    for _ in range(steps):
        command, memory = agent.act(seen_from(), memory)
        out.append(command)
    return np.array(out)


def test_agents_are_loaded_by_their_names_or_from_a_folder(tmp_path):
    with pytest.raises(ExtensionError, match="agent 'stead' is unknown .*; did you mean 'steady'"):
        load_agent("stead", tmp_path)

    (tmp_path / "mine_agents.py").write_text(
        "class Mine:\n    def begin(self, robot): return 0\n"
        "    def act(self, picture, memory): return (0.1, 0.1), memory\n"
        "ready = Mine()\nbroken = 3\n",
        encoding="utf-8",
    )
    assert load_agent("mine_agents:Mine", tmp_path).act(None, 0) == ((0.1, 0.1), 0)
    assert load_agent("mine_agents:ready", tmp_path).begin(ROBOT) == 0
    for name in ("mine_agents:gone", "no_such_module:x", "mine_agents:broken"):
        with pytest.raises(ExtensionError, match=f"agent '{name}'"):
            load_agent(name, tmp_path)
