"""Page of `teach` claims no more than the intervals allow."""

from dataclasses import replace
from types import MappingProxyType, SimpleNamespace

import numpy as np
import pytest

from proxytune.learning import Costs, Distribution, LearningCurve, LearningEstimate, TeachingValue, sample_needs
from proxytune.learning.plv import Published
from proxytune.report.html import page_html
from proxytune.report.plv_search import plv_answer, plv_next_step
from proxytune.report.teaching import (
    sorted_by_worth,
    teach_answer,
    teach_figure,
    teach_next_step,
    teach_table,
    teach_view,
)
from proxytune.report.view import Column, foot_of
from proxytune.teaching import Experiment, TeacherResult

NOTHING = LearningEstimate(None, None, None)
COUNTS = (0, 50, 100, 200, 400)
EVIL = "<script>alert(1)</script>"


PREDICTS = SimpleNamespace(prpv=3.0, interval=(2.0, 5.0), resampled=None, chance=SimpleNamespace(explains=False))
NOBODY = MappingProxyType({})
COSTS = Costs()


def lesson(name, plv):
    worth = TeachingValue(LearningEstimate(400, 200, 400), LearningEstimate(100, 50, 400), plv, NOTHING, NOTHING)
    scores = np.linspace(10.0, 50.0, 5) + np.arange(3)[:, None]
    cost = LearningEstimate(*(None if end is None else 2.5 * end for end in (plv.value, plv.low, plv.high)))
    return TeacherResult(
        name, Distribution({}), LearningCurve(COUNTS, scores), LearningEstimate(10.0, 8.0, 12.0), worth, cost
    )


LESSONS = (
    lesson("sure", LearningEstimate(300, 100, 350)),
    lesson("harmful", LearningEstimate(None, None, 0)),
    lesson("wide", LearningEstimate(300, -100, 400)),
    lesson("reaching", LearningEstimate(200, None, 400)),
    lesson("far", LearningEstimate(None, 120, None)),
    lesson(EVIL, LearningEstimate(0, 0, 0)),
)


ALONE = (5.0, 20.0, 40.0, 50.0)


def experiment(lessons=LESSONS, gain=1.0, published=NOBODY, examinations=None, costs=COSTS, alone=ALONE):
    without = LearningCurve(COUNTS, np.array([[np.nan, *alone]] * 3))
    curves = {"none": without, **{one.name: one.curve for one in lessons}}
    needs = sample_needs(curves, best_score=60.0, tolerance=5.0, level=50.0, draws=60)
    taught = {"published": published, "published_in": "a paper", "examinations": examinations, "costs": costs}
    settings = SimpleNamespace(name=EVIL, teaching=SimpleNamespace(target_samples=COUNTS, **taught))
    return Experiment(settings, 60.0, replace(needs, gain=gain), lessons)


def test_a_proxy_saves_samples_only_if_its_whole_interval_says_so_and_is_named_there():
    saves, none, unknown = sorted_by_worth(LESSONS)
    assert [one.name for one in saves] == ["sure", "far"]
    assert [one.name for one in none] == ["harmful", EVIL]
    assert [one.name for one in unknown] == ["wide", "reaching"]
    shown, rest = teach_answer(experiment()).split(" None saved: ")
    assert "sure: 300 (100 to 350)" in shown
    assert "wide" not in shown
    assert rest.index("harmful") < rest.index("Open, since") < rest.index("wide: 300 (−100 to 400)")
    assert "none is shown" in teach_answer(experiment(LESSONS[2:3]))


def test_what_was_published_stands_beside_what_is_found_and_plv_in_cost_where_costs_are_stated():
    theirs = {"none": Published(0.0, 9000, 0.0), "sure": Published(47.4, 250, 0.97)}
    page = teach_view(experiment(published=theirs), {}, b"a picture")
    table = next(part for part in page.parts if getattr(part, "title", "") == "Beside what was published")
    assert [row[:2] for row in table.rows] == [("none", "0"), ("sure", "47.4")]
    assert table.rows[1][3:] == ("250", "100 (50 to 400)", "97 %", "")
    assert table.notes == ("a paper",)
    assert len(teach_view(experiment(), {}, b"a picture").parts) == len(page.parts) - 1
    stated = experiment(costs=Costs(2.5, 2.5, 0.0), published={"sure": Published(47.4, 250, 0.97)})
    table, plain = (teach_view(one, {}, b"a picture").parts[0] for one in (stated, experiment()))
    assert table.columns == (*plain.columns, Column("PLV in cost", numbers=True))
    costs = {row[0]: row[-1] for row in table.rows}
    assert costs["none"] == ""
    assert costs["sure"] == "750 (250 to 875)"
    assert costs["far"] == "unknown (300 or more)"
    assert any("off_policy 2.5, on_policy 2.5, label 0" in note for note in table.notes)


