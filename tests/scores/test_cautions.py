"""What is allowed in score tables and probably not meant is told in a sentence; a poor proxy draws none."""

import re

import numpy as np
import pytest

from proxytune.scores import Metric, ScoreTable, score_cautions

METRICS = (Metric("distance"), Metric("survival_time"))
RANDOM = np.random.default_rng(3)
AGENTS = tuple(f"agent{number}" for number in range(8))
LEVEL = np.arange(8)[:, None]
TRUE = np.stack(
    [
        np.maximum(0.05, 0.3 * LEVEL + 0.1 * RANDOM.normal(size=(8, 6))),
        np.clip(5.0 + 9.0 * LEVEL + 4.0 * RANDOM.normal(size=(8, 6)), 0.5, 60.0),
    ],
    axis=-1,
)
PROXY = TRUE * (1.0 + 0.15 * RANDOM.normal(size=TRUE.shape))
PROXY[..., 1] = np.clip(PROXY[..., 1], 0.1, 60.0)


def table(values, agents=AGENTS, episodes=None):
    labels = episodes or tuple(map(str, range(values.shape[1])))
    return ScoreTable(agents, labels, ("distance", "survival_time"), values)


def cautions(proxy, target, metrics=METRICS):
    return score_cautions(proxy=proxy, target=target, metrics=metrics)


def scaled(values, distance=1.0, time=1.0):
    return values * (distance, time)


SHORT = np.stack((TRUE[..., 0] * np.minimum(1.0, 6.0 / TRUE[..., 1]), np.minimum(6.0, TRUE[..., 1])), axis=-1)
TIED = tuple(Metric(metric.name, tolerance=1e6) for metric in METRICS)
CASES = {
    "a proxy of 6 s": (table(SHORT), table(TRUE), METRICS, r"up to 6 in the proxy and up to 60 on the target"),
    "times in ms": (table(PROXY), table(scaled(TRUE, 1, 1e3)), METRICS, r"survival_time in the target are 99\d"),
    "a tenfold proxy": (table(scaled(PROXY, 10)), table(TRUE), METRICS, r"distance in the proxy are \d.* times"),
    "far too much": (table(PROXY), table(scaled(TRUE, 1e60)), METRICS, r"distance in the target are .*e\+60 times"),
    "negative times": (table(scaled(PROXY, 1, -1)), table(TRUE), METRICS, r"survival_time of the proxy is below zero"),
    "a proxy of three agents with the other sign": (
        table(scaled(PROXY[:3], -1), AGENTS[:3]),
        table(TRUE[:3], AGENTS[:3]),
        METRICS,
        r"distance are below zero in the proxy and above it on the target",
    ),
    "one table twice": (table(TRUE), table(TRUE), METRICS, r"the target's scores to the last digit"),
    "a letter that is not seen": (
        table(PROXY, ("agent\u200b1", *AGENTS[1:])),
        table(TRUE),
        METRICS,
        r"agents 'agent\\u200b1' and 'agent1' read",
    ),
    "no pair left": (table(PROXY), table(TRUE), TIED, r"tolerance of distance, 1e\+06, leaves no two agents of"),
    "copies": (table(PROXY), table(np.repeat(TRUE, 3, axis=1)), METRICS, r"of 144 episodes of the target only 48"),
    "an é in two forms": (
        table(PROXY, ("\u00e9", *AGENTS[1:])),
        table(TRUE, ("\u00e9", "e\u0301", *AGENTS[2:])),
        METRICS,
        r"agents '\\xe9' and 'e\\u0301' read the same and are taken for different",
    ),
    "0 and 0.0": (
        table(PROXY),
        table(TRUE, episodes=tuple(f"{number}.0" for number in range(6))),
        METRICS,
        r"episodes '0' and '0.0' \(and 5 more pairs\) read the same",
    ),
}


@pytest.mark.parametrize(("proxy", "target", "metrics", "expected"), CASES.values(), ids=CASES)
def test_what_is_probably_not_meant_is_told_in_a_sentence(proxy, target, metrics, expected):
    assert any(re.search(expected, line) for line in cautions(proxy, target, metrics))


def test_poor_or_coarse_scores_draw_no_caution():
    assert cautions(table(PROXY), table(TRUE)) == ()
    shuffled = RANDOM.permutation(PROXY) * RANDOM.lognormal(0.0, 1.0, (8, 1, 1))
    shuffled[..., 1] = np.minimum(shuffled[..., 1], 60.0)
    assert cautions(table(shuffled), table(TRUE)) == ()
    hits, few = (RANDOM.random((8, 6, 2)) < share for share in (0.9, 0.05))
    successes = (Metric("success"), Metric("lift"))
    one, other = (ScoreTable(AGENTS, tuple("012345"), ("success", "lift"), hit.astype(float)) for hit in (hits, few))
    assert score_cautions(proxy=one, target=other, metrics=successes) == ()
