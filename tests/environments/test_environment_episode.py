"""Episodes of an environment: how they are scored, how they end, and what fails them."""

import numpy as np
import pytest

pytest.importorskip("gymnasium")

from gymnasium.spaces import Discrete
from toy_families import CART, family

from proxytune.domain import make_episode
from proxytune.environments.actuators import Actuators
from proxytune.environments.agents import load_agent
from proxytune.environments.episode import Wrapped, play, score
from proxytune.environments.sensors import Sensors
from proxytune.environments.settings import EpisodeMetric
from proxytune.environments.spaces import Spaces
from proxytune.errors import EpisodeError


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
    wrapped = Wrapped(environment, Actuators((), known, 1), Sensors((), known, None, 1))
    space = Discrete(2)
    first = wrapped.reset(5, np.random.default_rng(1))
    play(wrapped, load_agent("zero", None, space, 0), first, space, steps)
    return wrapped


@pytest.mark.parametrize(("ends", "length", "total"), [(9, 4.0, 10.0), (2, 2.0, 3.0)])
def test_an_episode_ends_with_the_time_or_the_environment(ends, length, total):
    metrics = (EpisodeMetric("score", "return", "", "", ""), EpisodeMetric("steps", "length", "", "", ""))
    assert score(played(Scripted(ends)), metrics) == {"score": total, "steps": length}


@pytest.mark.parametrize(
    ("fold", "value"), [("last", -4.0), ("sum", -10.0), ("mean", -2.5), ("max", -1.0), ("min", -4.0)]
)
def test_entries_of_info_are_folded_as_asked_for(fold, value):
    assert score(played(Scripted()), (EpisodeMetric("s", "info", "speed", fold, ""),)) == {"s": value}


def test_the_last_entry_need_not_be_there_before():
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
    scores = kin.run(make_episode({}, agent="toys:ahead", start=0, seed=1))
    assert scores == {"drive": pytest.approx(2.0 * 12)}
