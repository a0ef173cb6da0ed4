"""A study from Python: a function or an environment, a box and a table of scores."""

import numpy as np
import pandas as pd
import pytest
from one_line import complaint_of

import proxytune

REACH = {"a": 1.0, "b": 0.7, "c": 0.4, "d": 0.1}
BOX = {"gain": (0.5, 2.0), "drag": (0.0, 1.0)}
TRUE = {"gain": 1.2, "drag": 0.3}


def simulate(theta, agent, start, seed):
    noise = np.random.default_rng((seed, start)).normal(0.0, 0.02, 2)
    reach = REACH[agent]
    return {
        "distance": reach * theta["gain"] - 3.0 * theta["drag"] * reach**2 + noise[0],
        "time": 5.0 + theta["drag"] * reach + noise[1],
    }


def rows(theta, seed, **more):
    return pd.DataFrame(
        {**more, "agent": agent, "episode": start, **simulate(theta, agent, start, seed + start)}
        for agent in REACH
        for start in range(2)
    )


def tuned(simulator=simulate, **options):
    keys = {"metrics": ["distance:max", "time:min"], "budget": 4, "initial": 4, "preflight": False, "confirm": 0}
    return proxytune.tune(simulator, BOX, **{"scores": rows(TRUE, 9)} | keys | options)


@pytest.mark.slow
def test_what_was_kept_in_a_folder_is_not_simulated_again_and_more_trials_follow(tmp_path):
    """A second call with a larger budget adds its trials to those of the first, which stay what they were."""
    calls = []

    def counted(theta, agent, start, seed):
        calls.append(agent)
        return simulate(theta, agent, start, seed)

    first = tuned(counted, folder=tmp_path)
    driven = len(calls)
    again = tuned(counted, folder=tmp_path, budget=5)
    assert driven
    assert len(calls) - driven <= 8
    assert again.trials()[:4].equals(first.trials())
    assert proxytune.read_study(tmp_path).theta == again.theta


@pytest.mark.slow
def test_known_points_come_first_and_known_scores_are_not_simulated():
    """θ that are given are the first trials; one whose episodes are all known calls no simulator."""
    near = {"gain": 1.1, "drag": 0.2}
    assert tuned(known=[near]).trials().loc[1, ["gain", "drag"]].to_dict() == near
    driven = []

    def counted(theta, agent, start, seed):
        driven.append(theta)
        return simulate(theta, agent, start, seed)

    assert tuned(counted, known=rows(near, 3, **near)).trials().loc[1, ["gain", "drag"]].to_dict() == near
    assert near not in driven
    assert driven


def test_every_episode_of_the_target_counts_where_a_function_takes_no_start(tmp_path):
    """They repeat its one start: none is left out, in a DataFrame or a file, under columns of the user's own names."""
    scores = pd.DataFrame(
        {"policy": name, "try": place, "reach": reach + 0.1 * place}
        for name, reach in REACH.items()
        for place in range(4)
    )
    scores.to_csv(tmp_path / "mine.csv", index=False)
    for given in (scores, tmp_path / "mine.csv"):
        report = proxytune.tune(
            lambda theta, agent: theta["gain"] * REACH[agent],
            {"gain": (0.5, 2.0)},
            given,
            metrics="reach:max",
            columns={"agent": "policy", "episode": "try"},
            budget=2,
            preflight=False,
            confirm=0,
        )
        assert report.document()["target"]["episodes_per_agent"] == [4, 4]
        assert report.document()["settings"]["starts"] == 1
        assert not any("left out" in line for line in report.document()["cautions"])


