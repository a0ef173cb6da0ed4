"""START/REPEAT: repeats of a start are no other starts, for the bootstrap and for splits alike."""

import numpy as np
import pytest

from proxytune.scores import Metric, ScoreTable
from proxytune.usefulness import assess, bootstrap_prpv, compare
from proxytune.usefulness.repeats import by_start, is_repeated, split_repeats, start_of, start_places, starts_of
from proxytune.usefulness.resampling import bootstrap_means, draw_counts

M = (Metric("m"),)


def table(values, labels):
    return ScoreTable(tuple(f"A{i}" for i in range(len(values))), tuple(labels), ("m",), np.array(values)[:, :, None])


def split(scores, splits):
    keys = np.random.default_rng(0).random((splits, len(scores.episodes)))
    return split_repeats(scores.driven, start_places(scores), keys)


def labelled(starts, repeats):
    return [f"{start}/{repeat}" for start in range(starts) for repeat in range(repeats)]


def test_the_start_is_what_is_before_the_last_stroke():
    assert [start_of(label) for label in ("3", "3/0", "loop/3/1", "/1")] == ["3", "3", "loop/3", "/1"]
    assert starts_of(["1/0", "0/0", "1/1"]) == ("1", "0")


def test_both_sets_hold_every_start_equally_often_and_share_no_episode():
    values = np.zeros((3, 9))
    values[0, 4] = np.nan
    first, second = split(table(values, labelled(3, 3)), 40)
    assert not (first & second).any()
    assert not first[0, :, 4].any()
    assert not second[0, :, 4].any()
    for one in (first, second):
        assert (one.reshape(3, 40, 3, 3).sum(axis=-1) == 1).all()
    assert (first[1] == first[2]).all()
    assert len(np.unique(first[1], axis=0)) > 5


def test_an_agent_that_lost_a_repeat_is_split_over_its_other_starts():
    values = np.zeros((2, 4))
    values[0, 3] = np.nan
    first, second = split(table(values, labelled(2, 2)), 10)
    assert (first[0] ^ second[0] == [True, True, False, False]).all()
    assert (first[1] ^ second[1]).all()


@pytest.mark.parametrize(
    ("labels", "expected"),
    [
        (labelled(2, 2), True),
        (["0", "1", "2", "3"], False),
        (["0/0", "0/1", "1/0", "2/0"], False),
        (["0/0", "0/1", "1", "1/0"], True),
    ],
)
def test_repeats_are_there_only_where_every_start_has_two(labels, expected):
    assert is_repeated(table(np.zeros((2, 4)), labels)) is expected


def test_labels_of_an_agent_s_own_are_no_starts():
    values = [[0.0, 0.0, np.nan, np.nan], [np.nan, np.nan, 0.0, 0.0]]
    assert not is_repeated(table(values, ["A0/0", "A0/1", "A1/0", "A1/1"]))


def test_an_agent_without_any_start_twice_leaves_nothing_to_split():
    values = [[0.0, np.nan, 0.0, np.nan], [0.0] * 4]
    assert not is_repeated(table(values, labelled(2, 2)))


def test_by_start_takes_the_mean_over_the_repeats_that_were_driven():
    found = by_start(table([[1.0, 3.0, np.nan, 5.0], [1.0, 1.0, np.nan, np.nan]], labelled(2, 2)))
    assert found.episodes == ("0", "1")
    np.testing.assert_array_equal(found.values[:, :, 0], [[2.0, 5.0], [1.0, np.nan]])


def test_repeats_of_a_start_are_drawn_together_and_plain_episodes_as_ever():
    repeated, plain = table(np.zeros((2, 6)), labelled(3, 2)), table(np.zeros((2, 3)), "012")
    counts = draw_counts(repeated, np.random.default_rng(0), 30)
    assert (counts[..., ::2] == counts[..., 1::2]).all()
    np.testing.assert_array_equal(counts[..., ::2], draw_counts(plain, np.random.default_rng(0), 30))


def test_of_one_start_alone_the_repeats_are_drawn_and_that_is_said():
    values = np.random.default_rng(0).normal(size=(4, 6))
    counts = draw_counts(table(values, labelled(1, 6)), np.random.default_rng(0), 30)
    assert len(np.unique(counts[0], axis=0)) > 10
    assert not compare(
        proxy=table(values[:, :3], labelled(1, 3)), target=table(values, labelled(1, 6)), metrics=M
    ).paired
    found = assess(proxy=table(values, "abcdef"), target=table(values, labelled(1, 6)), metrics=M)
    assert any("from one start" in note for note in found.notes)


def test_a_proxy_of_plain_starts_is_paired_with_a_target_of_repeats_by_start():
    """Scores that depend on the start alone stay equal in every resample, in whatever order the starts come."""
    starts = np.random.default_rng(0).normal(size=(1, 5)).repeat(3, axis=0)
    target = table(starts.repeat(2, axis=1), labelled(5, 2))
    inputs = compare(proxy=table(starts[:, ::-1], "43210"), target=target, metrics=M)
    assert inputs.paired
    means = bootstrap_means(inputs, resamples=50, seed=1)
    np.testing.assert_allclose(means[0], means[1], atol=1e-12)
    assert np.ptp(means[0], axis=0).min() > 0.0
    assert not compare(proxy=table(starts, "abcde"), target=target, metrics=M).paired


def test_more_repeats_of_the_same_starts_make_no_interval_narrower():
    """Copies of every episode say nothing new."""
    rng = np.random.default_rng(3)
    starts, proxy = rng.normal(size=(8, 4)), table(rng.normal(size=(8, 6)), "abcdef")
    once = bootstrap_prpv(proxy=proxy, target=table(starts, "0123"), metrics=M)
    copied = bootstrap_prpv(proxy=proxy, target=table(starts.repeat(5, axis=1), labelled(4, 5)), metrics=M)
    assert (copied.low, copied.high) == (once.low, once.high)


def test_starts_and_not_repeats_are_counted_as_few():
    values = np.random.default_rng(0).normal(size=(4, 12))
    found = assess(proxy=table(values, labelled(3, 4)), target=table(values, labelled(3, 4)), metrics=M)
    assert any(note.startswith("only 3 starts per agent") for note in found.notes)
    loose = table(values, labelled(3, 4)).unpaired()
    assert not any("few" in note for note in assess(proxy=loose, target=loose, metrics=M).notes)
