"""One episode to look at: what is kept of it, and what is no recording."""

import numpy as np
import pytest

from proxytune.domain import make_episode
from proxytune.errors import EpisodeError
from proxytune.study.family import load_family
from proxytune.study.settings import read_study_settings
from proxytune.study.single_episode import record_episode

LANE = {"plant": '"planar"', "seconds": "1.0", "position_noise_m": "0.0"}
WATCHER = """
import numpy as np

class Watcher:
    def begin(self, robot):
        return 0

    def act(self, picture, memory):
        return np.array([picture.mean() / 255.0, 0.3]), 0
"""


def family_of(folder):
    settings = read_study_settings(folder)
    return load_family(settings, settings.proxy)


@pytest.fixture(scope="module")
def lane(make_studies):
    """A study with an agent whose left duty is the brightness of the picture that it sees."""
    folder = make_studies("lane")
    (folder / "watcher.py").write_text(WATCHER)
    agents = '["steady", "watcher:Watcher"]'
    return make_studies("lane", domain=LANE, family='"proxytune.driving.family:lane_following"', agents=agents)


def test_pictures_are_those_that_the_agent_saw_before_each_command(lane):
    watched = make_episode({"blur": 0.05}, agent="watcher:Watcher", start=1, seed=3)
    kept = record_episode(family_of(lane), watched, filmed=True)
    assert kept.pictures.shape[0] == len(kept.commands["time"]) == 20
    assert np.allclose(kept.commands["left"], kept.pictures.mean(axis=(1, 2, 3)) / 255.0)
    assert len(set(kept.commands["left"])) > 5, "the picture changes while it drives"


def test_nobody_who_does_not_ask_waits_for_pictures(lane):
    kept = record_episode(family_of(lane), make_episode({}, agent="steady", start=0, seed=3))
    assert kept.pictures is None
    assert kept.channels == ("left", "right")
    assert kept.seconds == pytest.approx(1.0)


def test_a_family_that_records_nothing_gives_scores_alone(make_study):
    kept = record_episode(family_of(make_study()), make_episode({}, agent="agent0", start=0, seed=3), filmed=True)
    assert set(kept.metrics) == {"distance", "survival_time"}
    assert not kept.has_places
    assert kept.channels == ()
    assert kept.pictures is None


def test_a_family_without_a_camera_gives_places_and_commands(make_study):
    folder = make_study(family='"walking:walking"')
    kept = record_episode(family_of(folder), make_episode({"trim": 0.1}, agent="agent0", start=0, seed=3), filmed=True)
    assert kept.places[-1, 0] == pytest.approx(0.6)
    assert kept.channels == ("head",)
    assert kept.pictures is None


def test_columns_that_do_not_belong_together_are_told_in_one_line(make_study):
    folder = make_study(family='"walking:walking"', domain={"columns": '"x short"'})
    with pytest.raises(EpisodeError, match="poses need a column `time` and as many rows in every column") as problem:
        record_episode(family_of(folder), make_episode({}, agent="agent0", start=0, seed=3))
    assert "\n" not in str(problem.value)
