"""Proposals that were tried and dropped, against the default's, in paired seeds; compare.md has the table.

    python benchmarks/proposals.py analytic|ranking [VARIANT …] [--seeds N]
    python benchmarks/proposals.py STUDY

The first takes minutes per variant. The second tells which model predicts PRPV better, that of the score or that of the
metrics: every trial of a finished study is held out in turn and predicted from the others; nothing is simulated.
"""

import argparse
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from judgement import Judgement
from problems import METRICS, Analytic, Ranking
from runs import Run, RunKey, summarise
from scipy.linalg import solve_triangular
from scipy.stats import norm, spearmanr
from skopt.acquisition import gaussian_ei
from skopt.learning import GaussianProcessRegressor
from skopt.learning.gaussian_process.kernels import ConstantKernel, Matern, WhiteKernel

from proxytune.search import Surrogate, Trial, fit_surrogate, from_unit, unit_array, unit_points
from proxytune.search.engine import design_point
from proxytune.search.likelihood import fit_outputs
from proxytune.search.outcomes import composed_scores
from proxytune.search.surrogate import AMPLITUDE, LENGTH_SCALE, NOISE, GaussianProcess, maximise_gain, most_probable
from proxytune.seeds import proposal_seed
from proxytune.storage import Store
from proxytune.study import StudyRun, goal_of, open_study, stored_run
from proxytune.usefulness import bootstrap_means, compare, prpv_of_means

BUDGET, INITIAL = 40, 10
QUANTILES = norm.ppf((np.arange(32) + 0.5) / 32)


@dataclass(frozen=True)
class Search:
    """What a variant may look at: the objective, the seed and the trials so far."""

    objective: object
    seed: int
    trials: list

    @property
    def unit(self):
        return unit_array(self.objective.space, [trial.values for trial in self.trials])

    @property
    def draw(self):
        return proposal_seed(self.seed, len(self.trials))

    def surrogate(self):
        return fit_surrogate(self.objective.space, self.trials)


@dataclass(frozen=True)
class Variant:
    """How the next point of the unit cube is chosen, and the model from which the answer is taken."""

    propose: Callable
    model: Callable = Search.surrogate


# Acquisitions


def improvement(search, model=None):
    """The default's, with another model."""
    model = model or search.surrogate()
    _, incumbent = model.incumbent()
    gain = lambda points: gaussian_ei(points, model.model, y_opt=incumbent, xi=0.0)  # noqa: E731
    return maximise_gain(gain, search.unit, search.draw)[0]


def lower_bound(search):
    """Lower confidence bound, 1.96 standard deviations down."""
    model = search.surrogate()

    def gain(points):
        mean, deviation = model.predict(points)
        return 1.96 * deviation - mean

    return maximise_gain(gain, search.unit, search.draw)[0]


def exploit_at_the_end(search):
    """Expected improvement, but the last eight go where the posterior mean is lowest."""
    if len(search.trials) < BUDGET - 8:
        return improvement(search)
    model = search.surrogate()
    return maximise_gain(lambda points: -model.mean(points), search.unit, search.draw)[0]


def near_the_incumbent_at_the_end(search):
    """Expected improvement, but the last eight within a twentieth of the box around the incumbent."""
    model = search.surrogate()
    values, incumbent = model.incumbent()
    best = unit_array(model.space, [values])[0]

    def gain(points):
        near = np.abs(points - best).max(axis=1) < 0.05
        return np.where(near, gaussian_ei(points, model.model, y_opt=incumbent, xi=0.0), 0.0)

    return improvement(search) if len(search.trials) < BUDGET - 8 else _within(best, gain, search)


def _within(best, gain, search):
    """The cloud drawn into the neighbourhood, where few of its points would fall."""
    cloud = np.clip(best + 0.1 * (unit_points(len(best), 1024, search.draw) - 0.5), 0.0, 1.0)
    return cloud[np.argmax(gain(cloud))]