def test_a_function_of_theta_and_agent_with_one_score_is_enough():
    """Without starts and seeds there is one start, and a bare number is the one metric."""
    scores = pd.DataFrame({"policy": ["a", "bb", "ccc"], "success": [0.2, 0.5, 0.9]})
    report = proxytune.tune(
        lambda theta, agent: theta["gain"] * len(agent),
        {"gain": (-1.0, 1.0)},
        scores,
        metrics="success:max",
        columns={"agent": "policy"},
        budget=np.int64(3),
        preflight=False,
        confirm=0,
    )
    assert report.result.study.settings.starts == 1
    assert report.theta["gain"] > 0.0


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"metrics": "distanc:max"}, "scores: no column 'distanc'; did you mean 'distance'?"),
        ({"scores": rows(TRUE, 1, **TRUE).replace("a", "")}, "scores: row 0, column 'agent': is empty; fill it in"),
        ({"seed": None}, "tune: Unable to convert"),
        ({"enginee": "gp"}, "enginee: unknown key; did you mean 'engine'?"),
        ({"known": [{"gain": 9.0, "drag": 0.0}]}, "known: row 0: gain is 9, outside [0.5, 2]"),
        ({"known": [{"gain": "much", "drag": 0.0}]}, "known: row 0: gain must be a number, got 'much'"),
        ({"known": [{"gian": 1.0, "gain": 1.0, "drag": 0.0}]}, "row 0: 'gian' is no parameter of the box; did you"),
        ({"known": [{"gain": 1.0}]}, "known: row 0: has no 'drag'; give each parameter of the box"),
        ({"known": rows(TRUE, 1, **TRUE).replace("a", "z")}, "known: row 0: is no episode of this study"),
        ({"simulator": "Pendulum-v1"}, "an environment needs agents={name: policy}"),
        ({"agents": ["a", "bb"]}, "agents: are policies of a Gymnasium environment; of a function leave it out"),
        ({"agents": {"a": "zero"}}, "agents: are policies of a Gymnasium environment; of a function leave it out"),
        ({"agents": ["zero"], "simulator": "Pendulum-v1"}, "by name; of a function leave it out, got a list"),
        (
            {"simulator": lambda theta: 1.0},
            "simulator: the function must take (theta, agent), or (theta, agent, start, seed), and takes (theta)",
        ),
    ],
)
def test_what_cannot_be_used_is_one_line(options, said):
    """Complaints name the argument, not a file that the user never saw."""
    told = complaint_of(tuned, **options)
    assert said in told
    assert "study.toml" not in told


def test_another_function_is_refused_and_leaves_folder_and_study_as_they_were(tmp_path):
    """Trials of other code are not mixed up, and what was found before can still be read."""
    before = tuned(folder=tmp_path)
    told = complaint_of(tuned, lambda theta, agent, start, seed: {"distance": 1.0, "time": 2.0}, folder=tmp_path)
    assert "changed since the first trial: the domain family" in told
    assert proxytune.read_study(tmp_path).theta == before.theta
    assert "call proxytune.tune again with this folder" in complaint_of(proxytune.run_study, tmp_path)
    (tmp_path / "study.toml").write_text("mine")
    assert "tune did not write" in complaint_of(tuned, folder=tmp_path)
    assert (tmp_path / "study.toml").read_text() == "mine"


def soft(observation):
    return [-4.0 * observation[1] - observation[2]]


@pytest.mark.parametrize("parameter", ["g", "unwrapped.m", "delay"])
def test_an_environment_is_tuned_by_argument_attribute_or_effect(parameter):
    """Policies are given, and the box names what of the environment is θ."""
    pytest.importorskip("gymnasium")
    from gymnasium.envs.classic_control import PendulumEnv

    scores = pd.DataFrame({"agent": ["soft", "zero"], "return": [-90.0, -200.0]})
    report = proxytune.tune(
        PendulumEnv if parameter == "g" else "Pendulum-v1",
        {parameter: (0.05, 0.2) if parameter == "delay" else (0.5, 2.0)},
        scores,
        metrics="return:max",
        agents={"soft": soft, "zero": "zero"},
        budget=2,
        domain={"steps": 20},
        preflight=False,
        confirm=0,
    )
    assert report.trials()["prpv"].notna().all()
    assert set(report.theta) == {parameter}


@pytest.mark.parametrize(
    ("box", "said"),
    [
        ({"trim": (-0.2, 0.2)}, "effect 'trim' cannot wrap this environment: it is made for two actions"),
        ({"camera_pitch": (10.0, 30.0)}, "effect 'camera_pitch' cannot wrap this environment"),
        ({"marker_offset.forward": (0.0, 0.1)}, "effect 'marker_offset' cannot wrap this environment"),
        ({"delay": (-0.3, 0.3)}, "parameters.delay: must lie within [0, "),
    ],
)
def test_an_effect_that_cannot_wrap_an_environment_is_refused_with_the_reason(box, said):
    pytest.importorskip("gymnasium")
    scores = pd.DataFrame({"agent": ["soft", "zero"], "return": [-90.0, -200.0]})
    given = {"metrics": "return:max", "agents": {"soft": soft, "zero": "zero"}, "budget": 2}
    assert said in complaint_of(proxytune.tune, "Pendulum-v1", box, scores, **given)
