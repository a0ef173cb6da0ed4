import sqlite3

import pytest

from proxytune.domain import Outcome, make_episode
from proxytune.errors import StoreError
from proxytune.storage import Store

EPISODES = [make_episode({"trim": 0.1 / 3.0, "delay": 0.2}, agent="a", start=start, seed=7) for start in (0, 1)]


def test_the_last_episode_that_began_is_known_to_the_next_process_of_the_same_family_alone(tmp_path):
    with Store.open(tmp_path) as store:
        for episode in EPISODES:
            store.under_way("one").begin(episode)
    with Store.open(tmp_path) as store:
        assert store.under_way("one").left() == EPISODES[1:]
        assert store.under_way("another").left() == []


def test_none_is_under_way_after_a_run_however_it_ends(tmp_path):
    with Store.open(tmp_path) as store:
        under_way = store.under_way("one")
        assert under_way.left() == []
        with pytest.raises(KeyboardInterrupt), under_way.ended():
            under_way.begin(EPISODES[0])
            raise KeyboardInterrupt
        assert under_way.left() == []


def test_agents_are_known_by_how_an_episode_of_theirs_failed(tmp_path):
    with Store.open(tmp_path) as store:
        for agent, failure in (("a", "it ended its process"), ("b", "raised it ended"), ("c", "it took long")):
            episode = make_episode({}, agent=agent, start=0, seed=7)
            store.save_outcome("one", Outcome(episode, None, failure, 1.0))
        assert store.under_way("one").agents_that_failed("it ended", "it took") == {"a", "c"}


def test_a_table_of_another_shape_is_refused(tmp_path):
    with Store.open(tmp_path):
        pass
    with sqlite3.connect(tmp_path / "study.db") as plain:
        plain.execute("CREATE TABLE under_way (agent TEXT)")
    with pytest.raises(StoreError, match="its table 'under_way' is not as proxytune makes it"), Store.open(tmp_path):
        pass
