"""The figures of `score` show the figures of the assessment."""

import numpy as np
import pytest

from proxytune.errors import RunError
from proxytune.report.scores.figures import FLIP_COLOURS, LONGEST, MOST, flipped_pairs, scatter
from proxytune.report.writing import save
from proxytune.scores import Metric, ScoreTable
from proxytune.usefulness import assess

M = (Metric("distance"), Metric("time", "min"))


def table(seed, agents=6, episodes=3):
    values = np.random.default_rng(seed).normal(size=(agents, episodes, 2))
    return ScoreTable(
        tuple(f"A{i}" for i in range(agents)), tuple(map(str, range(episodes))), ("distance", "time"), values
    )


@pytest.fixture
def assessment():
    return assess(proxy=table(4), target=table(5), metrics=M, resamples=100)


def test_the_scatter_has_a_panel_per_metric_with_every_agent_named(assessment):
    panels = scatter(assessment).axes
    assert [axes.get_xlabel() for axes in panels] == ["distance on the target", "time on the target"]
    for column, axes in enumerate(panels):
        points = next(line for line in axes.lines if line.get_marker() == "o")
        np.testing.assert_array_equal(points.get_xdata(), assessment.inputs.target.means[:, column])
        np.testing.assert_array_equal(points.get_ydata(), assessment.inputs.proxy.means[:, column])
        assert sorted(text.get_text() for text in axes.texts) == sorted(assessment.inputs.agents)


@pytest.mark.parametrize("agents", [6, MOST])
def test_no_two_names_overlap_and_none_is_cut_at_85_millimetres(agents):
    values = np.round(np.random.default_rng(1).normal(size=(agents, 3, 2)), 1)
    values[: agents // 2] = 1.0
    names = tuple(f"policy_number_{i}" for i in range(agents))
    both = ScoreTable(names, ("0", "1", "2"), ("distance", "time"), values)
    figure = scatter(assess(proxy=both, target=both, metrics=M, resamples=20))
    assert figure.get_figwidth() * 25.4 == pytest.approx(85.0)
    figure.draw_without_rendering()
    for axes in figure.axes:
        heights = sorted(text.get_position()[1] * axes.bbox.height for text in axes.texts)
        assert np.diff(heights).min() * 72.0 / figure.dpi > max(text.get_fontsize() for text in axes.texts)
        assert max(text.get_window_extent().x1 for text in axes.texts) <= figure.bbox.x1


def test_names_are_in_the_proxys_order_each_tied_to_its_point(assessment):
    axes = scatter(assessment).axes[0]
    means = assessment.inputs.proxy.means[:, 0]
    top_down = sorted(axes.texts, key=lambda text: -text.get_position()[1])
    assert [text.get_text() for text in top_down] == [f"A{row}" for row in np.argsort(-means)]
    for text in axes.texts:
        row = int(text.get_text()[1:])
        assert text.xy == (assessment.inputs.target.means[row, 0], means[row])


def test_of_many_agents_those_are_named_whose_rank_differs_most():
    scores = np.arange(40.0)[:, None, None]
    moved = scores.copy()
    moved[[3, 36]] = scores[[36, 3]]
    names = tuple(f"module.of.some.package:agent{row}" for row in range(40))
    tables = [ScoreTable(names, ("0",), ("distance",), values) for values in (scores, moved)]
    (axes,) = scatter(assess(proxy=tables[0], target=tables[1], metrics=M[:1])).axes
    named = [text.get_text() for text in axes.texts]
    assert len(named) == MOST
    assert {name.rsplit(":", 1)[1] for name in named} >= {"agent3", "agent36"}
    assert max(map(len, named)) == LONGEST


def test_error_bars_are_standard_errors(assessment):
    axes = scatter(assessment).axes[0]
    bars = axes.collections[0].get_segments()
    values = assessment.inputs.target.values[0, :, 0]
    half = np.ptp(bars[0][:, 0]) / 2
    assert half == pytest.approx(values.std(ddof=1) / np.sqrt(len(values)))


def test_the_map_colours_each_pair_once_and_counts_them(assessment):
    axes = flipped_pairs(assessment.prpv).axes[0]
    cells = np.asarray(axes.collections[0].get_array().filled(np.nan))
    kinds = list(FLIP_COLOURS)
    drawn = {kind: int((cells == number).sum()) for number, kind in enumerate(kinds)}
    for kind in kinds[1:]:
        assert drawn[kind] == sum(pair.flip == kind for pair in assessment.prpv.pairs)
    assert len(assessment.prpv.pairs) > 3
    assert sum(drawn.values()) == 15
    assert np.isnan(cells[np.triu_indices(6)]).all()
    assert [text.get_text() for text in axes.get_legend().get_texts()] == [f"{k}: {n}" for k, n in drawn.items()]


def test_pairs_of_more_agents_than_can_be_named_are_a_picture_over_ranks_of_the_same_width():
    found = assess(proxy=table(4, agents=300), target=table(5, agents=300), metrics=M, resamples=2)
    few, many = (flipped_pairs(one.prpv) for one in (assess(proxy=table(4), target=table(5), metrics=M), found))
    assert few.get_figwidth() == many.get_figwidth()
    assert few.get_figwidth() * 25.4 == pytest.approx(85.0)
    (picture,) = many.axes[0].images
    reversed_ = list(FLIP_COLOURS).index("reversed")
    assert (picture.get_array() == reversed_).sum() == sum(pair.flip == "reversed" for pair in found.prpv.pairs) > 0
    many.draw_without_rendering()
    assert not any("A" in label.get_text() for label in many.axes[0].get_yticklabels())


def test_constant_scores_and_two_agents_are_drawn_too(tmp_path):
    flat = ScoreTable(("A", "B"), ("1",), ("distance", "time"), np.ones((2, 1, 2)))
    found = assess(proxy=flat, target=flat, metrics=M)
    assert scatter(found).axes[0].get_title() == "SRCC undefined"
    for name, figure in (("one", scatter(found)), ("two", flipped_pairs(found.prpv))):
        save(figure, tmp_path / "new" / f"{name}.png")
        assert (tmp_path / "new" / f"{name}.png").read_bytes().startswith(b"\x89PNG")


def test_a_figure_that_cannot_be_written_leaves_nothing_behind(assessment, tmp_path):
    (tmp_path / "map.png").mkdir()
    with pytest.raises(RunError, match=r"map\.png: the figure cannot be written"):
        save(flipped_pairs(assessment.prpv), tmp_path / "map.png")
    assert [path.name for path in tmp_path.iterdir()] == ["map.png"]
