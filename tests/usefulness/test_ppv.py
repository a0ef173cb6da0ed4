"""PPV weighs how far the scores are off."""

import pytest

from proxytune.errors import InputError
from proxytune.scores import Metric, ScoreTable
from proxytune.usefulness import ppv

M = [Metric("m"), Metric("n")]


def table(rows):
    return ScoreTable.from_episodes({(a, 1): {"m": m, "n": n} for a, (m, n) in zip("ABC", rows, strict=True)})


TARGET = table([(1.0, 10.0), (2.0, 20.0), (3.0, 30.0)])


def test_given_weights_by_hand():
    proxy = table([(2.0, 10.0), (2.0, 20.0), (1.0, 36.0)])
    result = ppv(proxy=proxy, target=TARGET, metrics=M, beta={"m": 1.0, "n": 0.5})
    assert result.value == pytest.approx((1 + 0 + 2 + 0.5 * 6) / 3)
    assert result.better == "lower"


def test_without_weights_a_metric_counts_in_its_spread_on_the_target():
    proxy = table([(2.0, 20.0), (3.0, 30.0), (4.0, 40.0)])
    result = ppv(proxy=proxy, target=TARGET, metrics=M)
    assert result.beta == {"m": pytest.approx(1.0), "n": pytest.approx(0.1)}
    assert result.value == pytest.approx(2.0)


def test_identical_tables_are_foretold_exactly():
    assert ppv(proxy=TARGET, target=TARGET, metrics=M).value == 0.0


def test_the_unit_of_a_metric_does_not_matter_without_weights():
    proxy = table([(2.0, 10.0), (2.0, 20.0), (1.0, 36.0)])
    scaled = [table([(1000 * m, n) for m, n in side.means.tolist()]) for side in (proxy, TARGET)]
    assert ppv(proxy=scaled[0], target=scaled[1], metrics=M).value == pytest.approx(
        ppv(proxy=proxy, target=TARGET, metrics=M).value
    )


def test_a_metric_constant_on_the_target_is_left_out_and_said_so():
    flat = table([(1.0, 5.0), (2.0, 5.0), (3.0, 5.0)])
    result = ppv(proxy=TARGET, target=flat, metrics=M)
    assert (result.value, result.beta["n"]) == (0.0, None)
    assert "n: left out of PPV" in result.notes[0]
    assert ppv(proxy=TARGET, target=flat, metrics=[Metric("n")]).value is None


@pytest.mark.parametrize(
    "beta", [{"m": 1.0}, {"m": 1.0, "n": -1.0}, {"m": 1.0, "n": float("nan")}, {"m": 1.0, "k": 1.0}]
)
def test_weights_that_do_not_fit_are_refused(beta):
    with pytest.raises(InputError, match="weight"):
        ppv(proxy=TARGET, target=TARGET, metrics=M, beta=beta)
