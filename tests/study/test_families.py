"""Which of several families is best at what, and which cannot be told from it."""

import pytest
from several_tuned import compared, family, lesson

from proxytune.study import BestFamilies, Lesson


def test_the_lowest_fresh_prpv_predicts_best_beyond_noise_and_what_has_no_fresh_episodes_is_left_out():
    found = compared(family("bad", 3), family("good", 0), family("middle", 1))
    assert found.predicts == BestFamilies("good", ())
    assert {(one.better, one.worse, one.value) for one in found.differences} == {
        ("good", "middle", 2),
        ("good", "bad", 6),
        ("middle", "bad", 4),
    }
    found = compared(family("good", 0, noise=8.0), family("noisy", 0, noise=9.0), family("bad", 4))
    assert found.predicts.best in ("good", "noisy")
    assert found.predicts.alike == tuple({"good", "noisy"} - {found.predicts.best})
    assert compared(family("none", fresh=False), family("one", 2)).predicts == BestFamilies("one", ())
    assert compared(family("none", fresh=False), family("nor", fresh=False)).predicts == BestFamilies()


def test_the_cheapest_is_told_apart_episode_by_episode_and_the_highest_plv_teaches_best():
    hard, easy = (10.0, 1.0, 5.0, 0.1), (20.0, 2.0, 10.0, 0.2)
    found = compared(family("double", seconds=easy), family("single", seconds=hard), family("as long", seconds=hard))
    assert found.cheapest == BestFamilies("single", ("as long",))
    # Intervals overlap by far, since episodes differ; of the same episodes the ratio is exact.
    (_, low, high), (_, other, _) = (found.seconds_per_episode()[name] for name in ("single", "double"))
    assert other < high
    assert found.times_cheapest("single")["double"] == pytest.approx((2.0, 2.0, 2.0))
    assert low < 4.025 < high
    # Episodes of one fleet were timed together, and tell no more than one
    fleets = compared(family("twice", seconds=(1.0,) * 4 + (3.0,) * 4), family("one", seconds=(1.0, 3.0)))
    assert fleets.seconds_per_episode()["twice"] == pytest.approx(fleets.seconds_per_episode()["one"])
    lessons = {
        "worse": lesson(100.0, (200.0, 50.0, 300.0)),
        "best": lesson(300.0),
        "near": lesson(250.0, (50.0, -100.0, 150.0)),
        "never": lesson(-100.0, (None, None, None), needed=(None, None, None)),
        "cannot": Lesson({}, failure="the expert cannot drive here"),
    }
    assert compared(family("best"), lessons=lessons).teaches == BestFamilies("best", ("near",))
