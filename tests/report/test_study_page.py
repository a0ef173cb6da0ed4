"""A study's page: finished, and while it runs."""

import html
import re
from dataclasses import replace

import pytest
from confirmations import TOLD, planted

from proxytune.report.page.rendering import html_of
from proxytune.report.study.captions import TITLES
from proxytune.report.study.convergence import convergence
from proxytune.report.study.finding import finding_of
from proxytune.report.study.live_page import live_page
from proxytune.report.study.page import study_page
from proxytune.report.study.verdict import answer, next_step, sentence
from proxytune.report.writing import save
from proxytune.storage import Store
from proxytune.study import StudyRun, open_study, result_of

EVIL = "<script>alert(1)</script>"


@pytest.fixture
def result(finished):
    with Store.read(finished) as store:
        return result_of(StudyRun(open_study(finished), store))


def text_of(result, figures=None):
    return html_of(study_page(result, figures or {}))


@pytest.fixture
def figures(result, tmp_path):
    save(convergence(result), tmp_path / "convergence.png")
    return {"convergence": (tmp_path / "convergence.png").read_bytes()}


def test_the_page_needs_nothing_else_and_is_small(result, figures):
    text = text_of(result, figures)
    assert not re.search(r"(src|href)=\"(?!data:|#)|https?://|<script|@import", text)
    assert "data:image/png;base64," in text
    assert len(text) < 300_000


def test_it_begins_with_the_answer_and_the_next_step_which_are_the_sentence(result, figures):
    finding = finding_of(result)
    text = text_of(result, figures)
    first, after = html.escape(answer(finding)), html.escape(next_step(finding)).split("`")[0]
    heads = (f'class="answer">{first}</p>', after, ">95 % interval</th>", "<img ", ">Trials</h2>")
    places = [text.index(one) for one in heads]
    assert places == sorted(places)
    assert sentence(finding) == f"{answer(finding)} Next: {next_step(finding)}"


def test_every_figure_has_a_caption_and_an_alternative_text_that_says_what_to_see(result, figures):
    image = figures["convergence"]
    text = text_of(result, dict.fromkeys(TITLES, image))
    for name, title in TITLES.items():
        (alt,) = re.findall(f'alt="({re.escape(html.escape(title))}[^"]*)"', text)
        assert len(alt) > len(title) + 40, name
    assert text.count("<figcaption") == len(TITLES)


def test_it_has_a_row_for_every_trial_and_the_best_theta(result):
    text = text_of(result)
    for trial in result.trials:
        assert f'<tr><th scope="row" class="number">{trial.number}</th>' in text
    assert f"{result.best.trial.theta['trim']:.4g}</td>" in text
    assert f'<tr><th scope="row">PRPV</th><td class="number">{result.best.assessment.prpv.value}</td>' in text


def test_its_foot_has_the_command_the_settings_the_versions_and_the_date(result):
    foot = text_of(result).split("<footer>")[1]
    folder = result.study.settings.folder
    assert f"python -m proxytune study {folder}</code>" in foot
    assert '<th scope="row">engine</th><td>gp</td>' in foot
    assert re.search(r"Written \d{4}-\d\d-\d\d \d\d:\d\d .*with Python 3\..*numpy \d", foot)
    assert "plot &#x27;a b&#x27; --metric" in html_of(
        study_page(result, {}, "python -m proxytune plot 'a b' --metric x")
    )


def test_names_are_not_taken_for_markup(result):
    settings = replace(result.study.settings, name="<b>A & B</b>", agents=(EVIL, "b"))
    text = text_of(replace(result, study=replace(result.study, settings=settings)))
    assert "<title>&lt;b&gt;A &amp; B&lt;/b&gt;</title>" in text
    assert not re.search("<(b|script)>", text)
    told = replace(TOLD[0], agents=(("<i>agent</i>", 1.0),))
    text = text_of(planted(result, information=(told, TOLD[1])))
    assert "&lt;i&gt;agent&lt;/i&gt; 100 %" in text
    assert "<i>" not in text


def test_a_page_under_way_renews_itself_and_names_the_best_trial_as_possible_luck(result):
    settings = result.study.settings
    page = live_page(settings, "prpv", result.trials[:4], "trial 5 of 7")
    best = min(result.trials[:4], key=lambda trial: trial.score)
    assert page.answer.startswith("Under way: trial 5 of 7. Best of 4 trials so far: ")
    assert f"trial {best.number}, PRPV {best.prpv:g}, which may be partly luck" in page.answer
    text = html_of(page)
    assert f'<meta http-equiv="refresh" content="{page.renew_s}">' in text
    assert page.renew_s > 0
    assert text.count('<th scope="row" class="number">') == 4


def test_a_page_under_way_is_there_before_any_trial_has_ended_and_says_when_a_study_was_stopped(result):
    settings = replace(result.study.settings, name=EVIL)
    first = live_page(settings, "prpv", (), "pre-flight")
    assert first.answer == "Under way: pre-flight. No trial has a score yet."
    assert first.parts == ()
    assert "<script" not in html_of(first)
    stopped = live_page(settings, "prpv", result.trials, "")
    assert stopped.renew_s == 0
    assert stopped.answer.startswith("Stopped before its end.")
    assert 'http-equiv="refresh"' not in html_of(stopped)
    assert "run the same command to continue" in stopped.following
