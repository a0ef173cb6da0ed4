"""Learning curves, their process, those drawn, and intervals of PLV that hold the truth as often as they say."""

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from sklearn.gaussian_process.kernels import Matern

from proxytune.errors import InputError
from proxytune.learning import AdaptiveDesign, LearningCurve, doublings
from proxytune.learning.curve_model import Examined, _matern, counts_at, crossing, draw_curves, fit_curve_model
from proxytune.learning.plv import curves_of, first_examinations, next_examinations, sample_needs, teaching_value

GRID = (0, 50, 100, 200, 400, 800, 1600, 3200)
STARTS, BEST, NONE, TOLERANCE = 10, 60.0, "none", 5.0
PROXIES = 4


class MadeUpLearners:
    """A learner without a proxy and four with one, each with a rise, a zero-shot score and perhaps a dip of its own."""

    def __init__(self, seed):
        generator = np.random.default_rng(seed)
        self.seed = seed
        self.names = [NONE, *(f"proxy {number}" for number in range(1, PROXIES + 1))]
        self.top = generator.uniform(0.72, 0.97)
        self.shapes = {name: self._shape(generator, name == NONE) for name in self.names}
        self.shared, self.own = generator.uniform(0.1, 0.6), generator.uniform(0.2, 0.7)

    def score(self, name, repetition, samples):
        """Of one examination; NaN where nothing has been learnt."""
        if name == NONE and not samples:
            return np.nan
        number = self.names.index(name)
        moved = self.shared * np.random.default_rng([self.seed, repetition]).normal()
        moved += self.own * np.random.default_rng([self.seed, repetition, number + 1]).normal()
        generator = np.random.default_rng([self.seed, repetition, number + 1, samples])
        stays = generator.random(STARTS) < self._chance(name, float(samples), moved)
        return float(np.where(stays, BEST, generator.uniform(0.0, BEST / 2.0, STARTS)).mean())

    def needed(self, name):
        """η, from the mean over endlessly many repetitions; infinite where it is not reached."""
        counts = np.concatenate(([0.0], np.geomspace(1.0, GRID[-1], 800)))
        mean = self._mean(name, counts)
        if name == NONE:
            mean[counts < GRID[1]] = -BEST
        below = np.flatnonzero(mean < self._mean(NONE, np.array([float(GRID[-1])]))[0] - TOLERANCE)
        after = below[-1] + 1 if len(below) else 0
        return counts[after] if after < len(counts) else np.inf

    def curves(self, repetitions):
        """All examinations of the grid."""
        return {
            name: LearningCurve(GRID, np.array([[self.score(name, r, n) for n in GRID] for r in range(repetitions)]))
            for name in self.names
        }

    def _mean(self, name, counts):
        moved = np.hypot(self.shared, self.own) * np.random.default_rng(0).normal(size=2000)
        chance = self._chance(name, counts, moved[:, None]).mean(axis=0)
        return BEST * (chance + (1.0 - chance) / 4.0)

    def _chance(self, name, samples, moved):
        rise, slope, zero, depth, dip = self.shapes[name]
        place = np.log2(np.maximum(samples, 1e-9))
        risen = 1.0 / (1.0 + np.exp(-(place - rise - moved) / slope))
        first = zero * self.top
        dipped = 2.0 * first * depth * np.exp(-0.5 * (place - dip - 0.5 * moved) ** 2)
        return np.clip(first + (self.top - first) * risen - dipped, 0.01, 0.995)

    @staticmethod
    def _shape(generator, alone):
        rise = generator.uniform(8.0 if alone else 5.5, 10.2)
        slope = generator.uniform(0.35, 0.9)
        zero = 0.02 if alone else generator.uniform(0.02, 0.85)
        depth = 0.0 if alone or generator.random() < 0.5 else generator.uniform(0.0, 0.35)
        return rise, slope, zero, depth, generator.uniform(5.0, 7.0)