def knowledge_gradient(search):
    """How much one more score is expected to lower the lowest posterior mean (Scott, Frazier and Powell 2011)."""
    model = search.surrogate()
    mean_visited, _ = model.at_visited()
    visited = unit_array(model.space, [trial.values for trial in model.visited])
    regressor, noise = model.model, model.noise_deviation**2
    scale = float(regressor.y_train_std_) ** 2
    whitened_visited = _whitened(regressor, visited)

    def gain(points):
        mean, deviation = model.predict(points)
        shared = regressor.kernel_(visited, points) - whitened_visited.T @ _whitened(regressor, points)
        spread = np.sqrt(deviation**2 + noise)
        shifts = np.vstack([scale * shared, deviation**2]) / spread
        means = np.vstack([np.broadcast_to(mean_visited[:, None], (len(visited), len(points))), mean])
        after = np.mean([(means + shifts * z).min(axis=0) for z in QUANTILES], axis=0)
        return means.min(axis=0) - after

    return maximise_gain(gain, visited, search.draw)[0]


def _whitened(regressor, points):
    return solve_triangular(regressor.L_, regressor.kernel_(regressor.X_train_, points), lower=True)


# Models of the score


def smooth_to_the_power(nu):
    return Variant(lambda search: improvement(search, _fitted(search, nu=nu)), lambda search: _fitted(search, nu=nu))


def _fitted(search, nu=2.5, variances=None, transform=lambda score: score):
    space, order = search.objective.space, sorted(range(len(search.trials)), key=lambda i: search.trials[i].values)
    scores = np.array([transform(search.trials[i].score) for i in order])
    alpha = 1e-10 if variances is None else variances[order] / max(scores.var(), 1e-9)
    model = GaussianProcessRegressor(
        _kernel(nu), optimizer=most_probable, normalize_y=True, noise="gaussian", alpha=alpha
    )
    return Surrogate(space, model.fit(search.unit[order], scores), tuple(search.trials[i] for i in order))


def _kernel(nu):
    scales, bounds = np.full(4, LENGTH_SCALE.median), [LENGTH_SCALE.bounds] * 4
    smooth = ConstantKernel(AMPLITUDE.median, AMPLITUDE.bounds) * Matern(scales, bounds, nu)
    return smooth + WhiteKernel(NOISE.median, NOISE.bounds)


def _root(search):
    return _fitted(search, transform=lambda score: np.sqrt(score + 1.0))


def _bootstrapped(search):
    variances = [_variance(search.objective, trial.values, search.seed) for trial in search.trials]
    return _fitted(search, variances=np.maximum(0.25, variances))


def _variance(objective, values, seed):
    """Of PRPV, from 200 bootstraps of the proxy's episodes; the target's are the same at every θ."""
    inputs = compare(proxy=objective.table(values, seed), target=objective.target(seed), metrics=METRICS)
    proxy, _ = bootstrap_means(inputs, resamples=200, seed=0)
    return float(prpv_of_means(proxy, inputs.target.means, METRICS).var())


ANALYTIC, RANKING = Analytic(), Ranking()
DEFAULT = Variant(lambda search: None)
BOTH = {
    "lower confidence bound": Variant(lower_bound),
    "knowledge gradient": Variant(knowledge_gradient),
    "lowest mean for the last 8": Variant(exploit_at_the_end),
    "near the incumbent for the last 8": Variant(near_the_incumbent_at_the_end),
    "Matérn 3/2": smooth_to_the_power(1.5),
    "square root of the score": Variant(lambda search: improvement(search, _root(search)), _root),
}
VARIANTS = {
    "analytic": BOTH,
    "ranking": {
        **BOTH,
        "bootstrapped variance": Variant(lambda search: improvement(search, _bootstrapped(search)), _bootstrapped),
    },
}


