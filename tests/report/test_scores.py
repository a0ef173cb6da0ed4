"""Page and figures of `score`."""

from dataclasses import replace

import numpy as np
import pytest
from score_tables import table_of

from proxytune.report.decision import choices_sentences, decision_table, sequential_sentence
from proxytune.report.score_figures import FLIP_COLOURS, LONGEST, MOST, flipped_pairs_figure, scatter_figure
from proxytune.report.scores import score_next_step, score_sentence, write_score_report
from proxytune.report.view import foot_of
from proxytune.report.writing import save_figure
from proxytune.scores import Metric, ScoreTable
from proxytune.usefulness import Sequential, assess, assess_each, select_proxy


def test_a_sequential_test_counts_rollouts_or_where_they_are_repeated_starts():
    found = Sequential("a", 7, 60, {"a": 25.0, "b": 0.1}, 20.0, {}, independent=1.0)
    assert sequential_sentence(found) == "a is shown to be the best, after 7 of 60 rollouts of each agent"
    assert "7 of 60 starts, the repeats of one being one score, of" in sequential_sentence(
        replace(found, independent=0.1)
    )


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


def test_the_answer_says_prpv_and_chance_of_single_episodes_that_more_are_needed_and_of_several_the_best():
    good, bad = assessed(SAME), assessed(REVERSED)
    answer = score_sentence({"a": good}, None, target="t")
    assert answer.startswith(
        "As a proxy of t, a has a PRPV (proxy relative predictivity value) of 0 (0 to 0), of at most"
    )
    assert ": better than chance (" in answer
    assert "no better than chance (" in score_sentence({"b": bad}, None, target="t")
    assert "until chance can be excluded" in score_next_step({"b": bad}, None)
    tie = table_of([[2.0], [2.0], [1.0]], metrics=("distance",))
    tied = score_sentence({"a": assess(proxy=tie, target=tie, metrics=M, resamples=100)}, None, target="t")
    assert "By the means as published, A0 and A1 tie as the best on t;" in tied
    single = assess(proxy=table(range(5), 1), target=table(range(5), 1), metrics=M, resamples=100)
    assert "of 0, of at most 20" in score_sentence({"a": single}, None, target="t")
    assert "at least two episodes" in score_next_step({"a": single}, None)
    tables = {"good": SAME, "bad": REVERSED}
    found = {name: assessed(one) for name, one in tables.items()}
    selection = select_proxy(proxies=tables, target=TARGET, metrics=M, resamples=100)
    assert "good ranks the agents most like t, beyond noise better than bad" in score_sentence(
        found, selection, target="t"
    )
    assert score_next_step(found, selection).startswith("use good")
    twins = {"good": SAME, "other": table(range(10))}
    selection = select_proxy(proxies=twins, target=TARGET, metrics=M, resamples=100)
    found = {name: assessed(one) for name, one in twins.items()}
    told = score_sentence(found, selection, target="t")
    assert "good and other rank the agents most like t (PRPV 0 each), not beyond noise better than any other" in told
    assert "tell the best proxies apart" in score_next_step(found, selection)


def test_large_scores_that_differ_little_are_told_to_the_digits_of_their_intervals():
    large = table(12000 + np.arange(4))
    rows = decision_table(assess(proxy=large, target=large, metrics=M, resamples=100), "t").rows
    scores = [row[1] for row in rows]
    assert len(set(scores)) == 4
    assert all(score.startswith("120") and "e" not in score for score in scores)


def test_of_several_proxies_one_that_ties_its_winners_is_said_to_cost_what_the_worse_of_them_does():
    best_first = table([3, 2, 1, 0])
    both = {"flat": replace(best_first, values=np.ones((4, 4, 1))).unpaired(), "good": best_first}
    found, selection = assess_each(proxies=both, target=best_first, metrics=M, resamples=100)
    lines = choices_sentences(found, selection, "t")
    assert "at an expected regret of up to 3; " in lines[0]
    assert "too few starts are paired, and all agents score alike in the proxy" in lines[0]
    assert lines[2].startswith("choosing by good instead of flat gains 3 ")


@pytest.mark.slow
def test_the_page_has_what_the_terminal_shows_each_note_once_and_no_markup_of_names(tmp_path):
    found = {EVIL: assessed(REVERSED), "other": assessed(SAME)}
    selection = select_proxy(proxies={EVIL: REVERSED, "other": SAME}, target=TARGET, metrics=M, resamples=100)
    texts = []
    for proxies, ranked, count in (({EVIL: found[EVIL]}, None, 3), (found, selection, 6)):
        figures, page = write_score_report(proxies, ranked, tmp_path, foot_of("a"), target=EVIL)
        texts.append(page.read_text(encoding="utf-8"))
        assert len(figures) == texts[-1].count("<figure>") == count
    one, both = texts
    for text in (one, both):
        assert "<script" not in text
        assert "Kendall τ distance" in one
        assert "PRPV" in text
        for note in found[EVIL].notes:
            assert text.count(note.split(";")[0].replace("'", "&#x27;")) == 1


BOTH = (Metric("distance"), Metric("time", "min"))


def drawn_at_random(seed, agents=6):
    return table_of(np.random.default_rng(seed).normal(size=(agents, 3, 2)), metrics=("distance", "time"))


@pytest.fixture
def assessment():
    return assess(proxy=drawn_at_random(4), target=drawn_at_random(5), metrics=BOTH, resamples=100)


