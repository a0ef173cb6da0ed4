from dataclasses import replace

import numpy as np
import pytest

from proxytune.report.page.rendering import html_of
from proxytune.report.study.document import study_document
from proxytune.report.study.importance_figure import importance_figure
from proxytune.report.study.page import study_page
from proxytune.report.study.search_rows import importance_row
from proxytune.search import Importance
from proxytune.storage import Store
from proxytune.study import StudyRun, open_study, result_of


@pytest.fixture
def result(finished):
    with Store.read(finished) as store:
        found = result_of(StudyRun(open_study(finished), store))
    planted = (Importance("delay", 0.25, (0.1, 0.4), 0.125), Importance("trim", 0.75, (0.5, 1.0), 0.5))
    return replace(found, importances=planted)


def test_a_study_has_the_importance_of_each_of_its_parameters(finished):
    with Store.read(finished) as store:
        found = result_of(StudyRun(open_study(finished), store)).importances
    assert [importance.name for importance in found] == ["delay", "trim"]


def test_a_dot_is_the_share_a_stroke_what_is_alone_and_a_line_the_interval_most_important_on_top(result):
    (axes,) = importance_figure(result).axes
    assert [label.get_text() for label in axes.get_yticklabels()] == ["delay", "trim"]
    drawn = {line.get_label(): line.get_xydata().tolist() for line in axes.get_lines()}
    assert drawn["alone or with others"] == [[0.25, 0.0], [0.75, 1.0]]
    assert drawn["alone"] == [[0.125, 0.0], [0.5, 1.0]]
    ends = [path.vertices[:, 0] for path in axes.collections[0].get_paths()]
    assert np.allclose(ends, [(0.1, 0.4), (0.5, 1.0)])


def test_the_document_the_table_and_the_page_say_the_same(result):
    assert study_document(result)["importance"] == {
        "delay": {"share": 0.25, "interval": [0.1, 0.4], "alone": 0.125},
        "trim": {"share": 0.75, "interval": [0.5, 1.0], "alone": 0.5},
    }
    label, shares = importance_row(result)
    assert shares.endswith(": trim 0.75 (0.50 to 1.00), delay 0.25 (0.10 to 0.40)")
    text = html_of(study_page(result, {}))
    assert f'<th scope="row">{label}</th><td class="prose">{shares}</td>' in text
