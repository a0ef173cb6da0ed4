"""What every measure of usefulness promises."""

from collections.abc import Sequence

import numpy as np

from proxytune.scores import Array, Metric, ScoreTable
from proxytune.testing.claim import ask, claim
from proxytune.usefulness import Measure, assess
from proxytune.usefulness.measure import ALL, Measured

METRICS = (Metric("distance"), Metric("deviation", "min", 0.1))
AGENTS, EPISODES, TABLES = 5, 6, 8
ROUNDING = 1e-9


def check_measure(measure: Measure, *, perfect: float | None = None) -> None:
    """Refuse a measure that breaks a promise.

    Of mean scores it takes any number of proxies at once, against a target each or one for all, and gives each the
    value that it has alone, which is a number or NaN; the scores are left as they are. Of an assessment it gives a
    value for each metric or one for all, with an interval only where episodes are repeated.

    Args:
        measure: The measure.
        perfect: What it is where the proxy's scores are the target's, if nothing can be better.

    Raises:
        ConformanceError: With the promise that is broken.
    """
    claim(isinstance(measure, Measure), f"measure {measure!r} is a {type(measure).__name__}; make it a Measure")
    what = f"measure '{measure.key}'"
    told = measure.on_means is not None or measure.read is not None
    claim(told, f"{what} has neither on_means nor read; give one of them")
    if measure.on_means is not None:
        _check_means(measure, what)
    for episodes in (1, EPISODES):
        _check_assessment(measure, what, episodes)
    if perfect is not None:
        _check_perfect(measure, what, perfect)


def _means(seed: int) -> Array:
    """Mean scores of several tables (tables, agents, metrics)."""
    spread = np.random.default_rng(seed).normal(size=(TABLES, AGENTS, len(METRICS)))
    return np.asarray(spread + np.arange(AGENTS)[:, None])


def _of_means(measure: Measure, what: str, proxy: Array, target: Array) -> Array:
    assert measure.on_means is not None
    on_means, kept = measure.on_means, (proxy.copy(), target.copy())
    values = np.asarray(ask(what, lambda: on_means(proxy, target, METRICS)), dtype=float)
    same = np.array_equal(proxy, kept[0]) and np.array_equal(target, kept[1])
    claim(same, f"{what} changes the scores in place; make a new array")
    shape = (*proxy.shape[:-2], *((len(METRICS),) if measure.per_metric else ()))
    wanted = "(…, metrics)" if measure.per_metric else "(…)"
    line = f"gives values {values.shape} of means {proxy.shape}; give {wanted}, here {shape}"
    claim(values.shape == shape, f"{what} {line}")
    claim(not np.isinf(values).any(), f"{what} is infinite; give NaN where it is undefined")
    return values


def _check_means(measure: Measure, what: str) -> None:
    proxies, targets = _means(1), _means(2)
    for target in (targets, targets[0]):
        together = _of_means(measure, what, proxies, target)
        single = [target] * TABLES if target.ndim == 2 else list(target)
        alone = [_of_means(measure, what, one, its) for one, its in zip(proxies, single, strict=True)]
        same = np.allclose(together, np.array(alone), rtol=ROUNDING, atol=0.0, equal_nan=True)
        claim(same, f"{what} gives tables together other values than each alone; keep the leading axes apart")
    stacked = _of_means(measure, what, proxies.reshape(2, -1, *proxies.shape[1:]), targets[0])
    same = np.array_equal(stacked.reshape(together.shape), together, equal_nan=True)
    claim(same, f"{what} mixes the values of two leading axes; keep the leading axes apart")


def _table(seed: int, episodes: int) -> ScoreTable:
    values = (
        np.random.default_rng(seed).normal(size=(AGENTS, episodes, len(METRICS))) + np.arange(AGENTS)[:, None, None]
    )
    names = (tuple(f"agent{i}" for i in range(AGENTS)), tuple(map(str, range(episodes))))
    return ScoreTable(*names, tuple(metric.name for metric in METRICS), values)


def _measured(measure: Measure, what: str, proxy: ScoreTable, target: ScoreTable) -> Sequence[Measured]:
    found = ask(what, lambda: measure.measured(assess(proxy=proxy, target=target, metrics=METRICS)))
    names = [metric.name for metric in METRICS] if measure.per_metric else [ALL]
    claim(list(found) == names, f"{what} has values for {list(found)}; give them for {names}, in this order")
    return list(found.values())


def _check_assessment(measure: Measure, what: str, episodes: int) -> None:
    for one in _measured(measure, what, _table(1, episodes), _table(2, episodes)):
        finite = one.value is None or np.isfinite(one.value)
        claim(finite, f"{what} is {one.value}; give None where it is undefined")
        if episodes == 1:
            claim(one.interval is None, f"{what} has the interval {one.interval} of one episode; give None")
        elif one.interval is not None:
            low, high = one.interval
            claim(low <= high, f"{what} has the interval {one.interval}; give its lower end first")


def _check_perfect(measure: Measure, what: str, perfect: float) -> None:
    """It is so for a proxy with the target's scores, and no better for any other."""
    target = _table(2, EPISODES)
    for one in _measured(measure, what, target, target):
        close = one.value is not None and abs(one.value - perfect) <= ROUNDING
        claim(close, f"{what} is {one.value} where the proxy's scores are the target's; it must be {perfect:g}")
    for seed in range(10, 10 + TABLES):
        for one in _measured(measure, what, _table(seed, EPISODES), target):
            worse = one.value is None or (one.value - perfect) * (1.0 if measure.lower_is_better else -1.0) >= -ROUNDING
            claim(worse, f"{what} is {one.value}, better than {perfect:g} of a perfect proxy; check `better`")
