"""A Gymnasium environment is a domain family like any other: how episodes are scored, end and fail."""

import dataclasses
import importlib.metadata
import pickle
import shutil

import numpy as np
import pytest
from gymnasium.spaces import Discrete
from one_line import complaint_of
from toy_families import CART, PENDULUM, SCREEN, TOYS, family

from proxytune.cli.main import main
from proxytune.domain import make_episode
from proxytune.effects import CATALOGUE, PARAMETERS, effect_of
from proxytune.environments.family import WrappedEnvironment, load_agent, play, score
from proxytune.environments.making import EpisodeMetric
from proxytune.environments.signals import Actuators, Sensors, Spaces
from proxytune.errors import EpisodeError, InputError
from proxytune.extensions import load
from proxytune.storage import Store
from proxytune.testing.extension import check_family

pytest.importorskip("gymnasium")


class Scripted:
    """Gives rewards 1, 2, 3 …, and ends or fails at a step."""

    unwrapped = type("Inside", (), {})()

    def __init__(self, ends=9, fails=99):
        self.count, self.ends, self.fails = 0, ends, fails

    def reset(self, *, seed):
        if self.fails == 0:
            raise RuntimeError("no\nfloor")
        return seed, {}

    def step(self, action):
        self.count += 1
        if self.count == self.fails:
            raise RuntimeError("fell\nover")
        info = {"speed": -float(self.count), "name": "x"} | ({"late": 1} if self.count > 1 else {})
        return self.count, float(self.count), self.count == self.ends, False, info


def played(environment, steps=4):
    known = Spaces((), (), "", None, "", "", None, steps, ())
    wrapped = WrappedEnvironment(environment, Actuators((), known, 1), Sensors((), known, None, 1))
    space = Discrete(2)
    play(wrapped, load_agent("zero", None, space, 0), wrapped.reset(5, np.random.default_rng(1)), space, steps)
    return wrapped


@pytest.mark.parametrize(("ends", "length", "total"), [(9, 4.0, 10.0), (2, 2.0, 3.0)])
def test_an_episode_ends_with_the_time_or_the_environment(ends, length, total):
    metrics = (EpisodeMetric("score", "return", "", "", ""), EpisodeMetric("steps", "length", "", "", ""))
    assert score(played(Scripted(ends)), metrics) == {"score": total, "steps": length}


@pytest.mark.parametrize(("fold", "value"), [("last", -4), ("sum", -10), ("mean", -2.5), ("max", -1), ("min", -4)])
def test_entries_of_info_are_folded_as_asked_for_and_the_last_need_not_be_there_before(fold, value):
    assert score(played(Scripted()), (EpisodeMetric("s", "info", "speed", fold, ""),)) == {"s": value}
    assert score(played(Scripted()), (EpisodeMetric("l", "info", "late", "last", ""),)) == {"l": 1.0}


@pytest.mark.parametrize(
    ("entry", "line"),
    [
        ("sped", "metric 's': info has no 'sped' at every step; did you mean 'speed'?"),
        ("late", "metric 's': info has no 'late' at every step"),
        ("name", "metric 's': 'name' of info is no number; name another"),
    ],
)
def test_an_entry_that_is_missing_or_no_number_fails_the_episode(entry, line):
    with pytest.raises(EpisodeError) as failed:
        score(played(Scripted()), (EpisodeMetric("s", "info", entry, "mean", ""),))
    assert line in str(failed.value)


@pytest.mark.parametrize(("fails", "line"), [(0, "reset raised RuntimeError: no floor"), (2, "fell over at step 1")])
def test_an_environment_that_raises_fails_the_episode_in_one_line(fails, line):
    with pytest.raises(EpisodeError) as failed:
        played(Scripted(fails=fails))
    assert line in str(failed.value)


def test_entries_of_info_are_metrics_of_a_study(tmp_path):
    kin = family(tmp_path, CART + '[metrics]\ndrive = { info = "drive", as = "sum", unit = "m" }\n')
    assert dict(kin.metrics) == {"drive": "m"}
    assert kin.run(make_episode({}, agent="toys:ahead", start=0, seed=1)) == {"drive": pytest.approx(2.0 * 12)}


