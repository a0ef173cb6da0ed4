"""Every measure tells where it is read, and can be evaluated on means alone where it is one number."""

import numpy as np
import pytest
from score_tables import ordered, table_of

from proxytune.errors import InputError
from proxytune.scores import Metric
from proxytune.sweep import METRICS
from proxytune.testing.extension import check_measure
from proxytune.usefulness import ALL, MEASURES, PODS, PPV, PRPV, SRCC, Measure, assess

M = (Metric("m"), Metric("n", "min", 0.1))


def bias(proxy, target, metrics):
    """How much the proxy flatters, per metric."""
    return (proxy - target).mean(axis=-2)


def largest(proxy, target, metrics):
    """The largest bias; undefined where the first agent scores nothing."""
    return np.where(proxy[..., 0, 0] == 0.0, np.nan, bias(proxy, target, metrics).max(axis=-1))


BIAS = Measure("bias", "bias", "mean error", "lower", "in the metric's unit", ".2f", per_metric=True, on_means=bias)
LARGEST = Measure("largest", "largest bias", "largest mean error", "lower", "any", ".2f", on_means=largest)
FOUND = assess(proxy=ordered(1), target=ordered(2), metrics=M)


@pytest.mark.parametrize("measure", MEASURES, ids=lambda measure: measure.key)
def test_every_measure_keeps_what_measures_promise_and_knows_a_perfect_proxy(measure):
    check_measure(measure, perfect=0.0 if measure.lower_is_better else 1.0)


@pytest.mark.parametrize("measure", [*MEASURES, BIAS, LARGEST], ids=lambda measure: measure.key)
def test_every_measure_has_a_value_within_its_interval_for_each_metric_or_all_and_none_without_repeats(measure):
    found = measure.measured(FOUND)
    assert list(found) == (["m", "n"] if measure.per_metric else [ALL])
    for value, (low, high) in found.values():
        assert low <= value <= high
    found = measure.measured(assess(proxy=ordered(1, 1), target=ordered(2, 1), metrics=M))
    assert [one.interval for one in found.values()] == [None] * len(found)
    assert None not in [one.value for one in found.values()]


def test_a_measure_of_means_is_resampled_as_the_others_are_and_undefined_is_none():
    """What is declared by its function alone comes out as what PPV has of its own."""
    again = Measure("again", "again", "PPV of fixed weights", "lower", "", ".3g", on_means=weighted_as_before)
    (found,), (known,) = again.measured(FOUND).values(), PPV.measured(FOUND).values()
    assert found.value == pytest.approx(known.value, rel=1e-12)
    assert found.interval == pytest.approx(known.interval, rel=1e-12)
    values = ordered(1).values.copy()
    values[0] = 0.0
    assert LARGEST.measured(assess(proxy=table_of(values), target=ordered(2), metrics=M)) == {ALL: (None, None)}
    assert np.isnan(PPV.of_means(proxy=np.eye(3), target=np.ones((3, 3)), metrics=M))


def weighted_as_before(proxy, target, metrics):
    weights = np.array([FOUND.ppv.beta[metric.name] for metric in metrics])
    return (np.abs(proxy - target) * weights).sum(axis=-1).mean(axis=-1)


@pytest.mark.parametrize("measure", [PRPV, PPV])
@pytest.mark.parametrize("seed", range(5))
def test_on_means_alone_a_measure_is_what_is_reported(measure, seed):
    found = assess(proxy=ordered(seed), target=ordered(seed + 100), metrics=M)
    proxy, target = found.inputs.means
    assert measure.of_means(proxy=proxy, target=target, metrics=M) == measure.measured(found)[ALL].value


@pytest.mark.parametrize("measure", [SRCC, BIAS, *PODS], ids=lambda measure: measure.key)
def test_what_is_no_single_number_of_mean_scores_is_refused_as_one(measure):
    with pytest.raises(InputError, match=f"{measure.name} is no single number of mean scores; take a measure that is"):
        measure.of_means(proxy=np.eye(2), target=np.eye(2), metrics=M)


def test_every_measure_has_a_key_of_its_own_and_pod_the_unit_that_a_sweep_measures_it_in():
    keys = [measure.key for measure in (*MEASURES, *PODS)]
    assert len(set(keys)) == len(keys)
    assert {measure.key: measure.unit for measure in PODS} == METRICS
