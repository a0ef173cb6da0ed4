"""Sentence, figure and page of several families."""

from dataclasses import replace
from types import SimpleNamespace

import pytest
from readable import assert_readable
from several_tuned import compared, family, lesson

from proxytune.learning import LearningEstimate
from proxytune.report.families import (
    _family_document,
    _theta_cell,
    families_answer,
    families_figure,
    families_next_step,
)
from proxytune.report.study.sentence import KnownParameter
from proxytune.study import Lesson

DEAR, CHEAP = (2.0, 2.2, 1.8, 2.0), (1.0, 1.1, 0.9, 1.0)
BOTH = (family("bullet", 0, DEAR, noise=8.0), family("planar", 0, CHEAP, noise=8.0))


def test_nothing_is_claimed_of_chance_of_several_families_and_a_clear_winner_or_the_cheapest_used():
    found = compared(family("bullet", 0, DEAR), family("planar", 4, CHEAP))
    answer = families_answer(found)
    assert answer.startswith("To predict: bullet, fresh PRPV (proxy relative predictivity value) 0 (0 to 0); worse: ")
    assert "worse: planar +8 (" in answer
    assert answer.endswith("Cheapest: planar, 1 s per episode (0.9 to 1.1); times as long: bullet 2 (2 to 2).")
    assert "To teach" not in answer
    assert families_next_step(found) == "use bullet to predict; its page: study/families/bullet/report.html."
    found = compared(*BOTH)
    assert "; cannot be told from it: planar +0 (" in families_answer(found)
    assert families_next_step(found).startswith("use planar to predict, which costs least of those; to tell them apart")
    found = compared(family("a", 0, CHEAP, noise=8.0), family("b", 0, CHEAP, noise=8.0))
    assert families_next_step(found) == "to tell a and b apart, raise starts and measure the target from them too."
    assert "cannot be told from it: b 1 (1 to 1)." in families_answer(found)
    found = compared(family("a", 4, noise=0.1), family("b", 4, noise=0.1))
    for one in found.families:
        object.__setattr__(one.fresh.chance, "p_value", 0.4)
    assert "To predict: none is shown to be better than chance; lowest is a, fresh PRPV" in families_answer(found)
    assert families_next_step(found).startswith("raise stop.wall_time_s (now 60)")
    found = compared(family("a", fresh=False), family("b", fresh=False))
    assert "To predict: not known, since no family has fresh episodes." in families_answer(found)
    assert families_next_step(found).startswith("run the study again")
    found = compared(family("a", 0, CHEAP), family("b", 1, tuple(131.0 * one for one in CHEAP)))
    assert "times as long: b 130 (130 to 130)." in families_answer(found)
    found = compared(family("a", 0, CHEAP), family("b", 1, tuple(1.03 * one for one in CHEAP)))
    assert "times as long: b 1.03 (1.03 to 1.03)." in families_answer(found)
    found = compared(family("a", 0, CHEAP, noise=8.0), family("b", 0, tuple(1.004 * one for one in CHEAP), noise=8.0))
    assert "per episode (0.9 to 1.1); cannot be told from it: b 1 (1 to 1)." in families_answer(found)
    assert families_next_step(found).startswith("to tell a and b apart")


@pytest.mark.parametrize(
    ("lessons", "says"),
    [
        (
            {"bullet": lesson(300.0), "planar": lesson(100.0, (200.0, 50.0, 300.0))},
            "To teach: bullet, PLV (proxy learning value) 300 (290 to 310) target samples saved; "
            "worse: planar, 200 (50 to 300) more samples.",
        ),
        (
            {"bullet": lesson(300.0), "planar": lesson(290.0, (10.0, -50.0, 30.0))},
            "target samples saved; cannot be told from it: planar, 10 (−50 to 30) more samples.",
        ),
        ({"bullet": lesson(5.0), "planar": Lesson({}, failure="no")}, "To teach: none is shown to save target samples"),
        ({"bullet": lesson(50.0), "planar": Lesson({}, failure="no")}, "worse: planar, which cannot teach."),
        ({"bullet": Lesson({}, 1.0), "planar": Lesson({}, 1.0)}, "is not known, learners have not converged; raise "),
        ({}, "To teach: PLV (proxy learning value) is not known, nothing was taught yet."),
    ],
)
def test_who_teaches_best_is_said_with_the_samples_saved(lessons, says):
    assert says in families_answer(compared(*BOTH, lessons=lessons))


def test_a_panel_per_use_tells_best_alike_and_worse_apart_draws_open_intervals_and_has_no_teaching_without_it():
    families = (family("good", 0, DEAR), family("bad", 4, DEAR), family("poor", 3, CHEAP))
    lessons = {"good": lesson(-20.0), "bad": Lesson({}, failure="no"), "poor": lesson(-30.0, (10.0, -50.0, 30.0))}
    figure = families_figure(compared(*families, lessons=lessons))
    assert [axes.get_xlabel().split("\n")[0] for axes in figure.axes] == ["fresh PRPV", "PLV", "time per"]
    labels = {text for axes in figure.axes for text in axes.get_legend_handles_labels()[1]}
    assert labels == {"best", "cannot be told from it", "worse"}
    assert [text.get_text() for text in figure.axes[1].texts] == ["not known"]
    assert [text.get_text() for text in figure.axes[0].get_yticklabels()] == ["good", "bad", "poor"]
    assert figure.axes[1].get_xlim()[0] < -40.0
    assert_readable(figure)
    lessons = {"a": lesson(-20.0), "b": replace(lesson(-30.0), plv=LearningEstimate(-30.0, None, 5.0))}
    plv = families_figure(compared(family("a"), family("b"), lessons=lessons)).axes[1]
    assert [-30.0, 5.0] in [list(line.get_xdata()) for line in plv.lines]
    figure = families_figure(compared(family("a" * 40), family("b", 2)))
    assert len(figure.axes) == 2
    assert figure.axes[0].get_yticklabels()[0].get_text() == f"{'a' * 15}…"


def test_a_family_s_best_value_of_a_parameter_is_told_with_its_interval_and_one_that_it_lacks_left_out():
    known = KnownParameter("delay", "s", 0.1, (0.05, 0.15), 0.2, identified=True)
    assert (_theta_cell(known), _theta_cell(None)) == ("0.1 s (0.05 to 0.15)", "")


@pytest.mark.parametrize(("prpv", "told"), [(None, None), (4.0, 4)])
def test_a_prpv_that_a_family_has_not_is_null_not_that_of_a_perfect_proxy(prpv, told):
    settings = SimpleNamespace(family="lane", domain=SimpleNamespace(values={}), home="here")
    known = SimpleNamespace(intervals={}, misfit=SimpleNamespace(fits=None))
    facts = {"best": SimpleNamespace(trial=SimpleNamespace(prpv=prpv)), "knowledge": known, "trials": ()}
    result = SimpleNamespace(study=SimpleNamespace(settings=settings), stopped="", perfect=False, **facts)
    one = SimpleNamespace(result=result, fresh=None, theta={}, seconds=1.0)
    assert _family_document(one, (1.0, 0.9, 1.1))["prpv"] == told
