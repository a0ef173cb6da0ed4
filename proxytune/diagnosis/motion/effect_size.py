"""The size of an effect: how much larger the error of prediction is without it, whatever its evidence.

On much data an effect of a millimetre has clear evidence. With a the error over windows of a horizon of the model with
the effect, and b that of the model without it, all else fitted again, its size is b / a with a 95 % interval. An effect
that draws at random moves no mean: with s the distance of drawn and expected replays and e the error, the error without
the draws would be √(e² − s²), and its size is e / √(e² − s²). `drop_negligible` drops effects whose size is not shown
to be above `rules.material_factor`, on the fitted drives, each block predicted by what was fitted to others, so that
the drives kept aside can tell what that came to (`measure_effect_sizes`).

The same traces of effects say which effects these drives could not have shown (`invisible_effects`), and the wheels'
gains of single drives whether all are of one robot (`find_robot_clusters`).
"""

import math
from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from proxytune.diagnosis.answer import RULES, Rules
from proxytune.diagnosis.motion import innovations, multistep_fit
from proxytune.diagnosis.motion.drives import Drives, Floats, sum_by
from proxytune.diagnosis.motion.evidence import AdoptedEffect, DroppedEffect, Findings, Variant, without_effect
from proxytune.diagnosis.motion.fitting import KEPT_SOLVABLE, Fit, evaluate, fit, slopes
from proxytune.diagnosis.motion.prediction import Ratio, Windows, blocks_of, cut, motion_in, ratio, rmse
from proxytune.diagnosis.motion.random_effects import responses
from proxytune.diagnosis.motion.screening import candidates, motion_effects, project_out
from proxytune.space import Theta

FITTED_S = 2.0
"""Windows that models with and without an effect are fitted to, the longest that drives have up to this."""
DRAWS = 10
"""How often the drives are replayed with a random effect drawn."""
LARGEST_SHARE = 0.95
"""A random effect is said to make up no more of the error than this share, even if its draws stray further."""
EffectSize = Mapping[float, Ratio]
"""The error without an effect by the error with it, by horizon [s]."""


class WeighedEffect(NamedTuple):
    """An effect with its size, judged by rules."""

    effect: AdoptedEffect
    size: EffectSize
    rules: Rules = RULES

    @property
    def material(self) -> bool:
        """Tell whether predictions are shown to need it; draws add to the error at every horizon: one is not enough."""
        shown = sum(one.value >= self.rules.material_factor and one.above for one in self.size.values())
        return shown >= (1 if self.effect.free else min(2, len(self.size)))

    @property
    def harmful(self) -> bool:
        """Tell whether predictions are shown to be better without it."""
        return any(one.value <= 1.0 / self.rules.material_factor and one.below for one in self.size.values())


def drop_negligible(found: Findings, seed: int, aside: Drives | None = None) -> Findings:
    """Drop the effects that are negligible for prediction, the weakest first."""
    drives = found.model.drives
    variant, kept = Variant(found.model.theta, found.model.free), list(found.adopted)
    dropped: list[DroppedEffect] = []
    while kept and multistep_fit.horizons(drives) and (aside is None or multistep_fit.horizons(aside)):
        sizes = measure_effect_sizes(found.model, aside, variant, kept, seed)
        weighed = [WeighedEffect(effect, size, drives.rules) for effect, size in zip(kept, sizes, strict=True)]
        # On drives kept aside anything that is shown will do; on those that were fitted effects have to be material.
        worth = [one.material if aside is None else any(size.above for size in one.size.values()) for one in weighed]
        negligible = [one for one, needed in zip(weighed, worth, strict=True) if not needed]
        weakest = min(negligible, key=lambda one: max(size.value for size in one.size.values()), default=None)
        if weakest is None:
            break
        dropped.append(DroppedEffect(weakest.effect, variant, weakest.harmful))
        variant = without_effect(variant, weakest.effect, drives.rate_hz)
        kept.remove(weakest.effect)
        if not weakest.effect.free:
            # A delay that was needless beside its draws has their lateness back, and is weighed with that.
            back = [one.effect for one in dropped if one.effect.effect == "delay"]
            dropped, kept = [one for one in dropped if one.effect not in back], kept + back
            variant = variant._replace(free=variant.free + tuple(own for one in back for own in one.free))
    if not dropped:
        return found
    model = fit(drives, variant.theta, variant.free, found.model.noise)
    return replace(found, model=model, adopted=tuple(kept), negligible=found.negligible + tuple(dropped))