def test_mean_curves_are_as_smooth_as_matern_with_5_2_and_examinations_are_counted():
    apart = np.linspace(0.0, 9.0, 20)
    np.testing.assert_allclose(_matern(apart, 2.0), Matern(2.0, nu=2.5)(apart[:, None], [[0.0]])[:, 0])
    curve = LearningCurve((0, 100, 200), np.array([[NAN, 1.0, NAN], [NAN, NAN, NAN], [2.0, 3.0, NAN]]))
    assert curve.examined.tolist() == [[0, 1], [2, 0], [2, 1]]
    assert curve.repetitions == 2


REPETITIONS = 8
CLASSROOMS = 15
WHOLE = 5 * REPETITIONS * len(GRID)
"""Examinations of the whole grid."""


def needs_of(curves, draws=2000):
    return sample_needs(curves, best_score=BEST, tolerance=TOLERANCE, draws=draws)


def spend(learners, examinations):
    """The curves after so many examinations that were chosen."""
    spending, scores = AdaptiveDesign(GRID, REPETITIONS, 12), {}
    batch = first_examinations(learners.names, spending)
    while True:
        for one in batch[: examinations - len(scores)]:
            scores[one] = learners.score(one.curve, one.repetition, one.samples)
        curves = curves_of(GRID, scores)
        if len(scores) >= examinations:
            return curves
        batch = next_examinations(needs_of(curves, 500), learners.names, spending)


def judged(learners, curves):
    """Of every proxy: whether the interval of its PLV holds the truth, and how wide it is."""
    needs, alone = needs_of(curves), learners.needed(NONE)
    found = []
    for name in learners.names[1:]:
        plv = teaching_value(needs, name).plv
        low, high = -np.inf if plv.low is None else plv.low, np.inf if plv.high is None else plv.high
        truth = alone - learners.needed(name)
        # Where η is not reached, PLV is known to lie below what the largest count leaves.
        holds = low <= truth <= high if np.isfinite(truth) else plv.low is None and high >= alone - GRID[-1]
        found.append((holds, high - low))
    return found


def grid_width(curves, name, resamples=300):
    """How wide the interval is that the smallest count of the grid and a bootstrap over repetitions give."""
    rows = np.random.default_rng(0).integers(0, REPETITIONS, (resamples, REPETITIONS))
    least = [curves[one].scores[rows].mean(axis=1) for one in (NONE, name)]
    threshold = curves[NONE].scores[:, -1].mean() - TOLERANCE
    below = [~(mean >= threshold) for mean in least]
    first = [np.where(one.any(axis=1), len(GRID) - np.argmax(one[:, ::-1], axis=1), 0) for one in below]
    alone, taught = (np.array([*GRID, np.inf])[places] for places in first)
    saved = np.sort(alone[known := np.isfinite(alone)] - taught[known])
    return saved[round(0.975 * (len(saved) - 1))] - saved[round(0.025 * (len(saved) - 1))]


