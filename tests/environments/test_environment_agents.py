"""Agents of an environment: functions, what has predict, classes of either, and what is refused."""

import numpy as np
import pytest
from gymnasium.spaces import Box, Dict, Discrete, MultiBinary, MultiDiscrete
from one_line import complaint_of
from toy_families import CART, SCREEN, family

from proxytune.domain import make_episode
from proxytune.environments.family import ask_agent, load_agent
from proxytune.errors import EpisodeError

pytest.importorskip("gymnasium")


def run(kin, agent, seed=1):
    return kin.run(make_episode({}, agent=agent, start=0, seed=seed))


KINDS = ("random", "zero", "toys:ahead", "toys:homeward", "toys:Alternating", "toys:Recurrent")


@pytest.mark.parametrize("agent", KINDS)
def test_every_kind_of_agent_acts_and_acts_alike_again(tmp_path, agent):
    kin = family(tmp_path, CART)
    kin.check_agent(agent)
    assert run(kin, agent) == run(kin, agent)


def test_a_policy_s_state_is_handed_back_random_draws_follow_the_seed_and_some_spaces_lack_a_zero(tmp_path):
    family(tmp_path, CART)
    act = load_agent("toys:Recurrent", tmp_path, None, 0)
    assert [round(float(act(None)[0]), 1) for _ in range(3)] == [0.0, 0.1, 0.2]
    assert "have no zero; take another" in complaint_of(load_agent, "zero", tmp_path, Dict({"a": Discrete(2)}), 0)
    first, again, other = (load_agent("random", tmp_path, Discrete(1000), seed)(None) for seed in (5, 5, 6))
    assert first == again != other


@pytest.mark.parametrize(
    ("agent", "line"),
    [
        ("toys:nobody", "toys has no 'nobody'"),
        ("toys:nothing", "agent 'toys:nothing' is a NoneType; give a function, or what has predict"),
        ("randm", "agent 'randm' is unknown (your own is written module:attribute); did you mean 'random'?"),
        ("toys:Cart", "give a function, or what has predict"),
    ],
)
def test_an_agent_that_cannot_act_is_refused(tmp_path, agent, line):
    assert line in complaint_of(family(tmp_path, CART).check_agent, agent)


@pytest.mark.parametrize(
    ("agent", "line"),
    [
        ("toys:fails", "raised RuntimeError: lost the way at step 0"),
        ("toys:three", "at step 0; an action is (2,) finite numbers"),
        ("toys:infinite", "at step 0; an action is (2,) finite numbers"),
        ("toys:words", "answered 'left' at step 0, which is no array of numbers"),
    ],
)
def test_an_answer_that_is_no_action_fails_the_episode(tmp_path, agent, line):
    with pytest.raises(EpisodeError) as failed:
        run(family(tmp_path, CART), agent)
    assert line in str(failed.value)


def test_discrete_actions_run_and_an_answer_must_be_one_or_is_cut_off_in_a_box(tmp_path):
    space = Discrete(3, start=1)
    assert ask_agent(lambda seen: np.array(2), None, space, 0) == 2
    with pytest.raises(EpisodeError, match=r"answered 0 at step 4, which is not in Discrete"):
        ask_agent(lambda seen: 0, None, space, 4)
    assert ask_agent(lambda seen: [[5.0, -0.5]], None, Box(-1.0, 1.0, (2,), np.float32), 0).tolist() == [1.0, -0.5]
    assert run(family(tmp_path, SCREEN), "toys:left_of_middle")["return"] >= 4.0


@pytest.mark.parametrize(
    ("space", "zero"),
    [
        (Discrete(3, start=1), 1),
        (Box(-1.0, 1.0, (2,), np.float32), [0.0, 0.0]),
        (Box(0.5, 1.0, (1,), np.float32), [0.5]),
        (MultiBinary(2), [0, 0]),
        (MultiDiscrete([2, 3]), [0, 0]),
    ],
)
def test_zero_is_the_least_action_that_a_space_has(tmp_path, space, zero):
    action = load_agent("zero", tmp_path, space, 0)(None)
    assert np.asarray(action).tolist() == zero
    assert space.contains(action)


@pytest.mark.slow
def test_a_policy_of_stable_baselines3_acts(tmp_path):
    pytest.importorskip("stable_baselines3")
    (tmp_path / "trained.py").write_text(
        "import gymnasium\nfrom stable_baselines3 import PPO\n"
        'policy = PPO("MlpPolicy", gymnasium.make("CartPole-v1"), seed=1, n_steps=8, device="cpu")\n'
    )
    kin = family(tmp_path, 'environment = "CartPole-v1"\nsteps = 20\n')
    assert run(kin, "trained:policy") == run(kin, "trained:policy")
    assert 1.0 <= run(kin, "trained:policy")["length"] <= 20.0