def measure_effect_sizes(
    model: Fit, tested: Drives | None, variant: Variant, effects: Iterable[AdoptedEffect], seed: int
) -> list[EffectSize]:
    """Measure the error without each effect by that with all, on other drives, else with blocks left out in turn."""
    drives, rate_hz = model.drives if tested is None else tested, model.drives.rate_hz

    def squares(one: Variant) -> dict[float, Floats]:
        return _held_out(model, one)[1] if tested is None else _squares(model, tested, one)

    whole, sizes = squares(variant), list[EffectSize]()
    for effect in effects:
        if effect.free:
            sizes.append(multistep_fit.compare_errors(drives, squares(without_effect(variant, effect, rate_hz)), whole))
        else:
            # Blocks left out add errors of the fit, which are no draws.
            plain = multistep_fit.squared_errors(drives, variant.theta) if tested is None else whole
            sizes.append(_size_of_draws(drives, variant, plain, seed))
    return sizes


def _squares(model: Fit, tested: Drives, variant: Variant) -> dict[float, Floats]:
    """Squared errors on drives that nothing was fitted to, by horizon [s]."""
    fitted = model.drives
    theta = _held_out(model, variant)[0] if fitted.robot.drive == "ackermann" else None
    if theta is None:
        theta = multistep_fit.fit_windows(fitted, variant.theta, variant.free, cut(fitted, _length(fitted)))
    return multistep_fit.squared_errors(tested, theta)


def _held_out(model: Fit, variant: Variant) -> tuple[Theta | None, dict[float, Floats]]:
    """Squared held-out errors by horizon [s] of a variant fitted to windows, or to steps, with that θ, if better."""
    drives, length = model.drives, _length(model.drives)
    windows = multistep_fit.held_out_squares(drives, variant.theta, variant.free, length)
    if drives.robot.drive != "ackermann" or not windows:
        return None, windows
    # The many parameters of a car wander when they are fitted to windows.
    theta = fit(drives, variant.theta, variant.free, model.noise).theta
    steps = multistep_fit.squared_errors(drives, theta)
    return (theta, steps) if steps[length].mean() < windows[length].mean() else (None, windows)


def _length(drives: Drives) -> float:
    known = multistep_fit.horizons(drives)
    return max((h for h in known if h <= FITTED_S), default=min(known, default=FITTED_S))


def _size_of_draws(drives: Drives, variant: Variant, whole: Mapping[float, Floats], seed: int) -> dict[float, Ratio]:
    """The size of a random effect: how much of the error its draws make up."""
    found, noise = {}, multistep_fit.pose_noise(drives, variant.theta)
    for horizon, squares in whole.items():
        windows = cut(drives, horizon)
        blocks, floor = blocks_of(drives, windows), multistep_fit.noise_floor(drives, windows, noise)[0]
        share = ratio(_drawn_squares(drives, variant, windows, seed), squares, blocks)
        error = rmse(squares, blocks)
        sizes = []
        for drawn, most in zip((share.value, *share.interval), (error.value, *error.interval), strict=True):
            # Draws that would leave less than what the noise of poses makes alone are not in the data.
            room = float(np.sqrt(max(0.0, 1.0 - (floor / most) ** 2))) if most > 0.0 else 0.0
            sizes.append(float(1.0 / np.sqrt(1.0 - min(min(drawn, room), LARGEST_SHARE) ** 2)))
        found[horizon] = Ratio(sizes[0], (sizes[1], sizes[2]))
    return found


def _drawn_squares(drives: Drives, variant: Variant, windows: Windows, seed: int) -> Floats:
    """Mean squared distance [m²] of drawn and expected replays at every compared pose (M,)."""
    expected = motion_in(drives, innovations.paths(drives, variant.theta), windows, in_one_go=True)
    total = np.zeros(len(expected))
    for draw in range(DRAWS):
        drawn = motion_in(drives, innovations.drawn_paths(drives, variant.theta, seed + draw), windows, in_one_go=True)
        total += np.square(drawn - expected)[:, :2].sum(axis=1)
    return total / DRAWS


def invisible_effects(model: Fit, taken: set[str]) -> tuple[str, ...]:
    """The motion effects that would have left too few nats to be seen at the middle of their probes."""
    robot, rules = model.drives.robot, model.drives.rules
    forms = candidates(robot, model.theta, taken)
    best: dict[str, float] = {}
    plain = {form.effect for form in forms if not form.form}
    for form in (form for form in forms if not form.form or form.effect not in plain):
        nats = 0.0
        if form.probes:
            moved = form.theta_at(model.theta, form.middle_probe)
            change = innovations.increments(model.drives, model.theta) - innovations.increments(model.drives, moved)
            column = model.whiten.whiten(change)[:, None]
            direction = project_out(model.slopes, column, np.ones(len(column)))[:, 0]
            nats = 0.5 * float(direction @ direction)
        best[form.effect] = max(best.get(form.effect, 0.0), nats)
    strike = rules.struck_share * float(responses(model, np.empty((len(model.innovations), 0))).size.sum()) / 2.0
    best |= {name: strike for name in innovations.RANDOM_EFFECTS if name not in taken}
    seen = {name for name, nats in best.items() if not nats < rules.visible_nats}
    return tuple(name for name in motion_effects(robot.catalogue) if name not in taken and name not in seen)


