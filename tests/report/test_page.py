import html
import re
from dataclasses import replace

import pytest
from confirmations import TOLD, planted

from proxytune.report.study.convergence import convergence
from proxytune.report.study.finding import finding_of
from proxytune.report.study.page import page
from proxytune.report.study.verdict import sentence
from proxytune.report.writing import save
from proxytune.storage.store import Store
from proxytune.study.result import result_of
from proxytune.study.study import open_study
from proxytune.study.study_run import StudyRun


@pytest.fixture
def result(finished):
    with Store.read(finished) as store:
        return result_of(StudyRun(open_study(finished), store))


def test_the_page_needs_nothing_else_and_is_small(result, tmp_path):
    save(convergence(result), tmp_path / "convergence.png")
    text = page(result, [tmp_path / "convergence.png"])
    assert not re.search(r"(src|href)=\"(?!data:)|https?://|<script|@import", text)
    assert "data:image/png;base64," in text
    assert len(text) < 300_000


def test_it_begins_with_the_sentence_then_the_table_then_the_figures(result, tmp_path):
    save(convergence(result), tmp_path / "convergence.png")
    text = page(result, [tmp_path / "convergence.png"])
    verdict = html.escape(sentence(finding_of(result)))
    places = [text.index(one) for one in (f">{verdict}</p>", "<th>95 % interval</th>", "<img ", "<h2>Trials</h2>")]
    assert places == sorted(places)
    assert text.index("<p") == text.index('<p class="verdict">')


def test_it_has_a_row_for_every_trial_and_the_best_theta(result):
    text = page(result, [])
    for trial in result.trials:
        assert f"<tr><td>{trial.number}</td>" in text
    assert f"<td>{result.best.trial.theta['trim']:.4g}</td>" in text
    assert f"<tr><td>PRPV</td><td>{result.best.assessment.prpv.value}</td>" in text


def test_names_are_not_taken_for_markup(result):
    settings = replace(result.study.settings, name="<b>A & B</b>")
    text = page(replace(result, study=replace(result.study, settings=settings)), [])
    assert "<title>&lt;b&gt;A &amp; B&lt;/b&gt;</title>" in text
    assert "<b>" not in text
    told = replace(TOLD[0], agents=(("<i>agent</i>", 1.0),))
    text = page(planted(result, information=(told, TOLD[1])), [])
    assert "&lt;i&gt;agent&lt;/i&gt; 100 %" in text
    assert "<i>" not in text