def test_the_next_step_is_more_seeds_while_something_is_open_and_says_why_plv_is_unknown():
    assert "raise teaching.seeds from 3 to 6" in teach_next_step(experiment())
    assert "train in a proxy that saves" in teach_next_step(experiment(LESSONS[:2]))
    assert "train without these proxies" in teach_next_step(experiment(LESSONS[1:2]))
    early = teach_next_step(experiment(alone=(49.0, 50.0, 50.0, 50.0)))
    assert early.startswith("add smaller numbers to teaching.target_samples, or lower teaching.tolerance: without a")
    assert "comes to 45 by 50 samples already" in early
    low = experiment(alone=(47.0, 43.0, 48.0, 50.0))
    told = (
        "the score that counts as converged, 45, is no more than a learner without a proxy scores after 50 samples (4"
    )
    assert any(note.startswith(told) for note in teach_table(low, {}).notes)
    assert not any("counts as converged" in note for note in teach_table(experiment(), {}).notes)
    rising = experiment(gain=5.1)
    assert "is unknown: without a proxy the score still rises by more than 5" in teach_answer(rising)
    assert teach_next_step(rising).startswith("raise teaching.target_samples: ")
    coarse = experiment(gain=None)
    assert "is unknown: teaching.target_samples has no number from 1 to 200, which would" in teach_answer(coarse)
    assert teach_next_step(coarse).startswith("add a number of target samples between 1 and 200, as [0, 50, ")
    assert "raise teaching.examinations from 20 to 40" in teach_next_step(experiment(examinations=20))


@pytest.mark.parametrize(
    ("plv", "judged", "step"),
    [
        (LearningEstimate(84, 33, 180), "it saves target samples.", "train in proxy: nominal θ, then on target"),
        (LearningEstimate(-84, -180, -33), "it saves none.", "train without a proxy, or raise teaching.budget"),
        (LearningEstimate(9, -20, 30), "that it saves any is not shown: the interval holds 0.", "raise teaching.seeds"),
    ],
)
def test_a_search_by_plv_says_of_its_best_finalist_what_the_interval_allows(plv, judged, step):
    study = SimpleNamespace(trials=range(3), confirmed=experiment((lesson("proxy", plv),)))
    assert plv_answer(study).endswith(f"target samples saved; {judged}")
    assert plv_next_step(study).startswith(step)


def test_where_the_finalists_cannot_be_judged_the_next_step_says_why():
    study = SimpleNamespace(trials=range(3), confirmed=experiment((lesson("proxy", NOTHING),), gain=6.0))
    assert "no finalist is known to save" in plv_answer(study)
    assert plv_next_step(study).startswith("raise teaching.target_samples: without a proxy the score still rises")


def test_each_proxy_has_a_panel_of_its_own_in_a_figure_that_fits_a_column():
    drawn = experiment()
    panels = [axes for axes in teach_figure(drawn).axes if axes.get_visible()]
    assert [axes.get_title() for axes in panels] == [one.name for one in LESSONS]
    for axes, one in zip(panels, LESSONS, strict=True):
        curves = {line.get_label(): line for line in axes.lines}
        assert {"with the proxy", "without a proxy", "converged"} <= curves.keys()
        assert list(curves["with the proxy"].get_ydata()) == list(drawn.needs.draws.scores[one.name].mean(axis=0))
        dots = [line for line in axes.lines if line.get_linestyle() == "None"]
        assert sum(len(line.get_ydata()) for line in dots) == 3 * 5 + 3 * 4
        ends = [path.vertices[:, 0].tolist() for bars in axes.collections[2:] for path in bars.get_paths()]
        assert ends[-1][0] < ends[-1][1]

    assert teach_figure(experiment()).get_figwidth() * 25.4 <= 86.0


def test_the_page_has_table_1_and_takes_no_name_for_markup():
    taught = experiment()
    text = page_html(teach_view(taught, {"sure": PREDICTS}, teach_figure(taught)), foot_of("teach"))
    assert "<script" not in text
    assert '<th scope="row">sure</th><td class="number">3 (2 to 5)</td>' in text
    assert "converged: the mean score is at least 45.0 of 60" in text
