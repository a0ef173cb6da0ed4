"""A trained policy is an agent of a study like any other."""

import gymnasium
import numpy as np
import pandas as pd
import pytest

import proxytune
from proxytune.driving import load_agent
from proxytune.environments.family import agent_of
from proxytune.errors import ExtensionError
from proxytune.testing.extension import check_agent

pytest.importorskip("gymnasium")


class Brightness:
    """Turns by the brightness of what it sees; its state is how many pictures it has seen."""

    def predict(self, observation, state=None, deterministic=False):
        seen = 0 if state is None else state
        turn = observation.mean() / 1e3 + 0.01 * (seen % 3)
        return np.array((0.3 + turn, 0.3 - turn if deterministic else 9.0), dtype=np.float32), seen + 1


class Stateless:
    """As little as a policy must have."""

    def predict(self, observation, deterministic):
        return [0.3, 0.3], None


STUDY = """
format = 1
target = "target.csv"
metrics = ["distance:max", "survival_time:max"]
agents = ["steady", "daredevil", "my_policy:agent"]
starts = 2
budget = 4

[parameters]
trim = [-0.3, 0.3]

[domain]
plant = "planar"
seconds = 3.0
"""


@pytest.fixture
def study(tmp_path):
    (tmp_path / "study.toml").write_text(STUDY)
    return tmp_path


def scores(study, **theta):
    rows = [
        {"agent": agent, "episode": start, **proxytune.drive(study, agent, theta, start=start).scores}
        for agent in ("steady", "daredevil", "my_policy:agent")
        for start in range(2)
    ]
    return pd.DataFrame(rows)


@pytest.mark.parametrize("policy", [Brightness(), Stateless()])
def test_an_agent_of_a_policy_keeps_every_promise_of_an_agent(policy):
    check_agent(agent_of(policy))


def test_a_policys_state_goes_from_picture_to_picture_and_drawn_actions_keep_within_full_duty():
    agent, picture = agent_of(Brightness()), np.zeros((48, 64, 3), dtype=np.uint8)
    first, memory = agent.act(picture, agent.begin(None))
    second, memory = agent.act(picture, memory)
    assert memory == 2
    assert second[0] == pytest.approx(first[0] + 0.01)
    command, _ = agent_of(Brightness(), deterministic=False).act(np.zeros((48, 64, 3), dtype=np.uint8), None)
    assert command[1] == 1.0


def test_a_policy_beside_a_study_is_scored_as_an_agent_and_what_cannot_predict_is_refused(study):
    code = "from proxytune.environments import agent_of\nclass P:\n    def predict(self, o, deterministic):\n"
    (study / "my_policy.py").write_text(f"{code}        return (0.4, 0.4), None\nagent = agent_of(P())\n")
    found = proxytune.score(proxy=scores(study), target=scores(study, trim=0.2), metrics="distance:max")
    assert load_agent("my_policy:agent", study).policy.predict(None, True) == ((0.4, 0.4), None)
    assert "my_policy:agent" in str(found.prpv)
    with pytest.raises(ExtensionError, match=r"a dict has no predict\(observation, deterministic=…\)"):
        agent_of({})


@pytest.mark.slow
def test_stable_baselines3_trains_and_what_it_trained_is_scored(study):
    stable_baselines3 = pytest.importorskip("stable_baselines3")
    env = gymnasium.make("proxytune/LaneFollowing-v0", plant="planar", seconds=5.0, theta={"trim": [-0.1, 0.1]})
    model = stable_baselines3.PPO("CnnPolicy", env, n_steps=256, n_epochs=2, seed=0, device="cpu")
    before = model.policy.state_dict()["action_net.weight"].clone()
    model.learn(2000)
    assert (model.policy.state_dict()["action_net.weight"] != before).any()
    model.save(study / "policy.zip")
    (study / "my_policy.py").write_text(
        "from pathlib import Path\nfrom stable_baselines3 import PPO\n"
        "from proxytune.environments import agent_of\n"
        'agent = agent_of(PPO.load(Path(__file__).with_name("policy.zip"), device="cpu"))\n'
    )
    check_agent(load_agent("my_policy:agent", study))
    found = proxytune.score(proxy=scores(study), target=scores(study, trim=0.2), metrics="distance:max")
    assert found.prpv.value in (0, 2, 4, 6)
