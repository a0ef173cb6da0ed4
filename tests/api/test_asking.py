"""A search box is asked and told: it finds an optimum, repeats itself, and refuses what was not asked."""

import math
import re

import pytest
from hypothesis import given, settings, strategies as st
from one_line import complaint_of

from proxytune.api.search_box import SearchBox
from proxytune.search import ENGINES, Engine
from proxytune.search.engine import RandomPoints

BOX = {"trim": (-0.3, 0.3), "delay": (0.0, 0.3)}


def bowl(theta):
    """Lowest, 0, at trim 0.1 and delay 0.2."""
    return ((theta["trim"] - 0.1) / 0.6) ** 2 + ((theta["delay"] - 0.2) / 0.3) ** 2


def searched(count, score=bowl, **options):
    box = SearchBox(BOX, **options)
    for _ in range(count):
        theta = box.ask()
        box.tell(theta, score(theta))
    return box


def test_the_optimum_of_a_toy_is_found_ten_times_better_than_by_the_design_also_as_a_maximum():
    box = searched(18)
    design = box.trials().score[:8].min()
    theta, score = box.best()
    assert score < 0.1 * design
    assert score == bowl(theta) == box.trials().score.min()
    assert theta["trim"] == pytest.approx(0.1, abs=0.05)
    assert theta["delay"] == pytest.approx(0.2, abs=0.025)
    low, high = searched(12), searched(12, score=lambda theta: -bowl(theta), maximise=True)
    assert low.trials()[["delay", "trim"]].equals(high.trials()[["delay", "trim"]])
    assert high.best() == (low.best()[0], -low.best()[1])
    assert (high.trials().score == -low.trials().score).all()


def test_the_same_seed_asks_the_same_another_does_not_and_asks_before_a_tell_are_a_batch_of_different_theta():
    assert searched(11).trials().equals(searched(11).trials())
    assert not searched(11).trials().equals(searched(11, seed=2).trials())
    box = searched(10)
    batch = [box.ask() for _ in range(4)]
    assert len({tuple(theta.values()) for theta in batch}) == 4
    assert len(box.trials()) == 10
    for theta in reversed(batch):
        box.tell(theta, bowl(theta))
    assert box.trials()[["trim", "delay"]][10:].to_dict("records") == [
        {"trim": theta["trim"], "delay": theta["delay"]} for theta in batch
    ], "trials are in the order in which they were asked for"


class Eavesdropper:
    """A proposer that keeps what it was shown."""

    def __init__(self):
        self.shown = []

    def propose(self, space, trials, seed):
        self.shown.append([(trial.values, trial.score, trial.pending) for trial in trials])
        return (0.01 * len(trials),)


def test_an_engine_of_one_s_own_sees_what_was_told_in_the_order_of_asking_then_what_is_pending_and_proposes():
    proposer = Eavesdropper()
    box = SearchBox({"x": (0.0, 1.0)}, engine=Engine("own", "", "", lambda: proposer), initial=1, maximise=True)
    asked = [box.ask() for _ in range(2)]
    box.tell(asked[0], 5.0)
    asked += [box.ask() for _ in range(3)]
    for place, score in ((3, 7.0), (2, 6.0)):
        box.tell(asked[place], score)
    box.ask()
    values = [tuple(theta.values()) for theta in asked]
    told = [(values[0], -5.0, False), (values[2], -6.0, False), (values[3], -7.0, False)]
    assert proposer.shown[-1] == [*told, (values[1], None, True), (values[4], None, True)]
    own = Engine("own", "mine", "random, as mine is", RandomPoints)
    assert searched(6, engine=own, initial=2).trials().equals(searched(6, engine="random", initial=2).trials())


def test_a_failed_simulation_is_kept_and_only_a_theta_that_was_asked_for_can_be_told_once():
    box = searched(9)
    failed = box.ask()
    box.tell(failed, None)
    assert math.isnan(box.trials().score.iloc[-1])
    assert box.ask() != failed
    assert box.best() == searched(9).best()
    box = SearchBox(BOX)
    assert "no score has been told; ask" in complaint_of(box.best)
    theta = box.ask()
    assert "was not asked for; tell what `ask` gave" in complaint_of(box.tell, {**theta, "trim": 0.0}, 1.0)
    assert "θ: trim must be a number, got None" in complaint_of(box.tell, {**theta, "trim": None}, 1.0)
    assert "θ names trim; the box has delay, trim" in complaint_of(box.tell, {"trim": 0.0}, 1.0)
    for wrong in (math.nan, math.inf, "x"):
        assert "a score must be a finite number, or None" in complaint_of(box.tell, theta, wrong)
    box.tell(theta, 1.0)
    assert "has a score already; ask for the next" in complaint_of(box.tell, theta, 1.0)
    assert box.trials().score.tolist() == [1.0]


@settings(max_examples=20)
@given(low=st.floats(-1e3, 1e3), width=st.floats(1e-3, 1e3), seed=st.integers(0, 2**32 - 1), initial=st.integers(1, 9))
def test_every_ask_lies_in_the_box(low, width, seed, initial):
    box = SearchBox({"x": (low, low + width)}, seed=seed, initial=initial, engine="random")
    for _ in range(5):
        theta = box.ask()
        assert low <= theta["x"] <= low + width
        box.tell(theta, theta["x"])


@pytest.mark.parametrize("engine", [one.name for one in ENGINES if one.learns_from == "outputs"])
def test_an_engine_that_needs_outputs_is_refused_with_one_that_does_not(engine):
    told = complaint_of(SearchBox, BOX, engine=engine)
    assert re.search(f"'{engine}' models what a score is computed from.*use 'gp'", told)


WRONG = {
    "an empty box": ({"box": {}}, "the box is empty; give at least one parameter"),
    "inside out": ({"box": {"trim": (0.3, -0.3)}}, "trim: the lower bound must be below the upper one"),
    "no pair": ({"box": {"trim": 0.3}}, r"trim: must be \(lowest, highest\), as in \(-0.3, 0.3\), got 0.3"),
    "no end": ({"box": {"trim": (0.0, math.inf)}}, "trim: bounds must be finite"),
    "an unknown engine": ({"engine": "gpp"}, "unknown engine 'gpp'.*did you mean 'gp'"),
    "no design": ({"initial": 0}, "initial must be at least 1, got 0"),
    "a negative seed": ({"seed": -1}, "seed must be at least 0, got -1"),
}


@pytest.mark.parametrize(("changes", "words"), WRONG.values(), ids=WRONG)
def test_a_box_that_cannot_be_searched_is_refused(changes, words):
    assert re.search(words, complaint_of(SearchBox, **{"box": BOX, **changes}))