GAINS: Mapping[str, Mapping[str, innovations.Coordinate]] = {
    "differential": {"left": ("wheel_gain.left",), "right": ("wheel_gain.right",)},
    "ackermann": {"driven": ("wheel_gain",), "steered": ("steering_gain",)},
}
"""What tells robots apart, by how they drive."""
AT_ONCE = 100_000
"""About so many increments are looked at together: what is computed of each takes a kilobyte."""


class RobotClusters(NamedTuple):
    """Two groups of drives with different wheel gains, as if of two robots."""

    wheel: str  # "left" or "right", of a car "driven" or "steered": whichever tells them apart better
    gains: tuple[float, float]  # mean gain of that wheel in either group
    groups: tuple[tuple[int, ...], tuple[int, ...]]  # numbers of the drives in either group


def find_robot_clusters(drives: Drives, model: Fit) -> RobotClusters | None:
    """Find the two groups that drives fall in by a wheel's gain, None where they are all alike."""
    episodes = np.unique(drives.episode)
    if len(episodes) < 2 * drives.rules.robot_drives:
        return None
    batches = np.array_split(episodes, math.ceil(len(drives.episode) / AT_ONCE))
    gains, deviations = np.concatenate([_own_gains(drives.some(batch), model) for batch in batches], axis=1)
    found = [_groups(episodes, gains[:, side], deviations[:, side], drives.rules) for side in range(2)]
    clearest, side = max(((clear, side) for side, (clear, _) in enumerate(found)), key=lambda pair: pair[0])
    # Effects of one robot that a model lacks spread the gains too, but leave no gap between two groups.
    if clearest < 1.0:
        return None
    groups = found[side][1]
    means = [float(gains[np.isin(episodes, group), side].mean()) for group in groups]
    return RobotClusters(list(GAINS[drives.robot.drive])[side], (means[0], means[1]), groups)


def _own_gains(drives: Drives, model: Fit) -> tuple[Floats, Floats]:
    """Each drive's own gains and their deviations (E, 2): one Newton step from the gains of all."""
    coordinates = tuple(GAINS[drives.robot.drive].values())
    neutral = {name: model.theta.get(name, 1.0) for (name,) in coordinates}
    whole, count = evaluate(drives, {**model.theta, **neutral}, (), model.noise), len(drives.duties)
    columns = slopes(drives, whole.theta, coordinates, whole.whiten)
    label = np.repeat(drives.episode, 3)
    z = whole.innovations
    gradient = sum_by(label, columns * innovations.clip_outliers(z)[:, None], count)
    inner = columns * (np.abs(z) < innovations.HUBER)[:, None]
    hessian = sum_by(label, columns[:, :, None] * inner[:, None, :], count) + KEPT_SOLVABLE * np.eye(2)
    loud = np.maximum(1.0, sum_by(label, innovations.clip_outliers(z) ** 2, count) / np.bincount(label))
    inverse = np.linalg.inv(hessian)
    step = -np.einsum("eij,ej->ei", inverse, gradient)
    low, high = innovations.spans(coordinates, drives)
    here = np.array([whole.theta[name] for (name,) in coordinates])
    variances = np.diagonal(inverse, axis1=1, axis2=2) * loud[:, None]
    return here + step * (high - low), np.sqrt(variances) * (high - low)


def _groups(
    episodes: Floats, gains: Floats, deviations: Floats, rules: Rules
) -> tuple[float, tuple[tuple[int, ...], tuple[int, ...]]]:
    """The clearness of the widest gap between sorted gains, 1 where it just makes two groups; and the groups."""
    sure = np.flatnonzero(deviations < rules.robot_gain_apart)
    order = sure[np.argsort(gains[sure])]
    least = max(rules.robot_drives, math.ceil(rules.robot_share * len(order)))
    places = np.arange(least, len(order) - least + 1)
    if not len(places):
        return 0.0, ((), ())
    sorted_gains = gains[order]
    at = int(places[np.argmax(sorted_gains[places] - sorted_gains[places - 1])])
    gap = float(sorted_gains[at] - sorted_gains[at - 1])
    within = max(float(sorted_gains[:at].std(ddof=1)), float(sorted_gains[at:].std(ddof=1)))
    unsure = max(within, float(np.median(deviations[order])))
    clear = gap / max(rules.robot_gain_apart, rules.robot_gap * unsure)
    one, other = (tuple(sorted(int(e) for e in episodes[part])) for part in (order[:at], order[at:]))
    return clear, (one, other)
