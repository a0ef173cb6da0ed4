"""A study's page: finished, and while it runs."""

import html
import re

import pytest

from proxytune.report.html import page_html
from proxytune.report.study.figures import convergence_figure
from proxytune.report.study.page import RENEW_S, live_view, study_foot, study_view, write_live_page
from proxytune.report.study.sentence import say_answer, say_next_step, study_sentence
from proxytune.report.writing import CAPTIONS, svg_of


def text_of(result, figures=None):
    return page_html(study_view(result, figures or {}), study_foot(result.study.settings))


@pytest.fixture(scope="module")
def figures(result):
    return {"convergence": svg_of(convergence_figure(result))}


def test_every_figure_has_a_caption_and_the_page_begins_with_the_sentence_and_needs_nothing_else(result, figures):
    text = text_of(result, figures)
    assert not re.search(r"(src|href)=\"(?!data:|#)|https?://|<script|@import", text)
    assert "<svg" in text
    assert len(text) < 300_000
    first, after = html.escape(say_answer(result)), html.escape(say_next_step(result)).split("`")[0]
    heads = (f'class="answer">{first}</p>', after, ">95 % interval</th>", "<svg ", ">Trials</h2>")
    places = [text.index(one) for one in heads]
    assert places == sorted(places)
    assert study_sentence(result) == f"{say_answer(result)} Next: {say_next_step(result)}."
    text = text_of(result, dict.fromkeys(CAPTIONS["study"], figures["convergence"]))
    for name, said in CAPTIONS["study"].items():
        title = said["title"]
        (alt,) = re.findall(f'aria-label="({re.escape(html.escape(title))}[^"]*)"', text)
        assert len(alt) > len(title) + 40, name
    assert text.count("<figcaption") == len(CAPTIONS["study"])


def test_it_has_every_trial_the_best_theta_and_at_its_foot_how_to_come_by_it_again(result):
    text = text_of(result)
    for trial in result.trials:
        assert f'<tr><th scope="row" class="number">{trial.number}</th>' in text
    assert f"{result.best.trial.theta['trim']:.4g}</td>" in text
    assert f'<tr><th scope="row">PRPV</th><td class="number">{result.best.assessment.prpv.value}</td>' in text
    foot = text_of(result).split("<footer>")[1]
    assert f"python -m proxytune study {result.study.settings.folder}</code>" in foot
    assert '<th scope="row">engine</th><td>gp</td>' in foot
    assert re.search(r"Written \d{4}-\d\d-\d\d \d\d:\d\d .*with Python 3\..*numpy \d", foot)
    other = page_html(study_view(result, {}), study_foot(result.study.settings, "plot 'a b' --metric x"))
    assert "plot &#x27;a b&#x27; --metric" in other


def test_a_page_under_way_is_there_before_any_trial_renews_itself_calls_the_best_luck_and_tells_stops(result, tmp_path):
    settings, path = result.study.settings, tmp_path / "report.html"
    write_live_page(path, settings, "prpv", result.trials[:4], "trial 5 of 7")
    text = path.read_text(encoding="utf-8")
    best = min(result.trials[:4], key=lambda trial: trial.score)
    assert "Under way: trial 5 of 7. Best of 4 trials so far: " in text
    assert f"trial {best.number}, PRPV {best.prpv:g}, which may be partly luck" in text
    assert f'<meta http-equiv="refresh" content="{RENEW_S}">' in text
    assert text.count('<th scope="row" class="number">') == 4
    first = live_view(settings, "prpv", (), "pre-flight")
    assert first.sentence == "Under way: pre-flight. No trial has a score yet."
    assert first.parts == ()
    stopped = live_view(settings, "prpv", result.trials, "")
    assert stopped.sentence.startswith("Stopped before its end.")
    assert "run the same command to continue" in stopped.next_step
    write_live_page(path, settings, "prpv", result.trials, "")
    assert 'http-equiv="refresh"' not in path.read_text(encoding="utf-8")
