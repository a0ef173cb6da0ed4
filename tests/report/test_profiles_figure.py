from dataclasses import replace

import numpy as np
import pytest
from confirmations import planted

from proxytune.report.numbers import span
from proxytune.report.study.profiles_figure import density_of, profiles_figure
from proxytune.storage import Store
from proxytune.study import StudyRun, open_study, result_of


@pytest.fixture
def result(finished):
    """θ is known to be delay 0.12 and trim 0.1."""
    with Store.read(finished) as store:
        return planted(result_of(StudyRun(open_study(finished), store)))


def test_the_density_is_highest_where_theta_is_known_to_be_and_adds_up_to_one(result):
    for place, centre in enumerate((0.12, 0.1)):
        values, density = density_of(result, place)
        assert values[np.argmax(density)] == pytest.approx(centre, abs=0.01)
        assert np.trapezoid(density, values) == pytest.approx(1.0, abs=0.02)


def test_nothing_leaks_out_of_the_box(result):
    at_the_end = planted(result, centre=(0.0, 0.5), deviation=(0.05, 0.05))
    values, density = density_of(at_the_end, 0)
    assert values[0] == 0.0
    assert density[1] > 0.9 * density.max()
    assert np.trapezoid(density, values) == pytest.approx(1.0, abs=0.02)


def test_what_the_interval_leaves_out_is_grey_and_the_axis_is_the_box_with_its_unit(result):
    figure = profiles_figure(result)
    assert [axes.get_xlabel() for axes in figure.axes] == ["delay [s]", "trim"]
    for axes, box in zip(figure.axes, result.study.settings.space.intervals, strict=True):
        low, high = result.knowledge.intervals[box.name]
        spans = [(patch.get_x(), patch.get_x() + patch.get_width()) for patch in axes.patches]
        assert np.allclose(spans, [(box.low, low), (high, box.high)])
        assert axes.get_xlim() == (box.low, box.high)


def test_the_answer_is_a_line_and_the_truth_a_mark_only_where_it_is_known(result):
    known = profiles_figure(replace(result, truth={"trim": 0.11})).axes
    marks = [{line.get_label(): line.get_xdata()[0] for line in axes.get_lines()} for axes in known]
    theta = result.best.trial.theta
    assert [mark["answer"] for mark in marks] == [theta["delay"], theta["trim"]]
    assert ["truth" in mark for mark in marks] == [False, True]
    assert marks[1]["truth"] == 0.11


def test_what_remains_is_written_above_and_an_unidentified_parameter_is_called_so(result):
    vague = planted(result, deviation=(3.0, 0.02))
    ends = [span(vague.knowledge.intervals[name]) for name in ("delay", "trim")]
    titles = [axes.get_title() for axes in profiles_figure(vague).axes]
    assert titles == [f"unidentified: {ends[0]}", f"{ends[1]} remain"]


def test_it_can_be_read_in_one_column_of_a_paper(result):
    figure = profiles_figure(result)
    assert figure.get_figwidth() * 25.4 == pytest.approx(85.0)
    for axes in figure.axes:
        assert min(text.get_fontsize() for text in (axes.xaxis.label, *axes.get_xticklabels())) >= 7.0