def test_points_names_and_bars_of_a_scatter_are_those_of_the_scores(assessment):
    panels = scatter_figure(assessment).axes
    assert [axes.get_xlabel() for axes in panels] == ["distance on the target", "time on the target"]
    for column, axes in enumerate(panels):
        points = next(line for line in axes.lines if line.get_marker() == "o")
        np.testing.assert_array_equal(points.get_xdata(), assessment.inputs.target.means[:, column])
        np.testing.assert_array_equal(points.get_ydata(), assessment.inputs.proxy.means[:, column])
        assert sorted(text.get_text() for text in axes.texts) == sorted(assessment.inputs.agents)

    axes = scatter_figure(assessment).axes[0]
    means = assessment.inputs.proxy.means[:, 0]
    top_down = sorted(axes.texts, key=lambda text: -text.get_position()[1])
    assert [text.get_text() for text in top_down] == [f"A{row}" for row in np.argsort(-means)]
    for text in axes.texts:
        row = int(text.get_text()[1:])
        assert text.xy == (assessment.inputs.target.means[row, 0], means[row])

    bars = axes.collections[0].get_segments()
    values = assessment.inputs.target.values[0, :, 0]
    half = np.ptp(bars[0][:, 0]) / 2
    assert half == pytest.approx(values.std(ddof=1) / np.sqrt(len(values)))


@pytest.mark.parametrize("agents", [pytest.param(6, marks=pytest.mark.slow), MOST])
def test_no_two_names_overlap_and_none_is_cut_at_85_millimetres(agents):
    values = np.round(np.random.default_rng(1).normal(size=(agents, 3, 2)), 1)
    values[: agents // 2] = 1.0
    both = ScoreTable(tuple(f"policy_number_{i}" for i in range(agents)), ("0", "1", "2"), ("distance", "time"), values)
    figure = scatter_figure(assess(proxy=both, target=both, metrics=BOTH, resamples=20))
    assert figure.get_figwidth() * 25.4 == pytest.approx(85.0)
    figure.draw_without_rendering()
    for axes in figure.axes:
        heights = sorted(text.get_position()[1] * axes.bbox.height for text in axes.texts)
        assert np.diff(heights).min() * 72.0 / figure.dpi > max(text.get_fontsize() for text in axes.texts)
        assert max(text.get_window_extent().x1 for text in axes.texts) <= figure.bbox.x1


def test_of_many_agents_those_whose_rank_differs_most_are_named_and_constant_scores_of_two_drawn_too(tmp_path):
    scores = np.arange(40.0)[:, None, None]
    moved = scores.copy()
    moved[[3, 36]] = scores[[36, 3]]
    names = tuple(f"module.of.some.package:agent{row}" for row in range(40))
    tables = [ScoreTable(names, ("0",), ("distance",), values) for values in (scores, moved)]
    (axes,) = scatter_figure(assess(proxy=tables[0], target=tables[1], metrics=BOTH[:1])).axes
    named = [text.get_text() for text in axes.texts]
    assert len(named) == MOST
    assert {name.rsplit(":", 1)[1] for name in named} >= {"agent3", "agent36"}
    assert max(map(len, named)) == LONGEST
    flat = ScoreTable(("A", "B"), ("1",), ("distance", "time"), np.ones((2, 1, 2)))
    found = assess(proxy=flat, target=flat, metrics=BOTH)
    assert scatter_figure(found).axes[0].get_title() == "SRCC undefined"
    for name, figure in (("one", scatter_figure(found)), ("two", flipped_pairs_figure(found.prpv))):
        save_figure(figure, tmp_path / "new" / f"{name}.png")
        assert (tmp_path / "new" / f"{name}.png").read_bytes().startswith(b"\x89PNG")


def test_the_map_colours_each_pair_once_and_counts_them_and_of_many_agents_is_a_picture_of_the_same_width(assessment):
    axes = flipped_pairs_figure(assessment.prpv).axes[0]
    cells = np.asarray(axes.collections[0].get_array().filled(np.nan))
    kinds = list(FLIP_COLOURS)
    drawn = {kind: int((cells == number).sum()) for number, kind in enumerate(kinds)}
    for kind in kinds[1:]:
        assert drawn[kind] == sum(pair.flip == kind for pair in assessment.prpv.pairs)
    assert len(assessment.prpv.pairs) > 3
    assert sum(drawn.values()) == 15
    assert np.isnan(cells[np.triu_indices(6)]).all()
    assert [text.get_text() for text in axes.get_legend().get_texts()] == [f"{k}: {n}" for k, n in drawn.items()]
    big = assess(proxy=drawn_at_random(4, agents=300), target=drawn_at_random(5, agents=300), metrics=BOTH, resamples=2)
    few, many = (
        flipped_pairs_figure(one.prpv)
        for one in (assess(proxy=drawn_at_random(4), target=drawn_at_random(5), metrics=BOTH), big)
    )
    assert few.get_figwidth() == many.get_figwidth()
    assert few.get_figwidth() * 25.4 == pytest.approx(85.0)
    (picture,) = many.axes[0].images
    reversed_ = list(FLIP_COLOURS).index("reversed")
    assert (picture.get_array() == reversed_).sum() == sum(pair.flip == "reversed" for pair in big.prpv.pairs) > 0
    many.draw_without_rendering()
    assert not any("A" in label.get_text() for label in many.axes[0].get_yticklabels())