@pytest.mark.slow
def test_intervals_hold_the_truth_in_nine_of_ten_of_60_proxies_and_a_third_of_the_grid_is_sharper_than_a_bootstrap():
    chosen, whole, bootstrap = [], [], []
    for seed in range(CLASSROOMS):
        learners = MadeUpLearners(seed)
        chosen += judged(learners, spend(learners, WHOLE // 3))
        if seed < 12:
            curves = learners.curves(REPETITIONS)
            whole += judged(learners, curves)
            bootstrap += [grid_width(curves, name) for name in learners.names[1:]]
    assert len(chosen) == 60
    assert np.mean([holds for holds, _ in chosen]) >= 0.9
    assert np.mean([holds for holds, _ in whole]) >= 0.9
    third, all_of_it = (np.median([width for _, width in found]) for found in (chosen[: len(whole)], whole))
    assert all_of_it < third < 0.75 * np.median(bootstrap)


ROUNDS = 6
AT = np.array([0.0, 1.0, 2.0, 3.0, 4.0, 5.0])


def marks(noise, curves=2, seed=0):
    """Curve 0 rises from 10 to 50, curve 1 is 30 everywhere; `noise` is that of each place."""
    generator = np.random.default_rng(seed)
    rows = [(c, r, p) for c in range(curves) for r in range(ROUNDS) for p in range(len(AT))]
    curve, repetition, place = np.array(rows).T
    mean = np.where(curve == 0, 10.0 + 40.0 / (1.0 + np.exp(-2.0 * (AT[place] - 2.5))), 30.0)
    return Examined(curve, repetition, AT[place], mean + np.asarray(noise)[place] * generator.normal(size=len(rows)))


def test_no_samples_the_first_count_and_each_doubling_are_about_one_apart_and_turn_back_into_counts():
    counts = np.array([0.0, 50.0, 100.0, 3200.0])
    assert doublings(counts, 50.0)[:2].tolist() == [0.0, 1.0]
    assert doublings(np.array([3200.0, 6400.0]), 50.0) == pytest.approx([6.02, 7.01], abs=0.01)
    assert counts_at(doublings(counts, 50.0), 50.0) == pytest.approx(counts)


def test_scores_are_surer_where_they_are_and_differ_more_where_they_do():
    model = fit_curve_model(marks(np.full(6, 2.0)))
    mean, covariance = model.mean_curves(np.array([0, 0, 1]), np.array([0.0, 5.0, 2.5]))
    assert mean == pytest.approx([10.3, 49.7, 30.0], abs=2.5)
    assert np.sqrt(np.diag(covariance)).max() < 2.0
    _, far = model.mean_curves(np.array([0]), np.array([9.0]))
    assert far[0, 0] > 4.0 * covariance.diagonal().max()
    model = fit_curve_model(marks([0.5, 0.5, 8.0, 8.0, 0.5, 0.5]))
    quiet, loud = model.noise_at(np.array([0, 0]), np.array([0.0, 2.5]))
    assert loud > 4.0 * quiet


def test_what_a_repetition_does_to_every_learner_is_no_noise_that_more_curves_average_out():
    generator = np.random.default_rng(3)
    plain = marks(np.full(6, 0.5), curves=2)
    together = plain.score + 6.0 * generator.normal(size=6)[plain.repetition]
    models = [fit_curve_model(one) for one in (plain, Examined(plain.curve, plain.repetition, plain.place, together))]
    before, after = (float(one.mean_curves(np.array([1]), np.array([2.5]))[1][0, 0]) for one in models)
    assert np.sqrt(after) > 1.5 > np.sqrt(before)


def test_what_every_learner_learns_alike_is_a_rise_of_all_curves_and_no_repetition_s_doing():
    scores = np.random.default_rng(4).normal(scale=1.0, size=(10, len(STEPS))) + (0.0, 1.4, 2.1, 3.2, 3.5)
    curves = {name: LearningCurve(STEPS, scores) for name in ("none", "one", "two")}
    drawn = draw_curves(curves, (-10.0, 10.0))
    for one in drawn.scores.values():
        assert one.mean(axis=0)[[0, -1]] == pytest.approx(scores.mean(axis=0)[[0, -1]], abs=0.7)


@pytest.mark.parametrize("score", [0.0, 60.0])
def test_scores_that_are_all_the_same_are_fitted_without_complaint(score):
    rows = marks(np.zeros(6))
    model = fit_curve_model(Examined(rows.curve, rows.repetition, rows.place, np.full(len(rows.score), score)))
    mean, covariance = model.mean_curves(np.array([0, 1]), np.array([1.0, 2.5]))
    assert mean == pytest.approx([score, score])
    assert np.isfinite(covariance).all()


def test_one_repetition_leaves_the_mean_curves_near_their_scores():
    scores = np.array(
        [
            [50.2, 50.2, 54.2, 57.4, 56.4, 57.7, 58.7],
            [57.6, 55.7, 56.6, 58.1, 57.1, 57.9, 58.8],
            [-58.6, 8.9, 21.9, 34.8, 44.8, 51.8, 55.5],
            [51.3, 52.7, 54.1, 56.8, 57.2, 58.0, 58.9],
        ]
    )
    curve, at = np.indices(scores.shape).reshape(2, -1)
    model = fit_curve_model(Examined(curve, np.zeros(scores.size, dtype=int), at.astype(float), scores.ravel()))
    means, covariance = model.mean_curves(np.array([1, 2]), np.array([1.0, 1.0]))
    assert means[0] - means[1] > 20.0
    assert np.sqrt(np.diag(covariance)).min() > 2.0


NAN = np.nan


@pytest.mark.parametrize(
    ("counts", "scores", "says"),
    [
        ((100, 200), np.zeros((2, 2)), "add 0"),
        ((0, 200, 200), np.zeros((2, 3)), "must rise"),
        ((0, 200), np.zeros((2, 3)), "shape"),
        ((), np.zeros((2, 0)), "add 0"),
    ],
)
def test_a_curve_that_is_none_is_refused(counts, scores, says):
    with pytest.raises(InputError, match=says):
        LearningCurve(counts, scores)


STEPS = (0, 100, 200, 400, 800)
COUNTS = np.array([0.0, 100.0, 200.0, 400.0])


def curve(*means, wobble=1.0, seeds=6):
    noise = wobble * np.random.default_rng(2).normal(size=(seeds, len(STEPS)))
    return LearningCurve(STEPS, np.array(means, dtype=float) + noise)


def crossed(*scores, threshold=45.0):
    return float(crossing(COUNTS, np.array([scores], dtype=float), np.array([threshold]), first=100.0)[0])


def test_samples_are_needed_up_to_where_a_curve_stays_above_the_threshold():
    assert crossed(0, 20, 40, 50) == 300.0
    assert crossed(0, 46, 30, 60) == 300.0
    assert crossed(45, 45, 45, 45) == 0.0
    assert crossed(0, 45, 50, 50) == 100.0
    assert crossed(0, 10, 20, 44.9) == np.inf
    assert crossed(50, 50, 50, 44.9) == np.inf
    assert crossed(np.nan, 50, 50, 50) == 100.0
    scores = np.array([[np.nan, np.nan, 50.0, 50.0], [np.nan, np.nan, 40.0, 50.0]])
    needed = crossing(np.array([0.0, 60.0, 120.0, 200.0]), scores, np.array([45.0, 45.0]), first=100.0)
    assert needed.tolist() == [100.0, 160.0]


@settings(max_examples=100)
@given(st.lists(st.floats(-60, 60), min_size=4, max_size=4), st.floats(0, 60))
def test_better_scores_never_need_more_samples(scores, more):
    assert crossed(*(np.array(scores) + more)) <= crossed(*scores) + 1e-9


def test_draws_keep_within_the_scores_there_can_be_and_before_any_learning_nothing_is_drawn():
    drawn = draw_curves({"high": curve(50, 58, 60, 60, 60, wobble=4.0)}, (-60.0, 60.0)).scores["high"]
    assert drawn.max() <= 60.0 + 1e-9
    assert drawn.shape[0] == 2000
    draws = draw_curves({"none": curve(np.nan, 10, 20, 50, 50)}, (-60.0, 60.0))
    early = draws.counts < 99.9
    assert np.isnan(draws.scores["none"][:, early]).all()
    assert np.isfinite(draws.scores["none"][:, ~early]).all()


def test_mean_curves_go_where_scores_are_and_fall_only_beyond_noise():
    draws = draw_curves({"rising": curve(10, 20, 40, 50, 50), "dipping": curve(40, 10, 20, 45, 50)}, (-60.0, 60.0))
    assert draws.monotone == {"rising": True, "dipping": False}
    assert (np.diff(draws.scores["rising"], axis=1) >= -1e-9).all()
    assert np.mean(draws.scores["dipping"], axis=0).min() < 20.0
    assert draw_curves({"noisy": curve(30, 29, 31, 30, 30, wobble=6.0)}, (-60.0, 60.0)).monotone["noisy"]
    draws = draw_curves({"steep": curve(0, 10, 20, 50, 50, wobble=0.3)}, (-60.0, 60.0))
    ends = [float(draws.scores["steep"][:, place].mean()) for place in (0, -1)]
    assert ends == pytest.approx([0.0, 50.0], abs=1.0)