STUDY = """
format = 1
family = "proxytune.environments.family:gymnasium_family"
target = "target.csv"
truth = "truth.toml"
metrics = ["return:max", "length:max"]
agents = ["toys:ahead", "toys:homeward", "toys:Alternating"]
starts = 2
budget = {budget}
initial = 3
engine = "sobol"
preflight = false
confirm = 0
jobs = {jobs}

[parameters]
speed = [0.5, 2.0]
delay = [0.0, 0.4]

[domain]
environment = "{environment}"
rate_hz = 10.0

[domain.parameters]
speed = {{ argument = "speed", low = 0.1, high = 5.0, neutral = 1.0 }}
"""
TRUTH = "format = 1\n[parameters]\nspeed = 1.5\n[effects.delay]\ndelay = 0.2\n"


def run(kin, agent="toys:homeward", start=0, seed=1, **theta):
    return kin.run(make_episode(theta, agent=agent, start=start, seed=seed))


def resting(names):
    """Parameters that alone change nothing, or that these agents never meet."""
    shapes = {name for name in names if name in PARAMETERS and PARAMETERS[name].shape}
    return shapes | {name for name in names if name in PARAMETERS and "imbalance" in name}


@pytest.mark.slow
def test_a_classic_keeps_every_promise_of_a_family(tmp_path):
    kin = family(tmp_path, PENDULUM)
    check_family(kin, agents=["random", "toys:Wobble"], without_effect=resting(kin.parameters))


@pytest.mark.slow
def test_two_actions_a_pose_and_the_effects_on_both_keep_every_promise(tmp_path):
    kin = family(tmp_path, CART + "[state]\nx = 1\ny = 2\nheading = 0\n")
    assert {"trim", "dead_band.imbalance", "battery_sag.load", "heading_offset"} <= set(kin.parameters)
    rests = resting(kin.parameters) | {"stiction.reversal", "thermal_fade.time_constant"}
    check_family(kin, agents=["toys:homeward", "toys:Wobble"], without_effect=rests)


@pytest.mark.slow
def test_pictures_and_the_effects_on_them_keep_every_promise(tmp_path):
    kin = family(tmp_path, SCREEN)
    on_images = {name for name in PARAMETERS if CATALOGUE[effect_of(name)].stage == "image"}
    assert set(kin.parameters) == on_images
    check_family(kin, agents=["toys:Brightness"])


def test_starts_are_the_same_states_and_chance_comes_from_the_seed(tmp_path):
    kin = family(tmp_path, CART.replace("12", "1"))
    first = run(kin, "zero", start=3)
    assert run(kin, "zero", start=3, seed=2) == first
    assert run(kin, "zero", start=3, **{"delay": 0.1}) == first
    assert run(kin, "zero", start=4) != first
    kin = family(tmp_path, CART + "[arguments]\nnoise = 1.0\n")
    assert run(kin, seed=1) == run(kin, seed=1)
    assert run(kin, seed=1) != run(kin, seed=2)
    assert run(kin, "random", seed=1) == run(kin, "random", seed=1)


def test_a_model_gives_effects_and_values_before_those_of_the_table_which_are_checked_too(tmp_path):
    named = family(tmp_path, PENDULUM, "[parameters]\nmass = 1.7\n[effects.delay]\ndelay = 0.1\n")
    plain, agent = family(tmp_path, PENDULUM), "toys:Wobble"
    assert run(named, agent) == run(plain, agent, mass=1.7, delay=0.1)
    assert run(named, agent, mass=1.0, delay=0.0) == run(plain, agent)
    assert run(named, agent) != run(plain, agent)
    table = PENDULUM + "[effects.delay]\ndelay = 0.2\n"
    given = family(tmp_path, table, 'format = 1\nrobot = "any"\n[effects.delay]\ndelay = 0.1\n')
    assert dict(given.held) == {"delay": 0.1}
    assert dict(family(tmp_path, table).held) == {"delay": 0.2}
    kin = family(tmp_path, PENDULUM, "[effects.dead_band]\nwidth = 0.1\nimbalance = 0.0\n")
    assert run(kin, "toys:Wobble") == run(family(tmp_path, PENDULUM), "toys:Wobble", **{"dead_band.width": 0.1})
    with pytest.raises(InputError, match=r"study.toml: domain.effects.blur: effect 'blur' cannot wrap"):
        family(tmp_path, PENDULUM + "[effects.blur]\nblur = 0.1\n")


