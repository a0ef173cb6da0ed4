"""The page of `score`."""

import numpy as np

from proxytune.report.page.foot import foot_of
from proxytune.report.page.rendering import html_of
from proxytune.report.scores.figures import flipped_pairs
from proxytune.report.scores.page import Drawn, score_page
from proxytune.report.scores.words import score_answer, score_next_step
from proxytune.report.writing import save
from proxytune.scores import Metric, ScoreTable
from proxytune.usefulness import assess, select_proxy

M = (Metric("distance"),)
EVIL = "<script>alert(1)</script>"


def table(order, episodes=4):
    """Scores of agents A, B, … that differ as the numbers of the order do."""
    rng = np.random.default_rng(1)
    values = np.array(order, dtype=float)[:, None, None] + 0.01 * rng.normal(size=(len(order), episodes, 1))
    agents = tuple(f"{EVIL}{place}" for place in range(len(order)))
    return ScoreTable(agents, tuple(map(str, range(episodes))), ("distance",), values)


TARGET = table(range(10))
SAME, REVERSED = table(range(10)), table(range(10)[::-1])


def assessed(proxy, **more):
    return assess(proxy=proxy, target=TARGET, metrics=M, resamples=100, **more)


def test_the_answer_says_prpv_and_whether_chance_explains_it():
    good, bad = assessed(SAME), assessed(REVERSED)
    answer = score_answer({"a": good}, None, target="t")
    assert answer.startswith(
        "As a proxy of t, a has a PRPV (proxy relative predictivity value) of 0 (0 to 0), of at most"
    )
    assert ": better than chance (" in answer
    assert "no better than chance (" in score_answer({"b": bad}, None, target="t")
    assert "until chance can be excluded" in score_next_step({"b": bad}, None)


def test_single_episodes_have_no_interval_and_the_next_step_is_more_of_them():
    single = assess(proxy=table(range(5), 1), target=table(range(5), 1), metrics=M, resamples=100)
    assert "of 0, of at most 20" in score_answer({"a": single}, None, target="t")
    assert "at least two episodes" in score_next_step({"a": single}, None)


def test_of_several_the_best_is_called_better_only_beyond_noise():
    tables = {"good": SAME, "bad": REVERSED}
    found = {name: assessed(one) for name, one in tables.items()}
    selection = select_proxy(proxies=tables, target=TARGET, metrics=M, resamples=100)
    assert "good ranks the agents most like t, beyond noise better than bad" in score_answer(
        found, selection, target="t"
    )
    assert score_next_step(found, selection).startswith("use good")
    twins = {"good": SAME, "other": table(range(10))}
    selection = select_proxy(proxies=twins, target=TARGET, metrics=M, resamples=100)
    found = {name: assessed(one) for name, one in twins.items()}
    assert "not beyond noise better than any other" in score_answer(found, selection, target="t")
    assert "tell the best proxies apart" in score_next_step(found, selection)


def test_the_page_has_what_the_terminal_shows_each_note_once_and_no_markup_of_names(tmp_path):
    save(flipped_pairs(assessed(REVERSED).prpv), tmp_path / "f.png")
    drawn = [Drawn("flipped_pairs", EVIL, (tmp_path / "f.png").read_bytes())]
    found = {EVIL: assessed(REVERSED), "other": assessed(SAME)}
    selection = select_proxy(proxies={EVIL: REVERSED, "other": SAME}, target=TARGET, metrics=M, resamples=100)
    one = html_of(score_page({EVIL: found[EVIL]}, None, drawn, foot_of("a"), target=EVIL))
    both = html_of(score_page(found, selection, drawn, foot_of("a"), target=EVIL))
    for text in (one, both):
        assert "<script" not in text
        assert "Kendall τ distance" in one
        assert "PRPV" in text
        for note in found[EVIL].notes:
            assert text.count(note.split(";")[0].replace("'", "&#x27;")) == 1