def run(objective, name, variant, seed):
    """One search of a variant, told as `compare` tells those of engines."""
    search = Search(objective, seed, [])
    for number in range(BUDGET):
        if number < INITIAL:
            values = design_point(objective.space, number, seed)
        elif variant is DEFAULT:
            values = GaussianProcess().propose(objective.space, search.trials, seed)
        else:
            values = from_unit(objective.space, variant.propose(search))
        search.trials.append(Trial(values, objective.score(values, seed)))
    answer, _ = variant.model(search).incumbent()
    regrets, regret = tuple(objective.regret(t.values, seed) for t in search.trials), objective.regret(answer, seed)
    key = RunKey(objective.identity, name, seed, BUDGET, INITIAL, "")
    found = Judgement(regrets, answer, regret, regret, None, None, "")
    return Run(key, tuple(trial.values for trial in search.trials), 0.0, found)


def told(found, name, default):
    """One line: how often and when the floor was reached, and the paired differences to the default."""
    parts = [f"{name:34}", f"{found.reached:2} of {found.seeds}", f"{found.evaluations.value:4.0f}"]
    parts += [_difference(found.saved, -1.0), _difference(found.regret_difference, 1.0)] if found.saved else []
    print(" | ".join([*parts, f"regret {found.regret.value:.1f}"]), flush=True)


def _difference(found, sign):
    low, high = sorted((sign * found.low, sign * found.high))
    return f"{sign * found.value + 0.0:+.1f} ({low + 0.0:+.1f} to {high + 0.0:+.1f})"


def predict_held_out(folder):
    """Print how well either model predicts the trials of a finished study that it was not told of."""
    opened = open_study(folder)
    with Store.read(opened.settings.folder) as store:
        study = stored_run(opened, store).study
        trials = [StudyRun(study, store).search_trial(trial) for trial in store.trials() if trial.prpv is not None]
        goal = goal_of(StudyRun(study, store))
    space = study.settings.space
    unit = unit_array(space, [trial.values for trial in trials])
    actual = np.array([trial.score for trial in trials])
    predicted = {"constant": [], "of the score": [], "of the metrics": []}
    for place in range(len(trials)):
        rest = np.arange(len(trials)) != place
        others = [trial for kept, trial in zip(rest, trials, strict=True) if kept]
        surrogate = fit_surrogate(space, others)
        predicted["constant"].append(actual[rest].mean())
        predicted["of the score"].append(surrogate.mean(unit[[place]])[0])
        predicted["of the metrics"].append(composed_scores(fit_outputs(space, others), goal, 1)(unit[[place]]).mean())
    print(f"{len(trials)} held-out trials of {study.settings.name}")
    for name, found in predicted.items():
        error = np.array(found) - actual
        order = "" if name == "constant" else f", rank correlation {spearmanr(found, actual).statistic:.2f}"
        print(f"model {name:15} error {np.sqrt(np.mean(error**2)):.1f}, of which bias {error.mean():+.1f}{order}")


def main():
    """Compare variants, or the models on a study."""
    parser = argparse.ArgumentParser()
    parser.add_argument("objective", help=f"{', '.join(VARIANTS)}, or the folder of a finished study")
    parser.add_argument("variants", nargs="*")
    parser.add_argument("--seeds", type=int, default=30)
    asked = parser.parse_args()
    if asked.objective not in VARIANTS:
        predict_held_out(Path(asked.objective))
        return
    objective, seeds = {"analytic": ANALYTIC, "ranking": RANKING}[asked.objective], range(1, asked.seeds + 1)
    print("variant | at the floor | evaluations to it | saved against gp | regret against gp's | regret")
    default = [run(objective, "gp", DEFAULT, seed) for seed in seeds]
    told(summarise(default, default, objective.tolerance), "gp", default)
    for name in asked.variants or VARIANTS[asked.objective]:
        runs = [run(objective, name, VARIANTS[asked.objective][name], seed) for seed in seeds]
        told(summarise(runs, default, objective.tolerance), name, default)


if __name__ == "__main__":
    main()