@pytest.mark.parametrize(
    ("model", "line"),
    [
        ("[parameters]\nmas = 1.0\n", "parameters.mas: is no parameter of the environment; did you mean 'mass'?"),
        ("[parameters]\nmass = 9.0\n", "parameters.mass: must be between 0.5 and 2, got 9.0"),
        ("[effects.trim]\ntrim = 0.1\n", "trim: effect 'trim' cannot wrap this environment: it is made for two"),
        (
            "[effects.learnt.range]\nforward = [0, 1]\nyaw = [0, 1]\n"
            "[effects.learnt.level]\nknots = [1]\nleft = [0.1]\n",
            "bends the motion of a robot's body",
        ),
        ("agents = 1\n", "agents: unknown key"),
    ],
)
def test_a_model_that_the_environment_cannot_follow_is_refused(tmp_path, model, line):
    told = complaint_of(family, tmp_path, PENDULUM, model)
    assert line in told
    assert "model.toml" in told


def test_environments_are_closed_whatever_fails(tmp_path):
    kin = family(tmp_path, CART)
    cart = load("toys:Cart", kind="environment", beside=tmp_path)
    run(kin)
    with pytest.raises(EpisodeError):
        run(kin, "toys:fails")
    kin.check_agent("zero")
    assert cart.open == 0
    mass = 'mass = { argument = "mass", low = 0, high = 2, neutral = 1 }\n'
    kin = family(tmp_path, f'environment = "toys:heavy"\nsteps = 3\n[parameters]\n{mass}')
    with pytest.raises(EpisodeError, match="too heavy"):
        run(kin, "zero", mass=2.0)


def test_identity_follows_settings_files_and_versions_and_not_the_place(tmp_path, monkeypatch):
    for name in ("a", "b"):
        (tmp_path / name).mkdir()
    here, there = family(tmp_path / "a", CART), family(tmp_path / "b", CART)
    assert here.identity == there.identity == pickle.loads(pickle.dumps(here)).identity
    before = here.identity
    assert family(tmp_path / "a", CART + "[arguments]\nnoise = 1.0\n").identity != before
    assert family(tmp_path / "a", CART, "[effects.delay]\ndelay = 0.1\n").identity != before
    assert here.identity == before, "no code reads model.toml"
    (tmp_path / "a" / "body.xml").write_text("<mujoco/>")
    assert here.identity != before
    later = dataclasses.replace(there.spaces, packages=(("gymnasium", "99"), ("numpy", "99")))
    assert dataclasses.replace(there, spaces=later).identity != before
    assert there.versions == {name: importlib.metadata.version(name) for name in ("gymnasium", "numpy")}


def test_the_version_of_the_engine_counts(tmp_path):
    pytest.importorskip("mujoco")
    kin = family(tmp_path, 'environment = "toys:Engine"\nsteps = 3\n')
    assert kin.versions["mujoco"] == importlib.metadata.version("mujoco")


def write_study(folder, budget=4, jobs=1, environment="toys:Cart-v0"):
    environment = "toys:toys/Cart-v0" if environment == "toys:Cart-v0" else environment
    folder.mkdir(exist_ok=True)
    shutil.copy(TOYS, folder / "toys.py")
    text = STUDY.format(budget=budget, jobs=jobs, environment=environment)
    (folder / "study.toml").write_text(text, encoding="utf-8")
    (folder / "truth.toml").write_text(TRUTH, encoding="utf-8")
    if not (folder / "target.csv").exists():
        made = ["measure", str(folder), "--model", str(folder / "truth.toml"), "--output", str(folder / "target.csv")]
        assert main(made) == 0


def trials(folder):
    with Store.open(folder) as store:
        return [(dict(trial.theta), trial.score, dict(trial.measures)) for trial in store.trials("prpv")]


@pytest.mark.slow
def test_a_study_that_was_stopped_goes_on_exactly_and_in_processes_that_register_the_environment(tmp_path, capsys):
    whole, cut = tmp_path / "whole", tmp_path / "cut"
    write_study(whole)
    assert main(["study", str(whole), "--json"]) == 0
    assert '"speed": 1.5' in capsys.readouterr().out
    write_study(cut, budget=3)
    assert main(["study", str(cut)]) == 0
    write_study(cut, budget=4, jobs=2)
    assert main(["study", str(cut)]) == 0
    assert len(trials(whole)) == 4
    assert trials(cut) == trials(whole)
    assert np.isfinite([score for _, score, _ in trials(whole)]).all()


def test_a_study_names_the_reason_why_an_effect_cannot_be_tuned(tmp_path, capsys):
    write_study(tmp_path)
    path = tmp_path / "study.toml"
    path.write_text(path.read_text().replace("delay = [0.0, 0.4]", "camera_pitch = [3.0, 9.0]"))
    assert main(["study", str(tmp_path)]) == 2
    told = " ".join(capsys.readouterr().err.split())
    assert "parameters.camera_pitch: effect 'camera_pitch' cannot wrap this environment: it mounts the camera" in told
